//! The functions from which the correction of a camera is built: smooth waves over the picture and low
//! polynomials, for what the lens does to a direction, and low polynomials times the nearness, for rays that
//! do not meet in one point.
//!
//! The waves are the cosines of a box about the points, the eigenfunctions of the Laplacian with flat
//! borders: with variances from the spectral density of a kernel their sum is a Gaussian process
//! (Solin & Sarkka 2020, doi:10.1007/s11222-019-09886-w). A straight ray that misses the centre by an
//! offset o is seen, at distance d, displaced by o / d: linear in the nearness 1 / d, so the last
//! kind needs nothing steeper. What a curved window does to a direction is a series in the angle's powers,
//! which goes on beyond the points where waves can only end.

use crate::geometry::Pixel;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// The box reaches this far beyond the points (1 is just round them), so that its flat borders do not
/// flatten what the points show: the least that Riutort-Mayol et al. 2023
/// (doi:10.1007/s11222-022-10167-2) advise for this kernel.
const MARGIN: f64 = 1.2;

/// Degrees of the polynomials of the picture. Those below are the lens in another place and of another focal
/// length; the third is the first that bends a centred lens, here along each axis by itself. With degrees to the
/// fifth points beyond the charts err by more, and searches for settings take half as long again.
const DISTORTION_DEGREES: RangeInclusive<usize> = 2..=3;

/// Highest degree of the polynomials beside the nearness. Each degree brings at most a factor of the
/// widest angle, so with half a radian the fifth would be a sixteenth of the first.
const PARALLAX_DEGREE: usize = 4;

/// And of those of error bars: behind a port the fifth and the sixth are seen at the border of the picture,
/// but too badly told by the points to be fitted.
const MOST_DEGREE: usize = 6;

/// Distortion goes on as far as this, and so do all polynomials for error bars, where those of a fit beside the
/// nearness keep to [`MARGIN`]: displaced charts would bend them beyond the points. Measured on the synthetic
/// rigs: to 1.5 the error bars behind a port are too small.
const FAR_MARGIN: f64 = 2.0;

/// Which functions of picture and nearness there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Field {
    /// Middle of the points' pixels and of their nearness.
    centre: [f64; 3],
    /// Half their extents.
    half: [f64; 3],
    /// Half the field of view, about in radians.
    pub(super) view: f64,
    /// Half waves along x and y, a wave each.
    pub(super) waves: Vec<[usize; 2]>,
    /// Degrees in x and y, a polynomial of the picture each; after the waves.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) distortion: Vec<[usize; 2]>,
    /// Degrees in x and y, a polynomial beside the nearness each; after those.
    pub(super) parallax: Vec<[usize; 2]>,
}

/// A function's value and its slopes by x, y (per pixel) and nearness.
pub(super) type Sloped = [f64; 4];

/// The values without their slopes.
pub(super) fn plain_values(values: &[Sloped]) -> Vec<f64> {
    values.iter().map(|value| value[0]).collect()
}

impl Field {
    /// At most `most` waves, the longest first, and polynomials over where points were seen.
    pub(super) fn new(seen: &[(Pixel, f64)], view: f64, most: usize) -> Self {
        let coordinate =
            |axis: usize| seen.iter().map(move |(p, nearness)| [p.x, p.y, *nearness][axis]);
        let low = [0, 1, 2].map(|axis| coordinate(axis).fold(f64::INFINITY, f64::min));
        let high = [0, 1, 2].map(|axis| coordinate(axis).fold(f64::NEG_INFINITY, f64::max));
        let centre = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
        // Where all is equal any unit does.
        let half = [0, 1, 2].map(|axis| {
            let half = 0.5 * (high[axis] - low[axis]);
            if half > 0.0 { half } else { 1.0 }
        });
        let mut field = Self {
            centre,
            half,
            view,
            waves: Vec::new(),
            distortion: polynomials(DISTORTION_DEGREES).collect(),
            // A displacement that is the same everywhere is the lens in another place.
            parallax: polynomials(1..=PARALLAX_DEGREE).collect(),
        };
        // A wave is not among the longest where those that are as long both ways are too many.
        let mut waves: Vec<[usize; 2]> =
            (0..most).flat_map(|x| (0..most / (x + 1)).map(move |y| [x, y])).collect();
        waves.sort_by(|a, b| field.frequency(*a).total_cmp(&field.frequency(*b)).then(a.cmp(b)));
        waves.truncate(most);
        field.waves = waves;
        field
    }

    /// With polynomials of higher degrees after all others.
    pub(super) fn with_more_polynomials(mut self) -> Self {
        self.parallax.extend(polynomials(PARALLAX_DEGREE + 1..=MOST_DEGREE));
        self
    }

    /// No functions.
    pub(super) fn none() -> Self {
        Self::new(&[(Pixel::origin(), 1.0)], 1.0, 0).pruned(&[])
    }

    /// Number of functions.
    pub(super) fn len(&self) -> usize {
        self.waves.len() + self.distortion.len() + self.parallax.len()
    }

    /// Angular frequency of a wave, in radians a unit of [`Field::unit`].
    pub(super) fn frequency(&self, [x, y]: [usize; 2]) -> f64 {
        let along = |count: usize, axis: usize| {
            count as f64 * std::f64::consts::FRAC_PI_2 * self.unit() / (MARGIN * self.half[axis])
        };
        (along(x, 0).powi(2) + along(y, 1).powi(2)).sqrt()
    }

    /// Half the longer side of the points' extent, in pixels: the unit of the correction's length.
    pub(super) fn unit(&self) -> f64 {
        self.half[0].max(self.half[1])
    }

    /// The middle of the nearness among the points.
    pub(super) fn nearness(&self) -> f64 {
        self.centre[2]
    }

    /// The least and the largest nearness among the points; the same twice where all are alike.
    pub(super) fn depths(&self) -> [f64; 2] {
        let half = if self.half[2] < self.centre[2] { self.half[2] } else { 0.0 };
        [self.centre[2] - half, self.centre[2] + half]
    }

    /// Area of the box in squared units.
    pub(super) fn area(&self) -> f64 {
        4.0 * MARGIN * MARGIN * self.half[0] * self.half[1] / (self.unit() * self.unit())
    }

    /// Every function at a place. Beyond the box they stay as they are on its border.
    pub(super) fn values(&self, pixel: Pixel, nearness: f64) -> Vec<Sloped> {
        let mut functions = Functions::new(self);
        functions.at(pixel, nearness);
        functions.values
    }

    /// Every function at a place, for error bars: beyond the box polynomials go on a little.
    pub(super) fn uncertain_values(&self, pixel: Pixel, nearness: f64) -> Vec<f64> {
        let mut functions = Functions { polynomial_margin: FAR_MARGIN, ..Functions::new(self) };
        plain_values(functions.at(pixel, nearness))
    }

    /// How far a pixel is from those of the points' extent, in units of [`Field::unit`].
    pub(super) fn beyond(&self, pixel: Pixel) -> f64 {
        let place = self.place(pixel, self.centre[2]);
        let along = |axis: usize| (place[axis].abs() - 1.0).max(0.0) * self.half[axis];
        libm::hypot(along(0), along(1)) / self.unit()
    }

    /// A place in units of the box about the points.
    fn place(&self, pixel: Pixel, nearness: f64) -> [f64; 3] {
        let place = |value: f64, axis: usize| (value - self.centre[axis]) / self.half[axis];
        [place(pixel.x, 0), place(pixel.y, 1), place(nearness, 2)]
    }

    /// Sum of the functions times `weights` (x and y displacement in pixels), with slopes: one
    /// column a coordinate.
    pub(super) fn sum(&self, values: &[Sloped], weights: &[[f64; 2]]) -> [Sloped; 2] {
        let mut sum = [[0.0; 4]; 2];
        for (value, weight) in values.iter().zip(weights) {
            for (part, weight) in sum.iter_mut().zip(weight) {
                part.iter_mut().zip(value).for_each(|(s, v)| *s += weight * v);
            }
        }
        sum
    }

    /// The field with these functions only, in ascending order.
    pub(super) fn pruned(&self, kept: &[usize]) -> Self {
        let part = |list: &[[usize; 2]], first: usize| {
            kept.iter().filter_map(|index| list.get(index.checked_sub(first)?).copied()).collect()
        };
        let (after_waves, last) = (self.waves.len(), self.len() - self.parallax.len());
        Self {
            waves: part(&self.waves, 0),
            distortion: part(&self.distortion, after_waves),
            parallax: part(&self.parallax, last),
            ..self.clone()
        }
    }

    pub(super) fn is_consistent(&self) -> bool {
        self.centre.iter().all(|value| value.is_finite())
            && self.half.iter().all(|value| value.is_finite() && *value > 0.0)
            && self.waves.iter().flatten().all(|count| *count <= MOST_HALF_WAVES)
            && self.distortion.iter().chain(&self.parallax).all(|[x, y]| x + y <= MOST_DEGREE)
    }
}

/// Degrees in x and y of the polynomials of these degrees together.
fn polynomials(degrees: RangeInclusive<usize>) -> impl Iterator<Item = [usize; 2]> {
    degrees.flat_map(|degree| (0..=degree).map(move |y| [degree - y, y]))
}

/// The functions of a field ready for many places, with memory that is kept.
pub(super) struct Functions<'a> {
    field: &'a Field,
    /// Along x and y, as many as the shortest wave has halves.
    cosines: [Vec<(f64, f64)>; 2],
    values: Vec<Sloped>,
    /// Where polynomials end.
    polynomial_margin: f64,
}

impl<'a> Functions<'a> {
    pub(super) fn new(field: &'a Field) -> Self {
        let most =
            |axis: usize| field.waves.iter().map(|wave: &[usize; 2]| wave[axis]).max().unwrap_or(0);
        let cosines = [0, 1].map(|axis| vec![(0.0, 0.0); most(axis) + 1]);
        let values = Vec::with_capacity(field.len());
        Self { field, cosines, values, polynomial_margin: MARGIN }
    }

    /// Every function at a place.
    pub(super) fn at(&mut self, pixel: Pixel, nearness: f64) -> &[Sloped] {
        let [x, y, near] = self.field.place(pixel, nearness);
        cosines(x / MARGIN, &mut self.cosines[0]);
        cosines(y / MARGIN, &mut self.cosines[1]);
        let Field { waves, distortion, parallax, half, .. } = self.field;
        let (by_x, by_y) = (1.0 / half[0], 1.0 / half[1]);
        self.values.clear();
        self.values.extend(waves.iter().map(|[i, j]| {
            let ((a, slope_a), (b, slope_b)) = (self.cosines[0][*i], self.cosines[1][*j]);
            [a * b, slope_a * b * by_x / MARGIN, a * slope_b * by_y / MARGIN, 0.0]
        }));
        let powers = [x, y].map(|place| legendre(place, FAR_MARGIN));
        self.values.extend(distortion.iter().map(|[i, j]| {
            let ((a, slope_a), (b, slope_b)) = (powers[0][*i], powers[1][*j]);
            [a * b, slope_a * b * by_x, a * slope_b * by_y, 0.0]
        }));
        let powers = [x, y].map(|place| legendre(place, self.polynomial_margin));
        self.values.extend(parallax.iter().map(|[i, j]| {
            let ((a, slope_a), (b, slope_b)) = (powers[0][*i], powers[1][*j]);
            [near * a * b, near * slope_a * b * by_x, near * a * slope_b * by_y, a * b / half[2]]
        }));
        &self.values
    }
}

/// More half waves than this no fit makes: a file that has them is broken.
const MOST_HALF_WAVES: usize = 1000;

/// `sqrt(2) cos(k pi (x + 1) / 2)` for each k from 0 (1 for k = 0), mean square 1 on -1..1, with slopes.
fn cosines(x: f64, all: &mut [(f64, f64)]) {
    let inside = x.abs() < 1.0;
    let angle = std::f64::consts::FRAC_PI_2 * (x.clamp(-1.0, 1.0) + 1.0);
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    let (mut s, mut c) = (0.0, 1.0);
    for (k, out) in all.iter_mut().enumerate() {
        let size = if k == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
        let slope = if inside { -size * k as f64 * std::f64::consts::FRAC_PI_2 * s } else { 0.0 };
        *out = (size * c, slope);
        (s, c) = (s * cosine + c * sine, c * cosine - s * sine);
    }
}

/// Legendre polynomials to the highest degree, scaled to mean square 1 on -1..1, with slopes; flat
/// beyond the margin.
fn legendre(x: f64, margin: f64) -> [(f64, f64); MOST_DEGREE + 1] {
    let inside = x.abs() < margin;
    let x = x.clamp(-margin, margin);
    let mut plain = [(1.0, 0.0); MOST_DEGREE + 1];
    plain[1] = (x, 1.0);
    for n in 2..=MOST_DEGREE {
        let count = n as f64;
        let ((before, slope_before), (last, _)) = (plain[n - 2], plain[n - 1]);
        plain[n].0 = ((2.0 * count - 1.0) * x * last - (count - 1.0) * before) / count;
        plain[n].1 = slope_before + (2.0 * count - 1.0) * last;
    }
    let mut all = plain;
    for (n, (value, slope)) in all.iter_mut().enumerate() {
        let size = (2.0 * n as f64 + 1.0).sqrt();
        *value *= size;
        *slope *= if inside { size } else { 0.0 };
    }
    all
}

/// Slopes of a displaced pixel by world coordinates.
pub(super) fn chained(part: &Sloped, seen: &super::lens::ProjectedPoint) -> Vector3<f64> {
    (seen.slopes.row(0) * part[1] + seen.slopes.row(1) * part[2]).transpose()
        + seen.nearness_slopes * part[3]
}
