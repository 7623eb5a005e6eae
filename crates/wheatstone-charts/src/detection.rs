//! Chart points in every picture of a capture, named the same in all cameras.
//!
//! A picture alone cannot always tell which point of a grid is which. What it leaves open is settled
//! by the rest of the capture: pictures that show the whole chart at known places give each camera's
//! projection, and that tells where the points of the other pictures must be; where no place is
//! known, the cameras are taken to be less than a quarter turn apart.

mod refusals;

use crate::capture::{CameraPictures, Capture};
use crate::{
    chart::{ChartSearch, Detection, PictureOf, PointId},
    imaging::{GrayImage, Limits, read_image},
};
use nalgebra::Vector2;
use rayon::prelude::*;
use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};
use wheatstone_core::dataset::{Correspondence, Dataset};
use wheatstone_core::{
    Error, Result,
    geometry::{Pixel, Point3, ProjectionMatrix},
};
use wheatstone_numeric::progress::Progress;

/// How chart points are searched for.
#[derive(Clone, Copy, Debug, Default)]
pub struct DetectionSettings {
    /// Rounds every point to the nearest pixel centre, as the 2001 paper measured.
    pub whole_pixels: bool,
    /// Largest picture that is read.
    pub limits: Limits,
}

/// Gives the picture of a path.
pub type Read<'a> = &'a (dyn Fn(&Path) -> Result<GrayImage> + Sync);

/// What was found in one picture.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Picture {
    /// The file.
    pub path: PathBuf,
    /// The points, or why there are none.
    pub outcome: Result<Detection, String>,
}

/// What was found in a whole capture.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Found {
    /// View by view, camera by camera; none where the camera has no picture of the view.
    pub pictures: Vec<Vec<Option<Picture>>>,
    /// The points that at least one camera saw.
    pub dataset: Dataset,
}

impl Found {
    /// Pictures with points that were named in them, and in how many of those the chart was found with such a point
    /// elsewhere: with another id than it was named, or in another view.
    #[must_use]
    pub fn named_elsewhere(&self, capture: &Capture) -> (usize, usize) {
        /// In pixels: as far as a named point may be from its mark.
        const NEAR: f64 = 12.0;
        let (mut named_in, mut elsewhere) = (0, 0);
        for (view, pictures) in capture.views.iter().zip(&self.pictures) {
            for (camera, picture) in pictures.iter().enumerate() {
                let named = capture.chart.named_in(PictureOf { camera, view: &view.name });
                let Some(Ok(found)) = picture.as_ref().map(|it| &it.outcome) else { continue };
                let is_off = |(id, at): &(PointId, Pixel)| {
                    let place = found.points.binary_search_by_key(id, |(id, _)| *id);
                    place.is_ok_and(|place| (found.points[place].1 - at).norm() > NEAR)
                };
                named_in += usize::from(!named.is_empty());
                elsewhere += usize::from(named.iter().any(is_off));
            }
        }
        (named_in, elsewhere)
    }
}

/// Searches of one view, camera by camera, as they are narrowed down.
type Searches = Vec<ChartSearch>;

/// Looks for the chart in every picture.
///
/// # Errors
///
/// [`Error::Image`] for a picture that cannot be read or has another size than its camera's others;
/// [`Error::Degenerate`] where no picture shows the chart; [`Error::Cancelled`].
pub fn detect(
    capture: &Capture,
    settings: DetectionSettings,
    progress: &dyn Progress,
) -> Result<Found> {
    let read = |path: &Path| read_image(path, settings.limits);
    detect_in(capture, settings, &read, progress)
}

/// [`detect`] in pictures that are not read from files: `read` gives that of each path.
///
/// # Errors
///
/// As [`detect`], and those of `read`.
pub fn detect_in(
    capture: &Capture,
    settings: DetectionSettings,
    read: Read,
    progress: &dyn Progress,
) -> Result<Found> {
    let mut searches = search(capture, read, progress)?;
    settle_by_projection(capture, &mut searches);
    for view in &mut searches {
        settle_by_partner(view);
    }
    let found = |(view, sightings): (usize, Searches)| {
        let of_camera = |(sighting, camera): (ChartSearch, &CameraPictures)| {
            let path = camera.pictures[view].clone()?;
            Some(Picture { path, outcome: settled(sighting, settings.whole_pixels) })
        };
        sightings.into_iter().zip(&capture.cameras).map(of_camera).collect()
    };
    let pictures: Vec<Vec<Option<Picture>>> = searches.into_iter().enumerate().map(found).collect();
    let all: Vec<&Picture> = pictures.iter().flatten().flatten().collect();
    let seen = all.iter().filter(|picture| picture.outcome.is_ok()).count();
    if 2 * seen < all.len() {
        refusals::refuse_a_mistake(capture, &all, (seen, read))?;
    }
    let dataset = assemble(capture, &pictures);
    if dataset.correspondences.is_empty() {
        return Err(refusals::nothing_found(capture, &all));
    }
    Ok(Found { pictures, dataset })
}

/// The width and height of a picture, and what was found in it.
type Searched = ((usize, usize), ChartSearch);

/// Reads and searches all pictures, in parallel.
fn search(capture: &Capture, read: Read, progress: &dyn Progress) -> Result<Vec<Searches>> {
    let cameras = capture.cameras.len();
    let total = capture.views.len() * cameras;
    let done = AtomicU64::new(0);
    let each: Vec<Result<Option<Searched>>> = (0..total)
        .into_par_iter()
        .map(|index| {
            progress.check()?;
            let picture = &capture.cameras[index % cameras].pictures[index / cameras];
            let Some(path) = picture else { return Ok(None) };
            let image = read(path)?;
            let of =
                PictureOf { camera: index % cameras, view: &capture.views[index / cameras].name };
            let sighting = capture.chart.detect_in(&image, of);
            progress.report("detecting", done.fetch_add(1, Ordering::Relaxed) + 1, total as u64);
            Ok(Some(((image.width(), image.height()), sighting)))
        })
        .collect();
    let mut sizes = vec![None; cameras];
    let mut views: Vec<Searches> = vec![Vec::new(); capture.views.len()];
    for (index, outcome) in each.into_iter().enumerate() {
        let (view, camera) = (index / cameras, index % cameras);
        let Some((size, sighting)) = outcome? else {
            views[view].push(ChartSearch::NotFound(String::new()));
            continue;
        };
        let expected = *sizes[camera].get_or_insert(size);
        if size != expected {
            return Err(Error::Image {
                path: capture.cameras[camera].pictures[view].clone().unwrap_or_default(),
                problem: format!(
                    "{} x {} pixels, but earlier pictures of camera `{}` have {} x {}",
                    size.0, size.1, capture.cameras[camera].name, expected.0, expected.1
                ),
                hint:
                    "all pictures of a camera must have one size: remove this one, or list it under another camera"
                        .into(),
            });
        }
        views[view].push(sighting);
    }
    Ok(views)
}

/// The chart's points in the world, where the view's place is known.
fn world_points(capture: &Capture, view: usize) -> Option<Vec<Point3>> {
    let pose = capture.views[view].world_from_chart?;
    Some(capture.chart.points().into_iter().map(|point| pose.transform(point)).collect())
}

/// How far, as a share of the distance between neighbours, points may lie from where the projection
/// of the other pictures puts them. A lens bends by some percent of it, a wrong name is off by 1.
const WORST_MISS: f64 = 0.5;

/// How many times worse the next best reading must be.
const CLEARLY_WORSE: f64 = 2.0;

/// Settles readings by each camera's projection matrix, fitted to what is already settled: at first
/// the pictures that show the whole chart, upright. Goes on until nothing new is settled.
fn settle_by_projection(capture: &Capture, searches: &mut [Searches]) {
    let whole = capture.chart.points().len();
    for camera in 0..capture.cameras.len() {
        let worlds: Vec<_> = (0..searches.len()).map(|view| world_points(capture, view)).collect();
        for _ in 0..searches.len() {
            let mut pairs: Vec<(Point3, Pixel)> = Vec::new();
            for (view, world) in searches.iter().zip(&worlds) {
                let (ChartSearch::Found(readings), Some(world)) = (&view[camera], world) else {
                    continue;
                };
                if readings.len() == 1 || readings[0].points.len() == whole {
                    pairs.extend(readings[0].points.iter().map(|(id, pixel)| (world[*id], *pixel)));
                }
            }
            let Some(projection) = ProjectionMatrix::fit(&pairs) else { break };
            let mut news = false;
            for (view, world) in searches.iter_mut().zip(&worlds) {
                let Some(world) = world else { continue };
                if let ChartSearch::Found(readings) = &mut view[camera]
                    && readings.len() > 1
                {
                    news |= keep_the_reading_that_fits(readings, world, &projection);
                }
            }
            if !news {
                break;
            }
        }
    }
}

/// Leaves only the reading that the projection explains, if one is explained clearly better than
/// the others.
fn keep_the_reading_that_fits(
    readings: &mut Vec<Detection>,
    world: &[Point3],
    projection: &ProjectionMatrix,
) -> bool {
    let mut scored: Vec<(f64, usize)> = readings
        .iter()
        .map(|reading| relative_miss(reading, world, projection))
        .enumerate()
        .map(|(index, miss)| (miss, index))
        .collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    match scored[..] {
        [(best, index), (next, _), ..] if best < WORST_MISS && next > CLEARLY_WORSE * best => {
            *readings = vec![readings.swap_remove(index)];
            true
        }
        _ => false,
    }
}

/// Median distance from where the projection puts the points, as a share of that between
/// neighbouring points.
fn relative_miss(reading: &Detection, world: &[Point3], projection: &ProjectionMatrix) -> f64 {
    let (mut misses, mut steps) = (Vec::new(), Vec::new());
    let mut last: Option<Pixel> = None;
    for (id, pixel) in &reading.points {
        match projection.project(world[*id]) {
            Some(predicted) => misses.push((predicted - pixel).norm()),
            None => return f64::INFINITY,
        }
        steps.extend(last.map(|last| (pixel - last).norm()));
        last = Some(*pixel);
    }
    wheatstone_numeric::statistics::median(&misses)
        / wheatstone_numeric::statistics::median(&steps).max(f64::MIN_POSITIVE)
}

/// Where two cameras see the same chart and each leaves open how it is turned, they are taken to be
/// turned alike, as the first reads it.
fn settle_by_partner(view: &mut [ChartSearch]) {
    let reference = view.iter().find_map(|sighting| match sighting {
        ChartSearch::Found(readings) => Some(readings[0].clone()),
        ChartSearch::NotFound(_) => None,
    });
    let Some(reference) = reference else { return };
    for sighting in view {
        let ChartSearch::Found(readings) = sighting else { continue };
        if readings.len() == 1 || !readings.iter().all(|reading| covers(reading, &readings[0])) {
            continue;
        }
        let agreement = |reading: &Detection| likeness(reading, &reference).unwrap_or(-1.0);
        let best = (0..readings.len())
            .max_by(|a, b| agreement(&readings[*a]).total_cmp(&agreement(&readings[*b])));
        if let Some(best) = best {
            *readings = vec![readings.swap_remove(best)];
        }
    }
}

/// Whether two readings are of nearly the same points: they differ by how the chart is turned, not by
/// which part of it is seen.
fn covers(reading: &Detection, other: &Detection) -> bool {
    let has = |id: &usize| other.points.binary_search_by_key(id, |(id, _)| *id).is_ok();
    let both = reading.points.iter().filter(|(id, _)| has(id)).count();
    20 * both >= 19 * reading.points.len().max(other.points.len())
}

/// How alike two pictures of the same points are, up to place and size: the cosine of their displacements
/// from their middles.
fn likeness(reading: &Detection, other: &Detection) -> Option<f64> {
    let pairs: Vec<(Pixel, Pixel)> = reading
        .points
        .iter()
        .filter_map(|(id, at)| {
            let place = other.points.binary_search_by_key(id, |(id, _)| *id).ok()?;
            Some((*at, other.points[place].1))
        })
        .collect();
    let count = pairs.len() as f64;
    let sum = pairs.iter().fold((Vector2::zeros(), Vector2::zeros()), |sum, (a, b)| {
        (sum.0 + a.coords, sum.1 + b.coords)
    });
    let (mut own, mut its, mut both) = (0.0, 0.0, 0.0);
    for (a, b) in &pairs {
        let (a, b) = (a.coords - sum.0 / count, b.coords - sum.1 / count);
        own += a.norm_squared();
        its += b.norm_squared();
        both += a.dot(&b);
    }
    (pairs.len() >= 2).then(|| both / (own * its).sqrt())
}

/// The one reading that is left, or why it is none.
fn settled(sighting: ChartSearch, whole_pixels: bool) -> Result<Detection, String> {
    match sighting {
        ChartSearch::NotFound(why) => Err(why),
        ChartSearch::Found(readings) => match &readings[..] {
            [only] => {
                let round = |pixel: Pixel| {
                    if whole_pixels { pixel.map(f64::round) } else { pixel }
                };
                let points = only.points.iter().map(|(id, pixel)| (*id, round(*pixel)));
                Ok(Detection { points: points.collect(), sigmas: only.sigmas.clone() })
            }
            many => Err(format!(
                "{} points found, but they fit the chart at {} positions: show the whole chart, give [[views]] with known poses of which two show the whole chart, or name a point in a start file if the chart takes one",
                many[0].points.len(),
                many.len()
            )),
        },
    }
}

/// One correspondence a chart point and view that any camera saw.
fn assemble(capture: &Capture, pictures: &[Vec<Option<Picture>>]) -> Dataset {
    let points = capture.chart.points();
    let mut correspondences = Vec::new();
    for (view, cameras) in pictures.iter().enumerate() {
        let world = world_points(capture, view);
        for (id, point) in points.iter().enumerate() {
            let seen = |picture: &Option<Picture>| {
                let found = &picture.as_ref()?.outcome.as_ref().ok()?.points;
                found.binary_search_by_key(&id, |(id, _)| *id).ok().map(|place| found[place].1)
            };
            let pixels: Vec<Option<Pixel>> = cameras.iter().map(seen).collect();
            if pixels.iter().any(Option::is_some) {
                correspondences.push(Correspondence {
                    view,
                    id: Some(capture.chart.name(id)),
                    pixels,
                    world: world.as_ref().map(|world| world[id]),
                    board: world.is_none().then_some([point.x, point.y]),
                });
            }
        }
    }
    Dataset {
        unit: capture.unit.clone(),
        cameras: capture.cameras.len(),
        views: capture.views.iter().map(|view| view.name.clone()).collect(),
        correspondences,
    }
}
