//! Picture files to grey values, within limits that a hostile or broken file cannot pass.

use super::{ColourImage, GrayImage, names::is_video};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::{
    io::{BufRead, BufReader, Cursor, Seek},
    path::Path,
    sync::{Condvar, Mutex, PoisonError},
};
use tiff::{decoder::Decoder, tags::Tag};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    limits, storage,
};

/// The largest picture that is decoded.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most pixels along either side.
    pub side: u32,
    /// Most pixels in all.
    pub pixels: u64,
}

impl Default for Limits {
    /// [`limits::PICTURE_SIDE`] and [`limits::PICTURE_PIXELS`].
    fn default() -> Self {
        let side = u32::try_from(limits::PICTURE_SIDE.most()).unwrap_or(u32::MAX);
        Self { side, pixels: limits::PICTURE_PIXELS.most() }
    }
}

/// Pixels of the pictures that are being decoded: together they are no more than one picture may have.
static DECODED: (Mutex<u64>, Condvar) = (Mutex::new(0), Condvar::new());

/// A picture's share of what is decoded at once.
struct Share(u64);

impl Share {
    /// Waits until there is room, or nothing else is decoded.
    fn wait(pixels: u64, limits: Limits) -> Self {
        let (taken, returned) = &DECODED;
        let full = |taken: &mut u64| *taken > 0 && *taken + pixels > limits.pixels;
        let taken = taken.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = returned.wait_while(taken, full);
        *waited.unwrap_or_else(PoisonError::into_inner) += pixels;
        Self(pixels)
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        *DECODED.0.lock().unwrap_or_else(PoisonError::into_inner) -= self.0;
        DECODED.1.notify_all();
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
    Ok(to_gray(&decoded(path, opened(path)?, limits)?))
}

/// [`read_image`] with its colours beside the grey values; grey pictures have three equal ones.
///
/// # Errors
///
/// As [`read_image`].
pub fn read_colour_image(path: &Path, limits: Limits) -> Result<ColourImage> {
    let picture = decoded(path, opened(path)?, limits)?;
    let gray = to_gray(&picture);
    let colours = picture.into_rgb8().into_raw().as_chunks::<3>().0.to_vec();
    Ok(ColourImage { gray, colours })
}

/// [`read_image`] of a file that is held in memory; `name` stands for it in messages.
///
/// # Errors
///
/// As [`read_image`].
pub fn decode_image(name: &Path, bytes: &[u8], limits: Limits) -> Result<GrayImage> {
    Ok(to_gray(&decoded(name, guessed(name, Cursor::new(bytes))?, limits)?))
}

fn decoded<R: BufRead + Seek>(
    path: &Path,
    reader: ImageReader<R>,
    limits: Limits,
) -> Result<DynamicImage> {
    let refuse = |problem: String, hint: &str| Error::Image {
        path: path.into(),
        problem,
        hint: hint.into(),
    };
    let broken = |e: image::ImageError| not_whole(path, &e);
    let format = reader.format();
    let mut source = reader.into_inner();
    if format == Some(ImageFormat::Jpeg)
        && jpeg_ends_early(&mut source).map_err(|e| Error::reading(path, e))?
    {
        return Err(refuse("the JPEG ends early".into(), "was it copied completely?"));
    }
    if format == Some(ImageFormat::Tiff) {
        let pages = tiff_pages(&mut source).map_err(|e| Error::reading(path, e))?;
        if pages > 1 {
            return Err(refuse(
                format!("a TIFF of {pages} pictures, not one"),
                "save each as a file of its own first, for example with `magick left.tif left/%04d.png`",
            ));
        }
    }
    let reader = match format {
        Some(format) => ImageReader::with_format(source, format),
        None => ImageReader::new(source),
    };
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(refuse("the picture has no pixels".into(), "is the file truncated?"));
    }
    if width.max(height) > limits.side || u64::from(width) * u64::from(height) > limits.pixels {
        return Err(Error::Image {
            path: path.into(),
            problem: format!(
                "{width} x {height} pixels; the limit is {} per side and {} in all",
                limits.side, limits.pixels
            ),
            hint: Hint::new("is the file damaged? Otherwise scale it down;", Remedy::Limits),
        });
    }
    let _share = Share::wait(u64::from(width) * u64::from(height), limits);
    let mut allocation = image::Limits::default();
    // Sixteen bytes hold a pixel of any kind that is read; decoders work in about as much again.
    allocation.max_alloc = Some(32 * u64::from(width) * u64::from(height) + (1 << 20));
    decoder.set_limits(allocation).map_err(broken)?;
    let orientation = decoder.orientation().map_err(broken)?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(broken)?;
    picture.apply_orientation(orientation);
    Ok(picture)
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

fn guessed<R: BufRead + Seek>(path: &Path, mut source: R) -> Result<ImageReader<R>> {
    if source.fill_buf().map_err(|e| Error::reading(path, e))?.is_empty() {
        return Err(Error::Image {
            path: path.into(),
            problem: "the file is empty".into(),
            hint: "copy it once more from the camera, or remove it".into(),
        });
    }
    ImageReader::new(source).with_guessed_format().map_err(|e| Error::reading(path, e))
}

fn not_whole(path: &Path, error: &image::ImageError) -> Error {
    use image::error::{ImageError, ImageFormatHint, UnsupportedErrorKind as Kind};
    if let ImageError::Unsupported(what) = error {
        let problem = match what.kind() {
            Kind::Format(ImageFormatHint::Unknown) if is_video(path) => {
                return Error::Image {
                    path: path.into(),
                    problem: "a video, not a picture".into(),
                    hint: "extract its frames first, for example with `ffmpeg -i left.mp4 left/%04d.png`"
                        .into(),
                };
            }
            Kind::Format(ImageFormatHint::Unknown) => {
                return Error::Image {
                    path: path.into(),
                    problem: "not a picture: its first bytes are of no known format".into(),
                    hint:
                        "is this the file that you meant? PNG, JPEG, TIFF, BMP and PGM can be read"
                            .into(),
                };
            }
            Kind::Color(_) | Kind::ColorLayout(_) => {
                "its pixels are stored as numbers that cannot be read, such as floating-point ones"
                    .into()
            }
            Kind::Format(ImageFormatHint::Exact(format)) => {
                format!("{} pictures cannot be read", format!("{format:?}").to_uppercase())
            }
            _ => format!("it cannot be read: {error}"),
        };
        let hint = "save it as PNG or TIFF of 8 or 16 bits a channel".into();
        return Error::Image { path: path.into(), problem, hint };
    }
    Error::Image {
        path: path.into(),
        problem: format!("not a complete picture: {error}"),
        hint: "is the file truncated? PNG, JPEG, TIFF, BMP and PGM can be read".into(),
    }
}

/// Whether a JPEG lacks its end: decoders make up what is missing. The last scan is followed by the mark of the end; a
/// small picture that a camera puts into the head has marks of its own before it.
fn jpeg_ends_early(source: &mut (impl BufRead + Seek)) -> std::io::Result<bool> {
    const MARK: u8 = 0xFF;
    const SCAN: u8 = 0xDA;
    const END: u8 = 0xD9;
    let (mut last, mut is_marked) = (None, false);
    loop {
        let bytes = source.fill_buf()?;
        if bytes.is_empty() {
            break;
        }
        for byte in bytes {
            if is_marked && matches!(*byte, SCAN | END) {
                last = Some(*byte);
            }
            is_marked = *byte == MARK;
        }
        let count = bytes.len();
        source.consume(count);
    }
    source.rewind()?;
    Ok(last == Some(SCAN))
}

/// How many pictures a TIFF has, without reduced copies of them; 1 where it cannot be told.
fn tiff_pages(source: &mut (impl BufRead + Seek)) -> std::io::Result<u32> {
    /// Set in the kind of a picture that is a smaller copy of another, or a mask.
    const NOT_A_PAGE: u32 = 0b101;
    const MOST: u32 = 1 << 20;
    let mut pages = 1;
    if let Ok(mut decoder) = Decoder::new(&mut *source) {
        while pages < MOST && decoder.more_images() && decoder.next_image().is_ok() {
            let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType);
            pages += u32::from(kind.ok().flatten().unwrap_or(0) & NOT_A_PAGE == 0);
        }
    }
    source.rewind()?;
    Ok(pages)
}

/// Rows that are made grey at once: little memory beside the pictures before and after.
const STRIP: u32 = 64;

fn to_gray(picture: &DynamicImage) -> GrayImage {
    let (width, height) = (picture.width(), picture.height());
    let deep = !matches!(
        picture.color(),
        image::ColorType::L8
            | image::ColorType::La8
            | image::ColorType::Rgb8
            | image::ColorType::Rgba8
    );
    let mut values = Vec::with_capacity(width as usize * height as usize);
    for top in (0..height).step_by(STRIP as usize) {
        let strip = picture.crop_imm(0, top, width, STRIP.min(height - top));
        if deep {
            // 65535 = 257 * 255.
            values.extend(strip.into_luma16().into_raw().into_iter().map(|v| f32::from(v) / 257.0));
        } else {
            values.extend(strip.into_luma8().into_raw().into_iter().map(f32::from));
        }
    }
    GrayImage { width: width as usize, height: height as usize, values }
}
