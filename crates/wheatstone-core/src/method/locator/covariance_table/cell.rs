//! The figures of one box as polynomials of the place in it.

use nalgebra::DMatrix;
use std::f64::consts::PI;
use wheatstone_numeric::{
    matrix_product::product,
    simd::{Real, Simd, WithSimd},
};

/// Figures that a box tells: the covariance over the fourth power of the depth, XX, XY, XZ, YY, YZ, ZZ, which
/// for projective cameras is a polynomial of second degree in the place in the picture and the nearness;
/// what residual to expect; and nothing.
pub(super) const FIGURES: usize = 8;

/// Places along x and y, and along the nearness, at which a box's figures are worked out.
const ACROSS: usize = 5;
const DEEP: usize = 4;

/// Figures worked out for a box: what noise does over a picture asks for the fourth degree, and boxes of half
/// the width were no better with the second.
pub(in crate::method::locator) const NODES: usize = ACROSS * ACROSS * DEEP;

/// Pairs of an even and an odd power of x that go with each power of y: about the fourth degree in all.
const PAIRS: [usize; ACROSS] = [3, 2, 2, 1, 1];

/// Pairs that go with each power of the nearness.
const LAYER: usize = 9;

/// One box: the figures' factors by the powers of nearness, then y, then pairs of powers of x; the even one's
/// figures, then the odd one's. Single precision holds them a thousand times better than they are asked for.
/// Each pair is one line of a cache.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Cell([[f32; 2 * FIGURES]; LAYER * DEEP]);

/// One that tells nothing.
pub(super) const NONE: Cell = Cell([[f32::NAN; 2 * FIGURES]; LAYER * DEEP]);

/// The figures at a place of a box.
#[inline(always)]
pub(super) fn told<S: Simd>(simd: S, own: &Cell, [x, y, near]: [f64; 3]) -> [f64; FIGURES] {
    let mut halves = [0.0; 2 * FIGURES];
    let squared = simd.splat_f32s((x * x) as f32);
    let [down, near] = [simd.splat_f32s(y as f32), simd.splat_f32s(near as f32)];
    for (k, half) in f32::vectors_mut::<S>(&mut halves).iter_mut().enumerate() {
        let mut deep = simd.splat_f32s(0.0);
        for layer in own.0.as_chunks::<LAYER>().0.iter().rev() {
            let (mut across, mut end) = (simd.splat_f32s(0.0), LAYER);
            for pairs in PAIRS.into_iter().rev() {
                let mut along = simd.splat_f32s(0.0);
                for factors in layer[end - pairs..end].iter().rev() {
                    let factor = f32::vectors::<S>(factors)[k];
                    along = simd.mul_add_f32s(along, squared, factor);
                }
                across = simd.mul_add_f32s(across, down, along);
                end -= pairs;
            }
            deep = simd.mul_add_f32s(deep, near, across);
        }
        *half = deep;
    }
    let (mut figures, x) = ([0.0; FIGURES], x as f32);
    for (place, figure) in figures.iter_mut().enumerate() {
        *figure = f64::from(halves[place] + x * halves[FIGURES + place]);
    }
    figures
}

/// [`told`], of one place.
pub(super) struct Interpolate<'a>(pub(super) &'a Cell, pub(super) [f64; 3]);

impl WithSimd for Interpolate<'_> {
    type Output = [f64; FIGURES];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        told(simd, self.0, self.1)
    }
}

/// Where Chebyshev's polynomial of degree `N` is 0: a polynomial through these is nearly the best.
fn nodes<const N: usize>() -> [f64; N] {
    std::array::from_fn(|k| libm::cos((2 * (N - k) - 1) as f64 * PI / (2 * N) as f64))
}

/// The nodes of a box.
fn places() -> impl Iterator<Item = [f64; 3]> {
    let (across, deep) = (nodes::<ACROSS>(), nodes::<DEEP>());
    (0..NODES).map(move |place| {
        [across[place % ACROSS], across[place / ACROSS % ACROSS], deep[place / (ACROSS * ACROSS)]]
    })
}

/// The terms of a box: powers of x, y and nearness, the pair in which it stands and which half of it.
fn terms() -> impl Iterator<Item = ([i32; 3], usize, usize)> {
    let pairs = (0..DEEP).flat_map(|near| {
        PAIRS.into_iter().enumerate().flat_map(move |(y, pairs)| {
            (0..pairs).map(move |pair| [2 * pair as i32, y as i32, near as i32])
        })
    });
    let halves = pairs.enumerate().flat_map(|(pair, [x, y, near])| {
        [0, 1].map(|half| ([x + half, y, near], pair, half as usize))
    });
    // As many powers as there are places.
    halves.filter(|([x, ..], ..)| *x < ACROSS as i32)
}

/// From figures at the nodes to factors of the terms, of least squares.
pub(super) fn through() -> Option<DMatrix<f64>> {
    let value = |[x, y, near]: [f64; 3], [a, b, c]: [i32; 3]| x.powi(a) * y.powi(b) * near.powi(c);
    let rows: Vec<f64> =
        places().flat_map(|place| terms().map(move |(powers, ..)| value(place, powers))).collect();
    let design = DMatrix::from_row_slice(NODES, terms().count(), &rows);
    let turned = design.transpose();
    Some(product(&product(&turned, &design).try_inverse()?, &turned))
}

/// The box through the figures at its nodes.
pub(super) fn fitted(
    through: &DMatrix<f64>,
    exact: &dyn Fn([f64; 3]) -> Option<[f64; FIGURES]>,
) -> Option<Cell> {
    let figures: Vec<[f64; FIGURES]> = places().map(exact).collect::<Option<_>>()?;
    let mut own = Cell([[0.0; 2 * FIGURES]; LAYER * DEEP]);
    for (term, (_, pair, half)) in terms().enumerate() {
        for (place, factor) in own.0[pair][half * FIGURES..][..FIGURES].iter_mut().enumerate() {
            let share = |node: usize| through[(term, node)] * figures[node][place];
            *factor = (0..NODES).map(share).sum::<f64>() as f32;
        }
    }
    Some(own)
}
