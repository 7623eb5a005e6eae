//! One camera's points seen through a robust start: a projective camera by least trimmed squares, then
//! a polynomial of direction and nearness that bends to any lens, by least absolute deviations and a
//! redescending weight.
//!
//! Sources: Rousseeuw & Van Driessen 2006, FAST-LTS (doi:10.1007/s10618-005-0024-4): samples, each
//! improved by steps that refit to the best half; Geman & McClure's weight, its scale brought down as
//! in Black & Rangarajan 1996 (doi:10.1007/BF00131148).

mod polynomial;

use crate::geometry::{Pixel, Point3, ProjectionMatrix};
use wheatstone_numeric::{
    random::Random,
    statistics::{median, percentile},
};

/// Points a sample: one more than determine a camera, so that its noise shows; each further one
/// would halve the share of good samples where half the points are bad.
const SAMPLE: usize = 7;

/// Samples: where half the points are bad 0.8 % of the samples are good, three of 400; where three
/// in ten are, 33.
const SAMPLES: usize = 400;

/// Points on which samples are judged, at most: the median of 500 is good to a twentieth.
const JUDGES: usize = 500;

/// A camera's points on coordinates in which its picture is nearly a polynomial.
pub(super) struct Start {
    /// Where each point is seen: half-angle tangents of its direction, and nearness, each about 0 with
    /// a spread of about 1.
    pub(super) places: Vec<[f64; 3]>,
    /// Each point's pixel less that of the robust polynomial.
    pub(super) residuals: Vec<Pixel>,
}

/// The start of a camera; `None` where its points do not determine one.
pub(super) fn start(pairs: &[(Point3, Pixel)], random: &mut Random) -> Option<Start> {
    let camera = trimmed_camera(pairs, random)?;
    let places = places(pairs, &camera)?;
    let first = lengths(&differences(pairs, |index| camera.project(pairs[index].0)));
    let residuals = polynomial::robust(pairs, &places, &first)?;
    Some(Start { places, residuals })
}

fn differences(
    pairs: &[(Point3, Pixel)],
    predicted: impl Fn(usize) -> Option<Pixel>,
) -> Vec<Pixel> {
    // A point that a camera cannot see is as far off as can be.
    let far = Pixel::new(1e9, 1e9);
    let difference = |(index, (_, pixel)): (usize, &(Point3, Pixel))| {
        predicted(index).map_or(far, |at| Pixel::from(pixel - at))
    };
    pairs.iter().enumerate().map(difference).collect()
}

/// Lengths of residuals, in pixels.
pub(super) fn lengths(residuals: &[Pixel]) -> Vec<f64> {
    residuals.iter().map(|residual| residual.coords.norm()).collect()
}

/// The projective camera that comes nearest to the better half of the points.
fn trimmed_camera(pairs: &[(Point3, Pixel)], random: &mut Random) -> Option<ProjectionMatrix> {
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    random.shuffle(&mut order);
    let judges: Vec<(Point3, Pixel)> = order.iter().take(JUDGES).map(|i| pairs[*i]).collect();
    let mut found: Vec<(f64, Vec<(Point3, Pixel)>)> = Vec::new();
    for _ in 0..SAMPLES {
        // The first of a shuffle that stops early.
        for place in 0..SAMPLE {
            let other = place + random.below(order.len() - place);
            order.swap(place, other);
        }
        let sample: Vec<(Point3, Pixel)> = order[..SAMPLE].iter().map(|i| pairs[*i]).collect();
        if let Some(camera) = ProjectionMatrix::sketch(&sample) {
            found.push((sum_of_half(&judges, &camera), sample));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // As FAST-LTS does: the ten best go on, of those that determine a camera.
    let cameras = found.iter().filter_map(|(_, sample)| ProjectionMatrix::fit(sample)).take(10);
    let improved = cameras.map(|camera| improved(camera, &judges));
    improved.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, camera)| camera)
}

/// A camera refitted to the half of the points that it fits best for as long as that helps, and the
/// sum of their errors.
fn improved(first: ProjectionMatrix, judges: &[(Point3, Pixel)]) -> (f64, ProjectionMatrix) {
    let (mut least, mut better_half) = half_of_errors(judges, &first);
    let mut best = first;
    for _ in 0..8 {
        let better: Vec<(Point3, Pixel)> = better_half.iter().map(|i| judges[*i]).collect();
        let Some(camera) = ProjectionMatrix::fit(&better) else { break };
        let (error, half) = half_of_errors(judges, &camera);
        if error >= least {
            break;
        }
        (least, best, better_half) = (error, camera, half);
    }
    (least, best)
}

/// How many of so many points are the better half.
fn half(points: usize) -> usize {
    points.div_ceil(2).max(SAMPLE).min(points)
}

fn errors(pairs: &[(Point3, Pixel)], camera: &ProjectionMatrix) -> Vec<f64> {
    lengths(&differences(pairs, |index| camera.project(pairs[index].0)))
}

/// Sum of the smaller half of the errors.
fn sum_of_half(pairs: &[(Point3, Pixel)], camera: &ProjectionMatrix) -> f64 {
    let mut errors = errors(pairs, camera);
    let half = half(errors.len());
    if half < errors.len() {
        errors.select_nth_unstable_by(half, f64::total_cmp);
    }
    errors[..half].iter().sum()
}

/// Sum of the smaller half of the errors, and whose they are.
fn half_of_errors(pairs: &[(Point3, Pixel)], camera: &ProjectionMatrix) -> (f64, Vec<usize>) {
    let errors = errors(pairs, camera);
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    let half = half(pairs.len());
    if half < order.len() {
        order.select_nth_unstable_by(half, |a, b| errors[*a].total_cmp(&errors[*b]));
        order.truncate(half);
    }
    order.sort_unstable();
    (order.iter().map(|index| errors[*index]).sum(), order)
}

/// Where a camera observes the points: tangents of half the angle to its axis, which stay finite all
/// around it, and one over the distance; centred and scaled.
fn places(pairs: &[(Point3, Pixel)], camera: &ProjectionMatrix) -> Option<Vec<[f64; 3]>> {
    let (_, rotation, translation) = camera.decompose()?;
    let mut places: Vec<[f64; 3]> = pairs
        .iter()
        .map(|(world, _)| {
            let seen = rotation * world.coords + translation;
            let distance = seen.norm();
            // Directly behind the camera there is no tangent: the point is put far aside.
            let scale = 1.0 / (distance + seen.z).max(1e-3 * distance);
            [seen.x * scale, seen.y * scale, 1.0 / distance]
        })
        .collect();
    for axis in 0..3 {
        let values: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        let centre = median(&values);
        let spread = median(&values.iter().map(|v| (v - centre).abs()).collect::<Vec<_>>());
        if !(centre.is_finite() && spread.is_finite()) {
            return None;
        }
        // All points equally far: any scale does.
        let scale = if spread > 0.0 { 1.0 / spread } else { 0.0 };
        // Half the points are within 1 of the centre; few good ones are beyond 4.
        places
            .iter_mut()
            .for_each(|p| p[axis] = 0.5 * ((p[axis] - centre) * scale).clamp(-4.0, 4.0));
    }
    Some(places)
}

/// Standard deviation of a coordinate of the good points from the errors of all: of up to half bad ones
/// the least 40 % of the errors know nothing. Four in ten of a Rayleigh distribution lie below
/// `sqrt(-2 ln 0.6)`.
pub(super) fn scale(errors: &[f64]) -> f64 {
    percentile(errors, 0.4) / 1.0108
}
