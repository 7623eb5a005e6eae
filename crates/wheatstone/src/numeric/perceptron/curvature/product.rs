//! The matrix product that adds up the curvature.

use super::{ROWS, SAMPLES};
use crate::numeric::simd::{Real, Simd};

/// Adds left times right, both laid out sample by sample in the first and the last index, to `sums`.
#[inline(always)]
pub(super) fn add_matrix_product<S: Simd>(
    simd: S,
    (left, right, samples): (&[f64], &[f64], usize),
    (sums, width): (&mut [f64], usize),
) {
    let registers = width / f64::width::<S>();
    let right = f64::vectors::<S>(right);
    let sums = f64::vectors_mut::<S>(sums);
    let heights = left.chunks_exact(ROWS * SAMPLES).zip(sums.chunks_exact_mut(ROWS * registers));
    for (left, sums) in heights {
        let rows: [&[f64]; ROWS] = std::array::from_fn(|row| &left[row * SAMPLES..][..samples]);
        let mut column = 0;
        while column + 2 <= registers {
            add_tile::<S, 2>(simd, rows, (right, registers, column), sums);
            column += 2;
        }
        if column < registers {
            add_tile::<S, 1>(simd, rows, (right, registers, column), sums);
        }
    }
}

/// Four rows by a few registers of columns, whose sums stay in registers.
#[inline(always)]
fn add_tile<S: Simd, const WIDE: usize>(
    simd: S,
    [a, b, c, d]: [&[f64]; ROWS],
    (right, width, first): (&[S::f64s], usize, usize),
    sums: &mut [S::f64s],
) {
    let mut tile: [[S::f64s; WIDE]; ROWS] =
        std::array::from_fn(|row| std::array::from_fn(|column| sums[row * width + first + column]));
    let left = a.iter().zip(b).zip(c.iter().zip(d));
    for (((a, b), (c, d)), right) in left.zip(right.chunks_exact(width)) {
        let right = &right[first..first + WIDE];
        for (sums, factor) in tile.iter_mut().zip([a, b, c, d]) {
            let factor = simd.splat_f64s(*factor);
            for (sum, value) in sums.iter_mut().zip(right) {
                *sum = f64::add_product(simd, *sum, factor, *value);
            }
        }
    }
    for (row, tile) in tile.into_iter().enumerate() {
        sums[row * width + first..][..WIDE].copy_from_slice(&tile);
    }
}
