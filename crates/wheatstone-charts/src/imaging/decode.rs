//! Picture files to grey values, within limits that a hostile or broken file cannot pass.

use super::GrayImage;
use image::{DynamicImage, ImageDecoder, ImageReader};
use std::{
    io::{BufRead, BufReader, Cursor, Seek},
    path::Path,
};
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
    decoded(path, opened(path)?, limits)
}

/// [`read_image`] of a file that is held in memory; `name` stands for it in messages.
///
/// # Errors
///
/// As [`read_image`].
pub fn decode_image(name: &Path, bytes: &[u8], limits: Limits) -> Result<GrayImage> {
    decoded(name, guessed(name, Cursor::new(bytes))?, limits)
}

fn decoded<R: BufRead + Seek>(
    path: &Path,
    reader: ImageReader<R>,
    limits: Limits,
) -> Result<GrayImage> {
    let refuse = |problem: String, hint: &str| Error::Image {
        path: path.into(),
        problem,
        hint: hint.into(),
    };
    let broken = |e: image::ImageError| not_whole(path, &e);
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(refuse("the picture has no pixels".into(), "is the file truncated?"));
    }
    if width.max(height) > limits.side || u64::from(width) * u64::from(height) > limits.pixels {
        return Err(refuse(
            format!(
                "{width} x {height} pixels; the limit is {} per side and {} in all",
                limits.side, limits.pixels
            ),
            "is the file damaged? Otherwise scale the picture down",
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
    let broken = |e: image::ImageError| not_whole(path, &e);
    let mut decoder = opened(path)?.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    Ok(match decoder.orientation().map_err(broken)? {
        Turn::Rotate90 | Turn::Rotate270 | Turn::Rotate90FlipH | Turn::Rotate270FlipH => {
            [height, width]
        }
        _ => [width, height],
    })
}

/// A file, and what kind of picture its first bytes say it is.
fn opened(path: &Path) -> Result<ImageReader<BufReader<std::fs::File>>> {
    guessed(path, BufReader::new(storage::open(path)?))
}

fn guessed<R: BufRead + Seek>(path: &Path, source: R) -> Result<ImageReader<R>> {
    ImageReader::new(source).with_guessed_format().map_err(|e| Error::reading(path, e))
}

fn not_whole(path: &Path, error: &image::ImageError) -> Error {
    Error::Image {
        path: path.into(),
        problem: format!("not a complete picture: {error}"),
        hint: "is the file truncated? PNG, JPEG, TIFF, BMP and PGM can be read".into(),
    }
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
