//! What is written can be read.

use wheatstone_core::dataset::volume::Trust;
use wheatstone_reconstruction::{Cloud, DepthPng, binary_ply, depth_png, depth_tiff};

#[test]
fn a_cloud_is_a_binary_ply() {
    let mut cloud = Cloud::default();
    for index in 0..3_u8 {
        let value = f32::from(index);
        cloud.points.push([value, 2.0 * value, -value]);
        cloud.sigmas.push([0.1, 0.2, 0.3 + value]);
        cloud.confidence.push(0.9 + 0.01 * value);
        cloud.colours.push([index, 10, 200]);
        cloud.trust.push(Trust::Inside);
        cloud.places.push(u32::from(index));
    }
    let mut bytes = Vec::new();
    binary_ply(&cloud, "mm\nproperty float evil", &mut bytes).unwrap();
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|part| part == end).unwrap() + end.len();
    let text = String::from_utf8(bytes[..header].to_vec()).unwrap();
    assert!(text.starts_with("ply\nformat binary_little_endian 1.0\n"), "{text}");
    assert!(text.contains("element vertex 3\n") && !text.contains("\nproperty float evil"));
    assert_eq!(text.matches("\nproperty ").count(), 10);
    let rows = &bytes[header..];
    assert_eq!(rows.len(), 3 * 31);
    let number =
        |row: usize, at: usize| f32::from_le_bytes(rows[31 * row + at..][..4].try_into().unwrap());
    assert_eq!([number(2, 0), number(2, 4), number(2, 8)], [2.0, 4.0, -2.0]);
    assert_eq!(rows[31 + 12..31 + 15], [1, 10, 200]);
    assert_eq!([number(1, 15), number(1, 19), number(1, 23)], [0.1, 0.2, 1.3]);
    assert!((number(2, 27) - 0.92).abs() < 1e-6);
    assert_eq!(cloud.bounds(), Some([[0.0, 0.0, -2.0], [2.0, 4.0, 0.0]]));
}

#[test]
fn depths_come_back_from_their_pictures() {
    let depth = [f32::NAN, 0.5, 123.456, 800.0, 65.535, f32::NAN];
    let mut bytes = Vec::new();
    depth_tiff((3, 2), &depth, "mm", std::io::Cursor::new(&mut bytes)).unwrap();
    let mut decoder = tiff::decoder::Decoder::new(std::io::Cursor::new(&bytes)).unwrap();
    assert_eq!(decoder.dimensions().unwrap(), (3, 2));
    let described = decoder.get_tag_ascii_string(tiff::tags::Tag::ImageDescription).unwrap();
    assert!(described.contains("unit: mm"), "{described}");
    let tiff::decoder::DecodingResult::F32(read) = decoder.read_image().unwrap() else {
        panic!("not floats")
    };
    assert!(read.iter().zip(&depth).all(|(a, b)| a.to_bits() == b.to_bits()));

    let scale = DepthPng::of(&depth);
    assert_eq!(scale.step, 0.1);
    let mut bytes = Vec::new();
    depth_png((3, 2), &depth, (scale, "mm"), &mut bytes).unwrap();
    let read = image::load_from_memory(&bytes).unwrap().into_luma16();
    assert_eq!(read.into_raw(), [0, 5, 1235, 8000, 655, 0]);
}
