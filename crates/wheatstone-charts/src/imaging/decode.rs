//! Picture files to grey values, within limits that a hostile or broken file cannot pass.

use super::GrayImage;
use image::{DynamicImage, ImageDecoder, ImageReader};
use std::{io::BufReader, path::Path};
use wheatstone_core::{Error, Result, storage};

/// The largest picture that is decoded.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most pixels along either side.
    pub side: u32,
    /// Most pixels in all.
    pub pixels: u64,
}

impl Default for Limits {
    /// Above the largest industrial sensors sold (151 megapixels), below what fills a machine.
    fn default() -> Self {
        Self { side: 16_384, pixels: 160_000_000 }
    }
}

/// Reads a PNG, JPEG, TIFF, BMP or PGM, 8 or 16 bit, grey or colour (luma of ITU-R BT.601's kind,
/// as the decoder gives it). An orientation noted by the camera is applied.
///
/// # Errors
///
/// [`Error::Io`] where the file cannot be read, [`Error::Image`] where it is not a whole picture
/// of a known kind or passes `limits`.
pub fn read_image(path: &Path, limits: Limits) -> Result<GrayImage> {
    let refuse = |problem: String, hint: &str| Error::Image {
        path: path.into(),
        problem,
        hint: hint.into(),
    };
    let broken = |e: image::ImageError| {
        refuse(
            format!("not a whole picture: {e}"),
            "PNG, JPEG, TIFF, BMP and PGM are read; is the file truncated?",
        )
    };
    let reader = ImageReader::new(BufReader::new(storage::open(path)?))
        .with_guessed_format()
        .map_err(|e| Error::reading(path, e))?;
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(refuse("the picture has no pixels".into(), "is the file truncated?"));
    }
    if width.max(height) > limits.side || u64::from(width) * u64::from(height) > limits.pixels {
        return Err(refuse(
            format!(
                "{width} x {height} pixels; at most {} a side and {} in all are read",
                limits.side, limits.pixels
            ),
            "is the file broken? Otherwise scale the picture down",
        ));
    }
    let mut allocation = image::Limits::default();
    // Sixteen bytes hold a pixel of any kind that is read; decoders work in about as much again.
    allocation.max_alloc = Some(32 * u64::from(width) * u64::from(height) + (1 << 20));
    decoder.set_limits(allocation).map_err(broken)?;
    let orientation = decoder.orientation().map_err(broken)?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(broken)?;
    picture.apply_orientation(orientation);
    Ok(to_gray(&picture))
}

/// Width and height of a picture as [`read_image`] gives it, without decoding it.
///
/// # Errors
///
/// [`Error::Io`] where the file cannot be read, [`Error::Image`] where it is no picture.
pub fn read_size(path: &Path) -> Result<[u32; 2]> {
    use image::metadata::Orientation as Turn;
    let broken = |e: image::ImageError| Error::Image {
        path: path.into(),
        problem: format!("not a whole picture: {e}"),
        hint: "PNG, JPEG, TIFF, BMP and PGM are read; is the file truncated?".into(),
    };
    let reader = ImageReader::new(BufReader::new(storage::open(path)?))
        .with_guessed_format()
        .map_err(|e| Error::reading(path, e))?;
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    Ok(match decoder.orientation().map_err(broken)? {
        Turn::Rotate90 | Turn::Rotate270 | Turn::Rotate90FlipH | Turn::Rotate270FlipH => {
            [height, width]
        }
        _ => [width, height],
    })
}

fn to_gray(picture: &DynamicImage) -> GrayImage {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let deep = !matches!(
        picture.color(),
        image::ColorType::L8
            | image::ColorType::La8
            | image::ColorType::Rgb8
            | image::ColorType::Rgba8
    );
    let values = if deep {
        // 65535 = 257 * 255.
        picture.to_luma16().into_raw().into_iter().map(|v| f32::from(v) / 257.0).collect()
    } else {
        picture.to_luma8().into_raw().into_iter().map(f32::from).collect()
    };
    GrayImage { width, height, values }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ExtendedColorType as Kind, ImageEncoder};

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
        image::codecs::png::PngEncoder::new(&mut file)
            .write_image(&values, 32, 32, Kind::L8)
            .unwrap();
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
}
