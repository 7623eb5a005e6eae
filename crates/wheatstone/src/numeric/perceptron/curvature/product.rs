//! The matrix product that adds up the curvature.

use super::{ROWS, SAMPLES};
use crate::numeric::simd::{Real, Simd, has_many_registers};

/// Left times right, a portion of samples.
struct Product<'a, V> {
    /// Row by row, sample by sample.
    left: &'a [[f64; SAMPLES]],
    /// Sample by sample, so many registers each.
    right: &'a [V],
    registers: usize,
}

/// Adds left times right, both laid out sample by sample in the first and the last index, to `sums`.
#[inline(always)]
pub(super) fn add_matrix_product<S: Simd>(
    simd: S,
    (left, right): (&[f64], &[f64]),
    (sums, width): (&mut [f64], usize),
) {
    let registers = width / f64::width::<S>();
    let sums = f64::vectors_mut::<S>(sums);
    let (left, right) = (left.as_chunks().0, f64::vectors::<S>(right));
    let height = sums.len() / registers;
    // Twice as many rows where their sums fit into registers: the right factor is read half as often.
    let many = has_many_registers::<f64, S>();
    let tall = if many { height - height % (2 * ROWS) } else { 0 };
    let (upper, lower) = left.split_at(tall);
    let (upper_sums, lower_sums) = sums.split_at_mut(tall * registers);
    add_rows::<S, { 2 * ROWS }>(simd, &Product { left: upper, right, registers }, upper_sums);
    add_rows::<S, ROWS>(simd, &Product { left: lower, right, registers }, lower_sums);
}

/// So many rows at a time.
#[inline(always)]
fn add_rows<S: Simd, const HIGH: usize>(
    simd: S,
    product: &Product<'_, S::f64s>,
    sums: &mut [S::f64s],
) {
    let heights = product.left.as_chunks::<HIGH>().0.iter();
    for (rows, sums) in heights.zip(sums.chunks_exact_mut(HIGH * product.registers)) {
        let mut column = 0;
        while column + 2 <= product.registers {
            add_tile::<S, HIGH, 2>(simd, rows, (product, column), sums);
            column += 2;
        }
        if column < product.registers {
            add_tile::<S, HIGH, 1>(simd, rows, (product, column), sums);
        }
    }
}

/// So many rows by a few registers of columns, whose sums stay in registers.
#[inline(always)]
fn add_tile<S: Simd, const HIGH: usize, const WIDE: usize>(
    simd: S,
    rows: &[[f64; SAMPLES]; HIGH],
    (product, first): (&Product<'_, S::f64s>, usize),
    sums: &mut [S::f64s],
) {
    let width = product.registers;
    let mut tile: [[S::f64s; WIDE]; HIGH] =
        std::array::from_fn(|row| std::array::from_fn(|column| sums[row * width + first + column]));
    for (sample, right) in (0..SAMPLES).zip(product.right.chunks_exact(width)) {
        let right = &right[first..first + WIDE];
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
