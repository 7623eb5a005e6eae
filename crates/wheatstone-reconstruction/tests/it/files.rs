//! What is written can be read.

use std::io::Cursor;
use wheatstone_core::{Error, dataset::volume::Trust};
use wheatstone_reconstruction::{
    CLOUD_FORMATS, Cloud, CloudFormat, DepthPng, depth_png, depth_tiff,
};

fn small_cloud() -> Cloud {
    let mut cloud = Cloud::default();
    for index in 0..3_u8 {
        let value = f32::from(index);
        cloud.points.push([1.0, 2.0, -1.0].map(|factor| factor * f64::from(value)));
        cloud.sigmas.push([0.1, 0.2, 0.3 + value]);
        cloud.confidence.push(0.9 + 0.01 * value);
        cloud.colours.push([index, 10, 200]);
        cloud.trust.push(Trust::Inside);
        cloud.places.push(u32::from(index));
    }
    cloud
}

#[test]
fn a_cloud_is_a_binary_ply() {
    let cloud = small_cloud();
    let mut bytes = Vec::new();
    let unit = "mm\nproperty float evil";
    CloudFormat::named("ply").unwrap().encode(&cloud, unit, &mut bytes).unwrap();
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
fn far_from_the_origin_a_ply_has_doubles() {
    const FAR: f64 = 3e6;
    let near = small_cloud();
    let mut far = near.clone();
    far.points.iter_mut().for_each(|point| point[1] += FAR);
    // Floats are a quarter apart there.
    assert_eq!([near.float_rounding(), far.float_rounding()], [None, Some(0.125)]);
    let bytes = encoded("ply", &far);
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|part| part == end).unwrap() + end.len();
    let header = String::from_utf8_lossy(&bytes[..start]).into_owned();
    for property in ["double x", "double y", "double z", "float sigma_x"] {
        assert!(header.contains(&format!("\nproperty {property}\n")), "{header}");
    }
    for (row, point) in bytes[start..].chunks_exact(43).zip(&far.points) {
        let read = [0, 8, 16].map(|at| f64::from_le_bytes(row[at..at + 8].try_into().unwrap()));
        assert_eq!(read, *point);
    }
    assert_eq!(bytes.len() - start, 3 * 43);
    // Without error bars there is nothing to compare with.
    far.sigmas.iter_mut().for_each(|sigmas| *sigmas = [0.0; 3]);
    assert_eq!(far.float_rounding(), None);
}

/// What a format writes of a cloud in millimetres.
fn encoded(name: &str, cloud: &Cloud) -> Vec<u8> {
    let mut bytes = Vec::new();
    CloudFormat::named(name).unwrap().encode(cloud, "mm", &mut bytes).unwrap();
    bytes
}

/// X, Y, Z, red, green, blue, standard deviations and confidence of the points, lengths times a factor.
fn rows(cloud: &Cloud, factor: f64) -> Vec<[f64; 10]> {
    let row = |index: usize| {
        let length = |value: f32| f64::from(value) * factor;
        let [x, y, z] = cloud.points[index].map(|value| value * factor);
        let [red, green, blue] = cloud.colours[index].map(f64::from);
        let [a, b, c] = cloud.sigmas[index].map(length);
        [x, y, z, red, green, blue, a, b, c, f64::from(cloud.confidence[index])]
    };
    (0..cloud.len()).map(row).collect()
}

/// Whether numbers are the same to the seven digits of single precision, or to a billionth.
fn assert_same(read: &[[f64; 10]], expected: &[[f64; 10]]) {
    assert_eq!(read.len(), expected.len());
    for (a, b) in read.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((a - b).abs() <= 1e-9 + 1e-7 * b.abs(), "{read:?} {expected:?}");
    }
}

fn number(bytes: &[u8], at: usize) -> f64 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()).into()
}

#[test]
fn clouds_come_back_from_pcd() {
    let cloud = small_cloud();
    let bytes = encoded("pcd", &cloud);
    let start = bytes.windows(12).position(|part| part == b"DATA binary\n").unwrap() + 12;
    let header = String::from_utf8_lossy(&bytes[..start]);
    assert!(header.contains("\nFIELDS x y z rgb sigma_x sigma_y sigma_z confidence\n"), "{header}");
    let rows_read: Vec<[f64; 10]> = bytes[start..]
        .chunks(32)
        .map(|row| {
            let [x, y, z, a, b, c, confidence] =
                [0, 4, 8, 16, 20, 24, 28].map(|at| number(row, at));
            let [blue, green, red] = [12, 13, 14].map(|at| f64::from(row[at]));
            [x, y, z, red, green, blue, a, b, c, confidence]
        })
        .collect();
    assert_same(&rows_read, &rows(&cloud, 1.0));
}

#[test]
fn clouds_come_back_from_e57_in_metres() {
    let cloud = small_cloud();
    let bytes = encoded("e57", &cloud);
    assert_eq!(bytes, encoded("e57", &cloud), "equal clouds give equal files");
    let mut reader = e57::E57Reader::new(Cursor::new(&bytes)).unwrap();
    let part = reader.pointclouds().remove(0);
    let types: Vec<_> = part.prototype.iter().map(|record| record.data_type.clone()).collect();
    let points = reader.pointcloud_raw(&part).unwrap();
    let read: Vec<[f64; 10]> = points
        .map(|point| {
            let point = point.unwrap();
            std::array::from_fn(|column| point[column].to_f64(&types[column]).unwrap())
        })
        .collect();
    assert_same(&read, &rows(&cloud, 1e-3));
}

#[test]
fn clouds_come_back_from_laz_in_metres() {
    let cloud = small_cloud();
    let mut reader = las::Reader::new(Cursor::new(encoded("laz", &cloud))).unwrap();
    let described = &reader.header().vlrs().iter().find(|vlr| vlr.record_id == 4).unwrap().data;
    assert_eq!(described.len(), 4 * 192);
    assert!(described[192 + 4..].starts_with(b"sigma_y\0"));
    let all = reader.read_all().unwrap();
    let read: Vec<[f64; 10]> = all
        .points()
        .map(|point| {
            let point = point.unwrap();
            let colour = point.color.unwrap();
            let [red, green, blue] =
                [colour.red, colour.green, colour.blue].map(|value| f64::from(value) / 257.0);
            let [a, b, c, confidence] = [0, 4, 8, 12].map(|at| number(&point.extra_bytes, at));
            [point.x, point.y, point.z, red, green, blue, a, b, c, confidence]
        })
        .collect();
    assert_same(&read, &rows(&cloud, 1e-3));
}

#[test]
fn every_format_takes_an_empty_cloud_and_other_extensions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for format in CLOUD_FORMATS {
        let path = folder.path().join(format!("a.{}", format.name.to_uppercase()));
        let by_name = CloudFormat::of_file(&path).unwrap();
        by_name.save(&Cloud::default(), "m", &path).unwrap();
        assert!(path.metadata().unwrap().len() > 50, "{format:?}");
    }
    for name in ["cloud.txt", "cloud"] {
        let refused = CloudFormat::of_file(std::path::Path::new(name));
        assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?}");
    }
}

#[test]
fn depths_come_back_from_their_pictures() {
    let depth = [f32::NAN, 0.5, 123.456, 800.0, 65.535, f32::NAN];
    let mut bytes = Vec::new();
    depth_tiff((3, 2), &depth, "mm", Cursor::new(&mut bytes)).unwrap();
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(&bytes)).unwrap();
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
