//! Many right sides at once, a row each.

use super::{Cholesky, Triangle, take_panel};
use crate::{
    blocked_matrix::{BlockedMatrix, Column, ROWS},
    simd::{Real, Simd, WithSimd, on_widest},
};
use nalgebra::DMatrix;

impl Cholesky {
    /// Rows times the inverse of L', each row: what remains of right sides when L is taken from them.
    pub fn take_lower(&self, rows: &mut BlockedMatrix) {
        on_widest(Take(self, rows));
    }

    /// Rows times the inverse of L. After [`Cholesky::take_lower`] each row holds the x of `A x = b`.
    pub fn take_upper(&self, rows: &mut BlockedMatrix) {
        on_widest(TakeUpper(self, rows));
    }

    /// The matrix's inverse.
    #[must_use]
    pub fn inverse(&self) -> DMatrix<f64> {
        let mut rows = BlockedMatrix::zeros(self.size(), self.size());
        (0..self.size()).for_each(|index| rows.set(index, index, 1.0));
        self.take_lower(&mut rows);
        rows.square()
    }
}

/// Rows times the inverse of L'.
struct Take<'a>(&'a Cholesky, &'a mut BlockedMatrix);

impl WithSimd for Take<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for rows in self.1.panels_mut() {
            for own in 0..self.0.panels() {
                let before = &self.0.panel(own)[..own * ROWS];
                take_panel(simd, (before, self.0.triangle(own)), rows);
            }
        }
    }
}

/// Adds eight vectors times eight columns of L, each column's to its sum.
#[inline(always)]
fn add_upper<'a, S: Simd>(
    simd: S,
    sums: &mut [S::f64s; ROWS],
    lower: &[Column],
    vectors: impl Iterator<Item = &'a S::f64s>,
) {
    for (row, vector) in vectors.enumerate() {
        for (sum, column) in sums.iter_mut().zip(lower) {
            *sum = f64::add_product(simd, *sum, simd.splat_f64s(column[row]), *vector);
        }
    }
}

/// Rows times the inverse of L.
struct TakeUpper<'a>(&'a Cholesky, &'a mut BlockedMatrix);

impl WithSimd for TakeUpper<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let strips = ROWS / f64::width::<S>();
        for rows in self.1.panels_mut() {
            let rows = f64::vectors_mut::<S>(rows.as_flattened_mut());
            for own in (0..self.0.panels()).rev() {
                let (known, later) = rows.split_at_mut((own + 1) * ROWS * strips);
                let columns = &mut known[own * ROWS * strips..];
                for strip in 0..strips {
                    let mut sums = [simd.splat_f64s(0.0); ROWS];
                    for (index, eight) in later.chunks_exact(ROWS * strips).enumerate() {
                        let lower = &self.0.panel(own + 1 + index)[own * ROWS..][..ROWS];
                        add_upper(simd, &mut sums, lower, eight.iter().skip(strip).step_by(strips));
                    }
                    let Triangle { columns: triangle, inverse_pivots } = self.0.triangle(own);
                    for column in (0..ROWS).rev() {
                        let mut sum = sums[column];
                        for row in column + 1..ROWS {
                            let factor = simd.splat_f64s(triangle[column][row]);
                            let known = columns[row * strips + strip];
                            sum = f64::add_product(simd, sum, factor, known);
                        }
                        let own = &mut columns[column * strips + strip];
                        let inverse = simd.splat_f64s(inverse_pivots[column]);
                        *own = simd.mul_f64s(simd.sub_f64s(*own, sum), inverse);
                    }
                }
            }
        }
    }
}
