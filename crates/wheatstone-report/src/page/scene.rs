//! What the page's script needs: the points in compact form.

use super::shell::Frame;
use crate::{Crops, PointFigures, Report, figures, plot::space::Frustum, text::base64};
use serde::Serialize;

/// Points that stay smooth to turn without a graphics card.
const MOST_POINTS: usize = 50_000;

/// Ellipsoids that do.
const MOST_ELLIPSOIDS: usize = 2000;

/// All that the script reads.
#[derive(Serialize)]
pub(super) struct Data<'a> {
    unit: &'a str,
    views: &'a [String],
    cameras: Vec<Frustum<'a>>,
    crops: Option<&'a Crops>,
    outliers: Option<&'a Crops>,
    scene: Option<Scene>,
}

/// Columns of little-endian numbers, in base 64; NaN where nothing is known.
#[derive(Serialize)]
struct Scene {
    count: usize,
    #[serde(flatten)]
    frame: Frame,
    world: String,
    error: String,
    promised: String,
    residual: String,
    /// x and y of each camera, point by point.
    pixels: String,
    misses: String,
    /// XX, XY, XZ, YY, YZ, ZZ of the first points.
    covariance: Option<String>,
    /// How many of them.
    ellipsoids: usize,
    view: String,
    ids: Option<Vec<Option<String>>>,
    /// Numbers of the points in the report, where some are left out.
    original: Option<String>,
    exaggeration: f64,
    note: String,
}

fn floats(values: impl Iterator<Item = f64>) -> String {
    base64(&values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>())
}

/// Which points are shown: all, or every n-th and those with the largest errors.
fn shown(points: &[PointFigures]) -> Vec<usize> {
    let placed = |point: &PointFigures| point.world.is_some() || point.located.is_some();
    let all: Vec<usize> = (0..points.len()).filter(|index| placed(&points[*index])).collect();
    if all.len() <= MOST_POINTS {
        return all;
    }
    let worst = MOST_POINTS / 50;
    let mut by_error = all.clone();
    let error = |index: usize| points[index].error().unwrap_or(0.0);
    by_error.sort_by(|a, b| error(*b).total_cmp(&error(*a)).then(a.cmp(b)));
    let mut kept: Vec<usize> = by_error[..worst].to_vec();
    kept.extend(all.iter().copied().step_by(all.len().div_ceil(MOST_POINTS - worst)));
    kept.sort_unstable();
    kept.dedup();
    kept
}

fn place(point: &PointFigures) -> [f64; 3] {
    point.world.or(point.located.as_ref().map(|found| found.point)).unwrap_or([f64::NAN; 3])
}

/// Middle and half diagonal of the box that holds all points.
fn bounds(points: &[&PointFigures]) -> ([f64; 3], f64) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points {
        for (axis, value) in place(point).into_iter().enumerate() {
            (low[axis], high[axis]) = (low[axis].min(value), high[axis].max(value));
        }
    }
    let half = |axis: usize| (high[axis] - low[axis]) / 2.0;
    let diagonal = (0..3).map(|axis| half(axis).powi(2)).sum::<f64>().sqrt();
    ([0, 1, 2].map(|axis| (low[axis] + high[axis]) / 2.0), diagonal.max(1e-300))
}

/// How much longer errors are drawn, so that nine of ten stay below a thirtieth of the scene.
fn exaggeration(points: &[&PointFigures], extent: f64) -> f64 {
    let errors: Vec<f64> = points.iter().filter_map(|point| point.error()).collect();
    let most = wheatstone_numeric::statistics::percentile(&errors, 0.9);
    if most > 0.0 { (extent / 30.0 / most).clamp(1.0, 1e4) } else { 1.0 }
}

fn scene(report: &Report) -> Option<Scene> {
    let shown = shown(&report.points);
    if shown.is_empty() {
        return None;
    }
    let all = &report.points;
    let points: Vec<&PointFigures> = shown.iter().map(|index| &all[*index]).collect();
    let (centre, extent) = bounds(&points);
    let nothing = [f64::NAN; 3];
    let error = |point: &PointFigures| match (point.world, &point.located) {
        (Some(world), Some(found)) => [0, 1, 2].map(|axis| found.point[axis] - world[axis]),
        _ => nothing,
    };
    let cameras = report.cameras.len();
    let pair = |pair: Option<&Option<[f64; 2]>>| pair.copied().flatten().unwrap_or([f64::NAN; 2]);
    let pixels = points.iter().flat_map(|p| (0..cameras).flat_map(move |c| pair(p.pixels.get(c))));
    let miss = |point: &PointFigures, camera: usize| {
        pair(point.located.as_ref().and_then(|found| found.misses.get(camera)))
    };
    let misses = points.iter().flat_map(|p| (0..cameras).flat_map(move |c| miss(p, c)));
    let ellipsoids = if points.len() <= MOST_ELLIPSOIDS { points.len() } else { 0 };
    let covariance = |point: &&PointFigures| {
        point.located.as_ref().and_then(|found| found.covariance).unwrap_or([f64::NAN; 6])
    };
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let views = points.iter().flat_map(|point| (point.view as u16).to_le_bytes());
    let numbers = shown.iter().flat_map(|index| (*index as u32).to_le_bytes());
    let any_id = points.iter().any(|point| point.id.is_some());
    Some(Scene {
        count: points.len(),
        frame: Frame::of(
            points.iter().map(|point| place(point)),
            (centre, extent),
            &figures::scene::frusta(report),
        ),
        world: floats(
            points.iter().flat_map(|p| place(p).into_iter().zip(centre).map(|(v, c)| v - c)),
        ),
        error: floats(points.iter().flat_map(|point| error(point))),
        promised: floats(points.iter().map(|point| number(point.predicted()))),
        residual: floats(
            points.iter().map(|p| number(p.located.as_ref().and_then(|f| f.residual))),
        ),
        pixels: floats(pixels),
        misses: floats(misses),
        covariance: (ellipsoids > 0).then(|| floats(points.iter().flat_map(covariance))),
        ellipsoids,
        view: base64(&views.collect::<Vec<u8>>()),
        ids: any_id.then(|| points.iter().map(|point| point.id.clone()).collect()),
        original: (shown.len() < all.len()).then(|| base64(&numbers.collect::<Vec<u8>>())),
        exaggeration: exaggeration(&points, extent),
        note: note(points.len(), all.len(), ellipsoids),
    })
}

fn note(shown: usize, all: usize, ellipsoids: usize) -> String {
    let mut note = String::new();
    if shown < all {
        note += &format!(
            "{shown} of {all} points are shown, those with the largest errors among them. "
        );
    }
    if ellipsoids == 0 {
        note += &format!("Ellipsoids are drawn for up to {MOST_ELLIPSOIDS} points.");
    }
    note
}

/// What the script reads.
pub(super) fn data(report: &Report) -> Data<'_> {
    Data {
        unit: &report.unit,
        views: &report.point_views,
        cameras: figures::scene::frusta(report),
        crops: report.crops.as_ref(),
        outliers: report.outlier_crops.as_ref(),
        scene: scene(report),
    }
}
