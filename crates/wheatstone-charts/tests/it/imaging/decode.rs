//! Pictures from files, whole and broken.

use image::{DynamicImage, ExtendedColorType as Kind, ImageEncoder};
use wheatstone_charts::imaging::{Limits, decode_image, read_image};
use wheatstone_core::Error;

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn eight_and_sixteen_bit_files_of_every_kind_read_alike() {
    let dir = folder();
    let bytes: Vec<u8> = (0..48).map(|i| (i * 5) as u8).collect();
    let words: Vec<u16> = bytes.iter().map(|b| u16::from(*b) * 257).collect();
    let expected: Vec<f32> = bytes.iter().map(|b| f32::from(*b)).collect();
    let eight = DynamicImage::ImageLuma8(image::GrayImage::from_raw(8, 6, bytes).unwrap());
    let sixteen = DynamicImage::ImageLuma16(image::ImageBuffer::from_raw(8, 6, words).unwrap());
    for (picture, extensions) in
        [(&eight, &["png", "tif", "pgm", "bmp"][..]), (&sixteen, &["png", "tif"][..])]
    {
        for extension in extensions {
            let path = dir.path().join(format!("{:?}.{extension}", picture.color()));
            picture.save(&path).unwrap();
            let read = read_image(&path, Limits::default()).unwrap();
            assert_eq!((read.width(), read.height()), (8, 6));
            assert_eq!(read.values(), expected, "{extension}");
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(decode_image(&path, &bytes, Limits::default()).unwrap(), read);
        }
    }
    // A file is what its first bytes say, whatever its name says.
    let misnamed = dir.path().join("misnamed.jpg");
    eight.save_with_format(&misnamed, image::ImageFormat::Png).unwrap();
    assert_eq!(read_image(&misnamed, Limits::default()).unwrap().values(), expected);
}

#[test]
fn every_truncation_is_an_error_or_the_whole_picture() {
    let dir = folder();
    let mut file = Vec::new();
    let values: Vec<u8> = (0..32 * 32).map(|i| (i * 7 % 251) as u8).collect();
    image::codecs::png::PngEncoder::new(&mut file).write_image(&values, 32, 32, Kind::L8).unwrap();
    let whole: Vec<f32> = values.iter().map(|v| f32::from(*v)).collect();
    for length in (0..file.len()).step_by(7) {
        let path = dir.path().join("cut.png");
        std::fs::write(&path, &file[..length]).unwrap();
        match read_image(&path, Limits::default()) {
            Ok(picture) => assert_eq!(picture.values(), whole, "half a picture at {length}"),
            Err(e) => assert!(e.to_string().contains("cut.png") && e.hint().is_some()),
        }
    }
}

#[test]
fn a_bomb_is_refused_by_its_header() {
    // The smallest PNG header that claims 60000 x 60000 pixels of 16-bit colour.
    let mut file = b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR".to_vec();
    file.extend([0, 0, 0xEA, 0x60, 0, 0, 0xEA, 0x60, 16, 2, 0, 0, 0]);
    file.extend([0x5C, 0xD6, 0xCD, 0x33]);
    let dir = folder();
    let path = dir.path().join("bomb.png");
    std::fs::write(&path, file).unwrap();
    assert!(read_image(&path, Limits::default()).is_err());
    // A PGM needs no checksum, so that its header is believed.
    std::fs::write(&path, b"P5 60000 60000 255\n").unwrap();
    let error = read_image(&path, Limits::default()).unwrap_err().to_string();
    assert!(error.contains("60000 x 60000"), "{error}");
}

#[test]
fn folders_and_missing_files_are_named() {
    let dir = folder();
    for path in [dir.path().to_path_buf(), dir.path().join("none.png")] {
        let error = read_image(&path, Limits::default()).unwrap_err();
        assert!(matches!(error, Error::Io { .. }));
        assert!(error.to_string().contains(&path.display().to_string()));
    }
}

#[test]
fn empty_files_and_pixels_of_other_kinds_are_named() {
    let dir = folder();
    let path = dir.path().join("empty.png");
    std::fs::write(&path, b"").unwrap();
    let error = read_image(&path, Limits::default()).unwrap_err();
    assert!(error.to_string().contains("empty.png") && error.to_string().contains("is empty"));
    let path = dir.path().join("float.tif");
    std::fs::write(&path, float_tiff()).unwrap();
    let error = read_image(&path, Limits::default()).unwrap_err();
    assert!(error.to_string().contains("floating-point"), "{error}");
    assert!(error.hint().unwrap().contains("8 or 16 bits"));
    let path = dir.path().join("film.png");
    std::fs::write(&path, b"\x76\x2f\x31\x01\x02\0\0\0").unwrap();
    let error = read_image(&path, Limits::default()).unwrap_err();
    assert!(error.to_string().contains("OPENEXR pictures cannot be read"), "{error}");
}

#[test]
fn a_video_is_named_with_the_way_to_its_frames() {
    let dir = folder();
    let path = dir.path().join("left.MP4");
    std::fs::write(&path, b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2avc1mp41").unwrap();
    let error = read_image(&path, Limits::default()).unwrap_err();
    assert!(error.to_string().contains("a video"), "{error}");
    assert!(error.hint().unwrap().contains("frames"));
}

/// A TIFF of pictures of one grey value each, with the kind that each of them has.
fn tiff(kinds: &[u32]) -> Vec<u8> {
    let mut file = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut file).unwrap();
    for (value, kind) in (1_u8..).zip(kinds) {
        let mut page = encoder.new_image::<tiff::encoder::colortype::Gray8>(8, 6).unwrap();
        page.encoder().write_tag(tiff::tags::Tag::NewSubfileType, *kind).unwrap();
        page.write_data(&[value; 48]).unwrap();
    }
    file.into_inner()
}

#[test]
fn a_tiff_of_several_pictures_is_refused_with_their_number() {
    let path = std::path::Path::new("stack.tif");
    for kinds in [&[0, 0][..], &[2; 12]] {
        let error = decode_image(path, &tiff(kinds), Limits::default()).unwrap_err();
        let told = format!("stack.tif: a TIFF of {} pictures, not one", kinds.len());
        assert!(error.to_string().contains(&told), "{error}");
        assert!(error.hint().unwrap().contains("a file of its own"));
    }
    // One picture, alone or with a smaller copy and a mask.
    for kinds in [&[0][..], &[0, 1], &[0, 1, 4]] {
        let read = decode_image(path, &tiff(kinds), Limits::default()).unwrap();
        assert_eq!(read.values(), [1.0; 48]);
    }
    // What follows the first picture may be damaged: that is read as before.
    let whole = tiff(&[0, 0]);
    for length in 0..whole.len() {
        if let Ok(read) = decode_image(path, &whole[..length], Limits::default()) {
            assert_eq!(read.values(), [1.0; 48]);
        }
    }
}

/// A TIFF of one grey pixel in 32-bit floating point.
fn float_tiff() -> Vec<u8> {
    // Tag, type (3: 16 bits, 4: 32 bits), value; one strip behind the directory.
    let entries: [(u16, u16, u32); 9] = [
        (256, 4, 1),
        (257, 4, 1),
        (258, 3, 32),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, 8 + 2 + 9 * 12 + 4),
        (277, 3, 1),
        (279, 4, 4),
        (339, 3, 3),
    ];
    let mut file = b"II*\0\x08\0\0\0\x09\0".to_vec();
    for (tag, kind, value) in entries {
        file.extend(tag.to_le_bytes().into_iter().chain(kind.to_le_bytes()));
        file.extend(1_u32.to_le_bytes().into_iter().chain(value.to_le_bytes()));
    }
    file.extend([0; 4]);
    file.extend(0.5_f32.to_le_bytes());
    file
}
