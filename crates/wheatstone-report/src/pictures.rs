//! Pictures made small enough to travel with the report.

use super::{
    material::PictureSource,
    sections::{Crops, FindingFigures, OutlierFigures, PictureFigures, PointFigures},
};
use crate::html::jpeg;
use rayon::prelude::*;
use wheatstone_charts::{
    detection::Picture,
    imaging::{GrayImage, Limits, read_image},
};
use wheatstone_core::{Result, geometry::Pixel};
use wheatstone_numeric::progress::Progress;

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

/// Most pieces of observations that were set aside: more are no slips but another fault.
const MOST_OUTLIER_CROPS: usize = 200;

/// Quality of JPEG at which marks of one pixel stay clear of ringing, to the eye.
const QUALITY: u8 = 75;

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

/// A piece to cut.
struct Cut {
    /// What it shows, and the camera.
    of: [usize; 2],
    view: usize,
    pixel: [f64; 2],
}

/// Pieces about points, the largest errors first.
fn about_points(points: &[PointFigures]) -> Vec<Cut> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let error = |index: usize| points[index].error().unwrap_or(f64::INFINITY);
    order.sort_by(|a, b| error(*b).total_cmp(&error(*a)).then(a.cmp(b)));
    let pieces = order.into_iter().flat_map(|index| {
        let (view, seen) = (points[index].view, points[index].pixels.iter().enumerate());
        seen.filter_map(move |(camera, pixel)| {
            Some(Cut { of: [index, camera], view, pixel: (*pixel)? })
        })
    });
    pieces.take(MOST_CROPS).collect()
}

/// Pieces about observations that were set aside, where they were found before that.
fn about_outliers(seen: &PictureSource, outliers: &[OutlierFigures]) -> Vec<Cut> {
    let found = &seen.found.dataset;
    let pieces = outliers.iter().enumerate().flat_map(|(index, outlier)| {
        let row = found.correspondences.iter().find(|row| {
            row.id.as_ref() == Some(&outlier.id) && found.views.get(row.view) == Some(&outlier.view)
        });
        row.into_iter().flat_map(move |row| {
            let of_camera = move |(camera, pixel): (usize, &Option<Pixel>)| {
                let pixel = (*pixel)?.into();
                let accused = outlier.camera.is_none_or(|only| only == camera);
                accused.then_some(Cut { of: [index, camera], view: row.view, pixel })
            };
            row.pixels.iter().enumerate().filter_map(of_camera)
        })
    });
    pieces.take(MOST_OUTLIER_CROPS).collect()
}

fn piece(image: &GrayImage, [x, y]: [f64; 2]) -> GrayImage {
    let half = (SIDE as f64 - 1.0) / 2.0;
    GrayImage::from_fn(SIDE, SIDE, |column, row| {
        image.sample(Pixel::new(x - half + column as f64, y - half + row as f64))
    })
}

/// Small pictures of the capture, and pieces about its points and about what was set aside.
pub(super) struct Gallery {
    pub(super) pictures: Vec<PictureFigures>,
    pub(super) crops: Option<Crops>,
    pub(super) outlier_crops: Option<Crops>,
}

/// Reads every picture once more.
///
/// # Errors
///
/// [`wheatstone_core::Error::Image`], [`wheatstone_core::Error::Io`], [`wheatstone_core::Error::Cancelled`].
pub(super) fn gallery(
    seen: &PictureSource,
    points: &[PointFigures],
    (outliers, findings): (&[OutlierFigures], &[FindingFigures]),
    progress: &dyn Progress,
) -> Result<Gallery> {
    let mut cuts = about_points(points);
    let own = cuts.len();
    cuts.extend(about_outliers(seen, outliers));
    let accused = |view: usize| {
        findings.iter().any(|found| found.views.contains(&seen.capture.views[view].name))
    };
    let cameras = seen.capture.cameras.len();
    let total = seen.found.pictures.len() * cameras;
    let every = total.div_ceil(MOST_PICTURES).max(1);
    let kept: Vec<Result<Option<Kept>>> = (0..total)
        .into_par_iter()
        .map(|index| {
            progress.check()?;
            let (view, camera) = (index / cameras, index % cameras);
            let Some(found) = &seen.found.pictures[view][camera] else { return Ok(None) };
            let image = read_image(&found.path, Limits::default())?;
            // Views with a fault are what a reader looks for.
            let kept = view % every == 0 || accused(view);
            let picture = kept.then(|| small(seen, found, (view, camera), &image));
            let here =
                cuts.iter().enumerate().filter(|(_, cut)| cut.of[1] == camera && cut.view == view);
            let crops = here.map(|(number, cut)| (number, piece(&image, cut.pixel))).collect();
            Ok(Some(Kept { picture: picture.flatten(), crops }))
        })
        .collect();
    let (mut pictures, mut pieces) = (Vec::new(), Vec::new());
    for kept in kept {
        let Some(kept) = kept? else { continue };
        pictures.extend(kept.picture);
        pieces.extend(kept.crops);
    }
    pieces.sort_by_key(|(number, _)| *number);
    let outliers = pieces.split_off(pieces.partition_point(|(number, _)| *number < own));
    Ok(Gallery { pictures, crops: sheet(&cuts, &pieces), outlier_crops: sheet(&cuts, &outliers) })
}

fn small(
    seen: &PictureSource,
    found: &Picture,
    (view, camera): (usize, usize),
    image: &GrayImage,
) -> Option<PictureFigures> {
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
        data: jpeg(&reduced(image), QUALITY)?,
        found: points,
        problem,
    })
}

/// All pieces in one picture, in their order.
fn sheet(cuts: &[Cut], pieces: &[(usize, GrayImage)]) -> Option<Crops> {
    if pieces.is_empty() {
        return None;
    }
    let columns = COLUMNS.min(pieces.len());
    let rows = pieces.len().div_ceil(columns);
    let all = GrayImage::from_fn(columns * SIDE, rows * SIDE, |x, y| {
        let piece = pieces.get(y / SIDE * columns + x / SIDE);
        piece.map_or(128.0, |(_, image)| image.row(y % SIDE)[x % SIDE])
    });
    let of = pieces.iter().map(|(number, _)| cuts[*number].of).collect();
    Some(Crops { data: jpeg(&all, QUALITY)?, side: SIDE, columns, of })
}
