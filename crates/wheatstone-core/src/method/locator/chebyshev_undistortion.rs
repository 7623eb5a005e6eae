//! What a camera's lens does, as polynomials over the whole picture: no point has to look for its patch, and a
//! register full of points is told at once.
//!
//! A sheet is made by itself, from the camera alone, of where there are patches; it is used only where
//! it says what the camera says. Only the plane is in double precision that is nearest to where pixels look: what a
//! lens does beside that is small enough for singles, of which a register holds twice as many.

use super::{
    plan::PlacedCamera,
    undistortion_table::{COEFFICIENTS, Part, SCALES, TOLERANCE, told},
};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use wheatstone_numeric::{
    matrix_product::product,
    simd::{Real, Simd},
};

/// Places along each side of the picture from which a sheet is made.
const NODES: usize = 24;

/// Powers of higher degree in all are not taken: so long a sum costs as much as a patch, and loses a
/// millionth of a pixel by rounding.
const MOST_DEGREE: usize = 20;

/// How well the scale is to be known, as a share: it only weighs errors, and so large a share of them a point is
/// off.
const SCALE_TOLERANCE: f64 = 1e-3;

/// A camera's polynomials.
pub(super) struct ChebyshevUndistortion {
    part: Part,
    /// Where pixels look but for what the polynomials say: u and v, by x, by y and constant.
    plane: [[f64; 3]; 2],
    /// What a patch tells of a point, each number's.
    polynomials: [Polynomial; COEFFICIENTS],
}

/// A polynomial of two numbers from -1 to 1.
#[derive(Clone, Debug, Default)]
struct Polynomial {
    /// From the highest power of y down; of each the factors from the highest power of x down.
    rows: Vec<Vec<f32>>,
}

impl ChebyshevUndistortion {
    /// Over a part of the picture; `None` where polynomials do not follow the camera.
    pub(super) fn new(camera: &PlacedCamera, part: Part) -> Option<Self> {
        let across = nodes();
        let mut values = vec![DMatrix::zeros(NODES, NODES); COEFFICIENTS];
        let [middle, half] = camera.nearness;
        for (i, x) in across.into_iter().enumerate() {
            for (j, y) in across.into_iter().enumerate() {
                let seen = told(camera, part.pixel([x, y]))?;
                for (place, value) in PLACES.into_iter().zip(seen) {
                    values[place][(i, j)] = value;
                }
            }
        }
        let near = middle + half;
        // What an error on the plane does to pixels; all of what is allowed here is made use of, and both
        // coordinates of all cameras err at once.
        let by = [1.0, near, near * near].map(|by| TOLERANCE / (5.0 * camera.focal * by));
        let mut polynomials: [Polynomial; COEFFICIENTS] = Default::default();
        let mut plane = [[0.0; 3]; 2];
        let mut slopes = [[DMatrix::zeros(0, 0), DMatrix::zeros(0, 0)], Default::default()];
        for (order, place) in PLACES.into_iter().enumerate() {
            let mut coefficients = coefficients(&values[place]);
            if let Some(plane) = plane.get_mut(order) {
                // The first polynomials are the powers themselves.
                for (value, wave) in plane.iter_mut().zip([(1, 0), (0, 1), (0, 0)]) {
                    *value = std::mem::take(&mut coefficients[wave]);
                }
            }
            polynomials[place] = Polynomial::new(&coefficients, by[order / 2])?;
        }
        for (axis, slopes) in slopes.iter_mut().enumerate() {
            let [at, along, curvature] =
                [PLACES[axis], PLACES[2 + axis], PLACES[4 + axis]].map(|place| &values[place]);
            *slopes = slopes_of(&coefficients(&(at + (along + curvature * middle) * middle)));
        }
        let steps = [0, 1].map(|axis| 2.0 / (part.most[axis] - part.least[axis]));
        let [[a, b], [c, d]] = &slopes;
        let (a, b) = (a * steps[0], b * steps[1]);
        let (c, d) = (c * steps[0], d * steps[1]);
        let determinant = a.component_mul(&d) - b.component_mul(&c);
        for (place, slope) in SCALES.into_iter().zip([d, -b, -c, a]) {
            let scale = slope.component_div(&determinant);
            let tolerance = SCALE_TOLERANCE * camera.focal;
            polynomials[place] = Polynomial::new(&coefficients(&scale), tolerance)?;
        }
        let made = Self { part, plane, polynomials };
        made.follows(camera).then_some(made)
    }

    /// Whether a place lies in its part.
    #[inline(always)]
    pub(super) fn holds(&self, x: f64, y: f64) -> bool {
        self.part.holds(x, y)
    }

    /// Tells a block of points what patches tell, of `CURVED` cameras all of it.
    #[inline(always)]
    pub(super) fn tell<S: Simd, const B: usize, const CURVED: bool>(
        &self,
        simd: S,
        [x, y]: [&[f64]; 2],
        told: &mut [[f64; B]; COEFFICIENTS],
    ) {
        let (mut places, mut singles) = ([[0.0; B]; 2], [[0.0; B]; 2]);
        for (axis, pixels) in [x, y].into_iter().enumerate() {
            let (least, most) = (self.part.least[axis], self.part.most[axis]);
            let (middle, by) = (0.5 * (least + most), 2.0 / (most - least));
            for (place, pixel) in places[axis].iter_mut().zip(pixels) {
                *place = (pixel - middle) * by;
            }
            for (single, place) in singles[axis].iter_mut().zip(&places[axis]) {
                *single = *place as f32;
            }
        }
        let [across, down] = &singles;
        let count = if CURVED { COEFFICIENTS } else { PLACES[2] };
        let mut small = [0.0; B];
        for (index, told) in told.iter_mut().enumerate().take(count) {
            let polynomial = &self.polynomials[index];
            polynomial.at(simd, [across, down], &mut small);
            for (told, small) in told.iter_mut().zip(&small) {
                *told = f64::from(*small);
            }
            if index < self.plane.len() {
                let [by_x, by_y, constant] = self.plane[index];
                for ((told, x), y) in told.iter_mut().zip(&places[0]).zip(&places[1]) {
                    *told += by_x * x + by_y * y + constant;
                }
            }
        }
    }

    /// Whether it says what the camera says, where it is likely to be worst.
    fn follows(&self, camera: &PlacedCamera) -> bool {
        const TRIED: [f64; 6] = [-1.0, -0.95, -0.4, 0.05, 0.7, 1.0];
        let [middle, half] = camera.nearness;
        let tried = TRIED.into_iter().flat_map(|x| TRIED.into_iter().map(move |y| [x, y]));
        tried.enumerate().all(|(index, place)| {
            let near = middle + half * [-1.0, 0.3, 1.0][index % 3];
            let Some(truth) = camera.plane_of(self.part.pixel(place), near) else { return false };
            let mut told = self
                .polynomials
                .each_ref()
                .map(|own| f64::from(own.value(place.map(|x| x as f32))));
            for (told, [by_x, by_y, constant]) in told.iter_mut().zip(self.plane) {
                *told += by_x * place[0] + by_y * place[1] + constant;
            }
            let [u, v] = [0, 1].map(|axis| {
                let [at, along, curvature] =
                    [PLACES[axis], PLACES[2 + axis], PLACES[4 + axis]].map(|place| told[place]);
                truth[axis] - (at + near * (along + near * curvature))
            });
            let [a, b, c, d] = SCALES.map(|place| told[place]);
            let (across, down) = (a * u + b * v, c * u + d * v);
            (across * across + down * down).sqrt() < TOLERANCE
        })
    }
}

/// Where at, along and curvature, of u and v each, stand among what is told.
const PLACES: [usize; 6] = [0, 1, 6, 7, 8, 9];

impl Polynomial {
    /// A short one that departs from the whole sum by no more than `tolerance`; `None` where it would be too long.
    fn new(coefficients: &DMatrix<f64>, tolerance: f64) -> Option<Self> {
        // No wave is ever larger than one.
        let all = || (0..NODES).flat_map(|i| (0..NODES).map(move |j| (i, j)));
        let beyond = all().filter(|(i, j)| i + j > MOST_DEGREE).map(|at| coefficients[at].abs());
        let mut left = tolerance - beyond.sum::<f64>();
        if left.is_nan() || left < 0.0 {
            return None;
        }
        // Of each wave of y so many of x. A power of y is part of its own wave and of every other one above,
        // so that those above must not be the longer ones.
        let mut lengths: Vec<usize> = (0..=MOST_DEGREE).map(|y| MOST_DEGREE + 1 - y).collect();
        loop {
            let above = |y: usize| lengths.get(y + 2).copied().unwrap_or(0);
            let last = |y: usize| coefficients[(lengths[y] - 1, y)].abs();
            let ends = (0..=MOST_DEGREE).filter(|y| lengths[*y] > above(*y));
            let least = ends.min_by(|a, b| last(*a).total_cmp(&last(*b)));
            let Some(y) = least.filter(|y| last(*y) <= left) else { break };
            left -= last(y);
            lengths[y] -= 1;
        }
        let mut kept = coefficients.clone();
        for (i, j) in all() {
            if lengths.get(j).is_none_or(|length| i >= *length) {
                kept[(i, j)] = 0.0;
            }
        }
        let powers = powers_of_polynomials();
        let factors = product(&product(&powers.transpose(), &kept), &powers);
        let row = |y: usize| (0..lengths[y]).rev().map(|x| factors[(x, y)] as f32).collect();
        let rows = lengths.iter().rposition(|length| *length > 0).map_or(0, |last| last + 1);
        Some(Self { rows: (0..rows).rev().map(row).collect() })
    }

    /// Its value at a place.
    fn value(&self, [x, y]: [f32; 2]) -> f32 {
        let row = |row: &Vec<f32>| row.iter().fold(0.0, |sum, factor| sum * x + factor);
        self.rows.iter().fold(0.0, |sum, factors| sum * y + row(factors))
    }

    /// Its values at places, four registers at a time: no sum waits for another.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, [x, y]: [&[f32]; 2], out: &mut [f32]) {
        const R: usize = 4;
        let (across, _) = f32::vectors::<S>(x).as_chunks::<R>();
        let (down, _) = f32::vectors::<S>(y).as_chunks::<R>();
        let (out, _) = f32::vectors_mut::<S>(out).as_chunks_mut::<R>();
        for ((x, y), out) in across.iter().zip(down).zip(out) {
            let mut sums = [simd.splat_f32s(0.0); R];
            for factors in &self.rows {
                let mut along = [simd.splat_f32s(0.0); R];
                for factor in factors {
                    let factor = simd.splat_f32s(*factor);
                    for (sum, x) in along.iter_mut().zip(x) {
                        *sum = simd.mul_add_f32s(*sum, *x, factor);
                    }
                }
                for ((sum, along), y) in sums.iter_mut().zip(along).zip(y) {
                    *sum = simd.mul_add_f32s(*sum, *y, along);
                }
            }
            *out = sums;
        }
    }
}

/// Where Chebyshev's polynomial of degree [`NODES`] is 0.
fn nodes() -> [f64; NODES] {
    std::array::from_fn(|k| libm::cos((2 * k + 1) as f64 * PI / (2 * NODES) as f64))
}

/// Chebyshev's polynomials at the nodes: node by row, degree by column.
fn polynomials_at_nodes() -> DMatrix<f64> {
    DMatrix::from_fn(NODES, NODES, |node, degree| {
        libm::cos(((2 * node + 1) * degree) as f64 * PI / (2 * NODES) as f64)
    })
}

/// Values at the nodes, x by row and y by column, as a sum of products of Chebyshev's polynomials.
fn coefficients(values: &DMatrix<f64>) -> DMatrix<f64> {
    let polynomials = polynomials_at_nodes();
    let share = |degree: usize| if degree == 0 { 1.0 } else { 2.0 } / NODES as f64;
    let sums = product(&product(&polynomials.transpose(), values), &polynomials);
    DMatrix::from_fn(NODES, NODES, |i, j| sums[(i, j)] * share(i) * share(j))
}

/// Chebyshev's polynomials by their powers: degree by row, power by column.
fn powers_of_polynomials() -> DMatrix<f64> {
    let mut powers = DMatrix::zeros(NODES, NODES);
    powers[(0, 0)] = 1.0;
    powers[(1, 1)] = 1.0;
    for degree in 2..NODES {
        for power in 0..=degree {
            let before = if power > 0 { powers[(degree - 1, power - 1)] } else { 0.0 };
            powers[(degree, power)] = 2.0 * before - powers[(degree - 2, power)];
        }
    }
    powers
}

/// The slopes of such a sum at the nodes, by x and by y.
fn slopes_of(coefficients: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
    // T_n' = n U_(n-1), with U_(n-1) = sin(n t) / sin(t) at cos(t).
    let slopes = DMatrix::from_fn(NODES, NODES, |node, degree| {
        let angle = (2 * node + 1) as f64 * PI / (2 * NODES) as f64;
        let n = degree as f64;
        n * libm::sin(n * angle) / libm::sin(angle)
    });
    let at = polynomials_at_nodes();
    [
        product(&product(&slopes, coefficients), &at.transpose()),
        product(&product(&at, coefficients), &slopes.transpose()),
    ]
}
