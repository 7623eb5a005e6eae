//! Pictures made small enough to travel with the report.

use super::{
    build::Seen,
    sections::{Crops, PictureFigures, PointFigures},
    text::base64,
};
use crate::{
    Result,
    geometry::Pixel,
    imaging::{GrayImage, Limits, read_image},
    progress::Progress,
};
use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};
use rayon::prelude::*;

/// Width of a picture in the page: enough to recognise every chart point of it on half a screen.
const WIDTH: usize = 560;

/// Most pictures; at 20 to 50 kB each they stay below three megabytes. Of more, every n-th view's
/// are taken.
const MOST_PICTURES: usize = 48;

/// Side of a piece about a point, in pixels of the original: a few line widths of a usual chart.
pub(super) const SIDE: usize = 40;

/// Pieces in a row of the sheet that holds them all.
const COLUMNS: usize = 40;

/// Most pieces; at 0.7 kB each they stay below two megabytes. Of more, those of the points with the
/// largest errors are taken, which are looked at first.
const MOST_CROPS: usize = 2400;

/// Quality of JPEG at which marks of one pixel stay clear of ringing, to the eye.
const QUALITY: u8 = 75;

fn jpeg(image: &GrayImage) -> Option<String> {
    let bytes = image.to_8_bit();
    let mut file = Vec::new();
    JpegEncoder::new_with_quality(&mut file, QUALITY)
        .encode(bytes.as_raw(), bytes.width(), bytes.height(), ExtendedColorType::L8)
        .ok()?;
    Some(format!("data:image/jpeg;base64,{}", base64(&file)))
}

/// Averages over whole pixels, so that thin lines stay where they were.
fn reduced(image: &GrayImage) -> GrayImage {
    let factor = image.width().div_ceil(WIDTH).max(1);
    let (width, height) = (image.width() / factor, image.height() / factor);
    if factor == 1 || height == 0 {
        return image.clone();
    }
    GrayImage::from_fn(width, height, |x, y| {
        let rows = (y * factor..(y + 1) * factor).map(|row| &image.row(row)[x * factor..]);
        let sum: f32 = rows.map(|row| row[..factor].iter().sum::<f32>()).sum();
        sum / (factor * factor) as f32
    })
}

/// What is kept of one picture.
struct Kept {
    picture: Option<PictureFigures>,
    /// Number of the piece and its pixels.
    crops: Vec<(usize, GrayImage)>,
}

/// Pieces to cut: the point and the camera of each, the largest errors first.
fn wanted(points: &[PointFigures]) -> Vec<[usize; 2]> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let error = |index: usize| points[index].error().unwrap_or(f64::INFINITY);
    order.sort_by(|a, b| error(*b).total_cmp(&error(*a)).then(a.cmp(b)));
    let pieces = order.into_iter().flat_map(|index| {
        let seen = points[index].pixels.iter().enumerate().filter(|(_, pixel)| pixel.is_some());
        seen.map(move |(camera, _)| [index, camera])
    });
    pieces.take(MOST_CROPS).collect()
}

fn piece(image: &GrayImage, [x, y]: [f64; 2]) -> GrayImage {
    let half = (SIDE as f64 - 1.0) / 2.0;
    GrayImage::from_fn(SIDE, SIDE, |column, row| {
        image.sample(Pixel::new(x - half + column as f64, y - half + row as f64))
    })
}

/// Small pictures of the capture, and pieces about its points. Also the size of each camera's
/// pictures.
pub(super) struct Gallery {
    pub(super) pictures: Vec<PictureFigures>,
    pub(super) crops: Option<Crops>,
}

/// Reads every picture once more.
///
/// # Errors
///
/// [`crate::Error::Image`], [`crate::Error::Io`], [`crate::Error::Cancelled`].
pub(super) fn gallery(
    seen: &Seen,
    points: &[PointFigures],
    progress: &dyn Progress,
) -> Result<Gallery> {
    let of = wanted(points);
    let cameras = seen.capture.cameras.len();
    let total = seen.found.pictures.len() * cameras;
    let every = total.div_ceil(MOST_PICTURES).max(1);
    let kept: Vec<Result<Kept>> = (0..total)
        .into_par_iter()
        .map(|index| {
            progress.check()?;
            let (view, camera) = (index / cameras, index % cameras);
            let found = &seen.found.pictures[view][camera];
            let image = read_image(&found.path, Limits::default())?;
            let picture = (view % every == 0).then(|| small(seen, (view, camera), &image));
            let here = of
                .iter()
                .enumerate()
                .filter(|(_, [point, of])| *of == camera && points[*point].view == view);
            let crops = here
                .filter_map(|(number, [point, _])| {
                    Some((number, piece(&image, points[*point].pixels[camera]?)))
                })
                .collect();
            Ok(Kept { picture: picture.flatten(), crops })
        })
        .collect();
    let (mut pictures, mut pieces) = (Vec::new(), Vec::new());
    for kept in kept {
        let kept = kept?;
        pictures.extend(kept.picture);
        pieces.extend(kept.crops);
    }
    Ok(Gallery { pictures, crops: sheet(of, pieces) })
}

fn small(seen: &Seen, (view, camera): (usize, usize), image: &GrayImage) -> Option<PictureFigures> {
    let found = &seen.found.pictures[view][camera];
    let name = found.path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into());
    let (points, problem) = match &found.outcome {
        Ok(detection) => (detection.points.iter().map(|(_, p)| (*p).into()).collect(), None),
        Err(why) => (Vec::new(), Some(why.clone())),
    };
    Some(PictureFigures {
        view: seen.capture.views[view].name.clone(),
        camera,
        name,
        size: [image.width(), image.height()],
        data: jpeg(&reduced(image))?,
        found: points,
        problem,
    })
}

/// All pieces in one picture, by their numbers.
fn sheet(of: Vec<[usize; 2]>, mut pieces: Vec<(usize, GrayImage)>) -> Option<Crops> {
    if pieces.is_empty() {
        return None;
    }
    pieces.sort_by_key(|(number, _)| *number);
    let columns = COLUMNS.min(pieces.len());
    let rows = pieces.len().div_ceil(columns);
    let all = GrayImage::from_fn(columns * SIDE, rows * SIDE, |x, y| {
        let piece = pieces.get(y / SIDE * columns + x / SIDE);
        piece.map_or(128.0, |(_, image)| image.row(y % SIDE)[x % SIDE])
    });
    let of = pieces.iter().map(|(number, _)| of[*number]).collect();
    Some(Crops { data: jpeg(&all)?, side: SIDE, columns, of })
}
