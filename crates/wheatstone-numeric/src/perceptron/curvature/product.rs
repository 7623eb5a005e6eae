//! The matrix product that adds up the curvature.

use super::pairs::{COLUMNS, Pair, ROWS};
use crate::{
    perceptron::LANES,
    simd::{Real, Simd},
};
use std::ops::Range;

/// Samples whose products are made before they are multiplied: they stay in the second cache.
pub(super) const SAMPLES: usize = 5 * LANES;

/// Columns of the right factor that are made and multiplied together: they stay in the first cache.
pub(super) const STRIP: usize = 4 * COLUMNS;

/// Length of a row of a strip: its last register may be written whole.
pub(super) const STRIDE: usize = STRIP + COLUMNS;

/// The right factor, a portion of samples and a strip of columns: sample by sample.
struct Right<'a, V> {
    registers: &'a [V],
    /// Registers from one sample to the next.
    stride: usize,
}

/// Adds to a pair's sums left times right, a strip of columns from this one on; both are laid out sample by sample in
/// the first and the last index.
#[inline(always)]
pub(super) fn add_matrix_product<S: Simd>(
    simd: S,
    (left, right): (&[f64], &[f64]),
    pair: &mut Pair,
    first: usize,
) {
    let numbers = f64::width::<S>();
    let (width, first) = (pair.width / numbers, first / numbers);
    let sums = f64::vectors_mut::<S>(&mut pair.sums);
    let left = left.as_chunks().0;
    let right = Right { registers: f64::vectors::<S>(right), stride: STRIDE / numbers };
    let last = width.min(first + STRIP / numbers);
    add_rows(simd, (left, &right), (sums, width), first..last);
}

/// Row by row of tiles.
#[inline(always)]
fn add_rows<S: Simd>(
    simd: S,
    (left, right): (&[[f64; SAMPLES]], &Right<'_, S::f64s>),
    (sums, width): (&mut [S::f64s], usize),
    columns: Range<usize>,
) {
    let heights = left.as_chunks::<ROWS>().0.iter();
    for (rows, sums) in heights.zip(sums.chunks_exact_mut(ROWS * width)) {
        for column in columns.clone().step_by(2) {
            let from = column - columns.start;
            if column + 2 <= columns.end {
                add_tile::<S, 2>(simd, (rows, right, from), (sums, width, column));
            } else {
                add_tile::<S, 1>(simd, (rows, right, from), (sums, width, column));
            }
        }
    }
}

/// So many rows by a few registers of columns, whose sums stay in registers.
#[inline(always)]
fn add_tile<S: Simd, const WIDE: usize>(
    simd: S,
    (rows, right, from): (&[[f64; SAMPLES]; ROWS], &Right<'_, S::f64s>, usize),
    (sums, width, first): (&mut [S::f64s], usize, usize),
) {
    let mut tile: [[S::f64s; WIDE]; ROWS] =
        std::array::from_fn(|row| std::array::from_fn(|column| sums[row * width + first + column]));
    for (sample, right) in (0..SAMPLES).zip(right.registers.chunks_exact(right.stride)) {
        let right = &right[from..from + WIDE];
        for (sums, row) in tile.iter_mut().zip(rows) {
            let factor = simd.splat_f64s(row[sample]);
            for (sum, value) in sums.iter_mut().zip(right) {
                *sum = f64::add_product(simd, *sum, factor, *value);
            }
        }
    }
    for (row, tile) in tile.into_iter().enumerate() {
        sums[row * width + first..][..WIDE].copy_from_slice(&tile);
    }
}
