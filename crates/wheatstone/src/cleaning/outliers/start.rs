//! One camera's points seen through a robust start: a projective camera by least trimmed squares, then
//! a polynomial of direction and nearness that bends to any lens, by least absolute deviations and a
//! redescending weight.
//!
//! Sources: Rousseeuw & Van Driessen 2006, FAST-LTS (doi:10.1007/s10618-005-0024-4): samples, each
//! improved by steps that refit to the best half; Geman & McClure's weight, its scale brought down as
//! in Black & Rangarajan 1996 (doi:10.1007/BF00131148).

use crate::{
    geometry::{Pixel, Point3, ProjectionMatrix},
    numeric::{
        least_squares::solve,
        random::Random,
        statistics::{median, percentile},
    },
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
    let residuals = robust_polynomial(pairs, &places, &first)?;
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
    let mut found: Vec<(f64, ProjectionMatrix)> = Vec::new();
    for _ in 0..SAMPLES {
        // The first of a shuffle that stops early.
        for place in 0..SAMPLE {
            let other = place + random.below(order.len() - place);
            order.swap(place, other);
        }
        let sample: Vec<(Point3, Pixel)> = order[..SAMPLE].iter().map(|i| pairs[*i]).collect();
        if let Some(camera) = ProjectionMatrix::fit(&sample) {
            found.push((half_of_errors(&judges, &camera).0, camera));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // As FAST-LTS does: the ten best go on.
    found.truncate(10);
    for entry in &mut found {
        for _ in 0..8 {
            let (_, better_half) = half_of_errors(&judges, &entry.1);
            let better: Vec<(Point3, Pixel)> = better_half.iter().map(|i| judges[*i]).collect();
            let Some(camera) = ProjectionMatrix::fit(&better) else { break };
            let error = half_of_errors(&judges, &camera).0;
            if error >= entry.0 {
                break;
            }
            *entry = (error, camera);
        }
    }
    found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, camera)| camera)
}

/// Sum of the smaller half of the errors, and whose they are.
fn half_of_errors(pairs: &[(Point3, Pixel)], camera: &ProjectionMatrix) -> (f64, Vec<usize>) {
    let errors = lengths(&differences(pairs, |index| camera.project(pairs[index].0)));
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    let half = pairs.len().div_ceil(2).max(SAMPLE).min(pairs.len());
    if half < order.len() {
        order.select_nth_unstable_by(half, |a, b| errors[*a].total_cmp(&errors[*b]));
        order.truncate(half);
    }
    order.sort_unstable();
    (order.iter().map(|index| errors[*index]).sum(), order)
}

/// Where a camera sees the points: tangents of half the angle to its axis, which stay finite all
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

/// Powers of the polynomial's terms, low ones first: fifth degree over the picture, nearness counting
/// twice, which is what a thick pane at a slant asks for.
fn powers() -> Vec<[i32; 3]> {
    let mut powers: Vec<[i32; 3]> = (0..6 * 6 * 3)
        .map(|index| [index / 18, index / 3 % 6, index % 3])
        .filter(|[x, y, z]| x + y + 2 * z <= 5)
        .collect();
    powers.sort_by_key(|[x, y, z]| (x + y + 2 * z, *z, *y));
    powers
}

/// Residuals of the polynomial that most points agree on: the better of two, one fitted with all terms
/// from the first, one through cubics, whose edges a few bad points cannot lift.
fn robust_polynomial(
    pairs: &[(Point3, Pixel)],
    places: &[[f64; 3]],
    first: &[f64],
) -> Option<Vec<Pixel>> {
    let powers = powers();
    // Six points a term: with half of them bad there are still three.
    let most = (pairs.len() / 6).clamp(4, powers.len());
    let cubic = powers.iter().filter(|[x, y, z]| x + y + 2 * z <= 3).count().min(most);
    let polynomial = Polynomial { pairs, places, powers };
    let direct = polynomial.robust(&[(most, ABSOLUTE, 15), (most, DESCENDING, 12)], first);
    let cubic_first = [
        (cubic, ABSOLUTE, 15),
        (cubic, DESCENDING, 8),
        (most, ABSOLUTE, 2),
        (most, DESCENDING, 12),
    ];
    let through_cubics = polynomial.robust(&cubic_first, first);
    let misfit = |residuals: &Vec<Pixel>| scale(&lengths(residuals));
    direct.into_iter().chain(through_cubics).min_by(|a, b| misfit(a).total_cmp(&misfit(b)))
}

/// Standard deviation of a coordinate of the good points from the errors of all: of up to half bad ones
/// the least 40 % of the errors know nothing. Four in ten of a Rayleigh distribution lie below
/// `sqrt(-2 ln 0.6)`.
pub(super) fn scale(errors: &[f64]) -> f64 {
    percentile(errors, 0.4) / 1.0108
}

/// Weights of a robust fit, from an error in standard deviations.
type Weight = fn(f64) -> f64;

/// Of least absolute deviations.
const ABSOLUTE: Weight = |error| 1.0 / error.max(0.05);

/// Geman & McClure's: half of a good point's at two and a half deviations.
const DESCENDING: Weight = |error| (1.0 + error * error / 16.0).powi(-2);

struct Polynomial<'a> {
    pairs: &'a [(Point3, Pixel)],
    places: &'a [[f64; 3]],
    powers: Vec<[i32; 3]>,
}

impl Polynomial<'_> {
    /// Residuals after stages of so many terms, a weight, and rounds.
    fn robust(&self, stages: &[(usize, Weight, usize)], first: &[f64]) -> Option<Vec<Pixel>> {
        let mut errors = first.to_vec();
        let mut residuals = Vec::new();
        for (terms, weight, rounds) in stages {
            let values = self.values(*terms);
            for _ in 0..*rounds {
                let sigma = scale(&errors).max(1e-9);
                let weights: Vec<f64> = errors.iter().map(|error| weight(error / sigma)).collect();
                residuals = self.residuals(&values, *terms, &weights)?;
                errors = lengths(&residuals);
            }
        }
        Some(residuals)
    }

    /// The terms at each point, row by row.
    fn values(&self, terms: usize) -> Vec<f64> {
        let at = |place: &[f64; 3], powers: &[i32; 3]| -> f64 {
            (0..3).map(|axis| place[axis].powi(powers[axis])).product()
        };
        let powers = &self.powers[..terms];
        self.places.iter().flat_map(|p| powers.iter().map(move |powers| at(p, powers))).collect()
    }

    /// Residuals of all points from the weighted fit.
    fn residuals(&self, values: &[f64], terms: usize, weights: &[f64]) -> Option<Vec<Pixel>> {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let rows = values.chunks_exact(terms).zip(self.pairs).zip(weights);
        for ((row, (_, pixel)), weight) in rows.step_by(self.pairs.len().div_ceil(MOST_ROWS)) {
            let root = weight.sqrt();
            a.extend(row.iter().map(|value| value * root));
            b.extend([pixel.x * root, pixel.y * root]);
        }
        // Terms that the points do not determine are kept small.
        for term in 0..terms {
            a.extend((0..terms).map(|other| if other == term { RIDGE } else { 0.0 }));
            b.extend([0.0, 0.0]);
        }
        let solution = solve(&a, terms, &b, 2)?;
        let at = |index: usize| {
            let row = &values[index * terms..(index + 1) * terms];
            let along = |axis| row.iter().enumerate().map(|(t, v)| v * solution[(t, axis)]).sum();
            Some(Pixel::new(along(0), along(1)))
        };
        Some(differences(self.pairs, at))
    }
}

/// Points to which the polynomial is fitted, at most: a hundred a term.
const MOST_ROWS: usize = 4000;

/// Size of the rows that keep undetermined terms small, as a share of a point's: a thousandth of
/// a point's weight moves no determined term by a noticeable share of a pixel.
const RIDGE: f64 = 1e-5;
