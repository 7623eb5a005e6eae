//! Matrices whose rows are kept eight at a time, and their products, in vector registers.
//!
//! Each panel of eight rows stands column by column, so that every inner loop runs through memory once.
//! Sums run in the order of the columns, whatever the registers' width.

use super::{
    aligned::AlignedVec,
    simd::{Real, Simd, WithSimd, add_products, on_widest},
};
use nalgebra::DMatrix;

/// Rows a panel.
pub(super) const ROWS: usize = 8;

/// One column of a panel.
pub(super) type Column = [f64; ROWS];

/// A matrix; beyond its rows and columns stand zeros.
#[derive(Clone, Debug, Default)]
pub struct BlockedMatrix {
    rows: usize,
    columns: usize,
    /// Panel by panel, column by column, columns filled up to whole panels.
    values: AlignedVec<f64>,
}

impl BlockedMatrix {
    /// Of nothing but zeros.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        let size = rows.next_multiple_of(ROWS) * columns.next_multiple_of(ROWS);
        Self { rows, columns, values: AlignedVec::zeros(size) }
    }

    /// Rows and columns.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        (self.rows, self.columns)
    }

    fn stride(&self) -> usize {
        self.columns.next_multiple_of(ROWS)
    }

    /// The entry there.
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.values[(row / ROWS * self.stride() + column) * ROWS + row % ROWS]
    }

    /// Puts an entry there.
    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        let stride = self.stride();
        self.values[(row / ROWS * stride + column) * ROWS + row % ROWS] = value;
    }

    /// Makes it one of nothing but zeros, of another shape, in the same memory.
    pub fn clear(&mut self, rows: usize, columns: usize) {
        (self.rows, self.columns) = (rows, columns);
        self.values.clear(rows.next_multiple_of(ROWS) * self.stride());
    }

    /// Fills a column from its top. Quickest for whole panels of values: zeros below the last row.
    pub fn fill_column(&mut self, column: usize, values: &[f64]) {
        let stride = self.stride();
        let (whole, rest) = values.as_chunks::<ROWS>();
        let columns = self.values.as_chunks_mut().0;
        for (panel, values) in whole.iter().enumerate() {
            columns[panel * stride + column] = *values;
        }
        if !rest.is_empty() {
            let last: &mut Column = &mut columns[whole.len() * stride + column];
            last[..rest.len()].copy_from_slice(rest);
        }
    }

    /// Eight rows.
    fn panel(&self, panel: usize) -> &[Column] {
        &self.values.as_chunks().0[panel * self.stride()..][..self.stride()]
    }

    /// All panels, one after the other.
    pub(super) fn panels_mut(&mut self) -> impl Iterator<Item = &mut [Column]> {
        let stride = self.stride().max(1);
        self.values.as_chunks_mut().0.chunks_exact_mut(stride)
    }

    /// This matrix times the transposed other one, which has as many columns.
    #[must_use]
    pub fn product(&self, other: &Self) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(self.rows, other.rows);
        on_widest(Product { left: self, right: other, same: false, product: &mut product });
        product
    }

    /// This matrix times itself transposed.
    #[must_use]
    pub fn square(&self) -> DMatrix<f64> {
        let mut product = DMatrix::zeros(self.rows, self.rows);
        on_widest(Product { left: self, right: self, same: true, product: &mut product });
        product.fill_upper_triangle_with_lower_triangle();
        product
    }
}

/// Products of all rows of two matrices; of the same one, what is above the diagonal's panels is left.
struct Product<'a> {
    left: &'a BlockedMatrix,
    right: &'a BlockedMatrix,
    same: bool,
    product: &'a mut DMatrix<f64>,
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { left, right, same, product } = self;
        let strips = ROWS / f64::width::<S>();
        for own in 0..right.rows.div_ceil(ROWS) {
            let factors = right.panel(own).as_flattened();
            let first = if same { own } else { 0 };
            for other in first..left.rows.div_ceil(ROWS) {
                let vectors = f64::vectors::<S>(left.panel(other).as_flattened());
                for strip in 0..strips {
                    let sums = add_products::<f64, S, ROWS>(
                        simd,
                        [simd.splat_f64s(0.0); ROWS],
                        factors,
                        vectors.iter().skip(strip).step_by(strips),
                    );
                    let mut out: Column = [0.0; ROWS];
                    let from = other * ROWS + strip * f64::width::<S>();
                    let to = left.rows.min(from + f64::width::<S>());
                    for (column, sum) in (own * ROWS..right.rows).zip(sums) {
                        f64::vectors_mut::<S>(&mut out)[0] = sum;
                        for row in from..to {
                            product[(row, column)] = out[row - from];
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{random::Random, simd::on_each};

    fn drawn(rows: usize, columns: usize) -> BlockedMatrix {
        let mut random = Random::new((rows * columns) as u64);
        let mut panels = BlockedMatrix::zeros(rows, columns);
        for row in 0..rows {
            (0..columns).for_each(|column| panels.set(row, column, random.normal()));
        }
        panels
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let (left, right) = (drawn(19, 45), drawn(11, 45));
        let mut all = vec![DMatrix::zeros(19, 11); 4];
        let mut next = all.iter_mut();
        let widths = on_each(|| Product {
            left: &left,
            right: &right,
            same: false,
            product: next.next().unwrap(),
        });
        assert!(all[..widths.len()].iter().all(|other| *other == all[0] && other.norm() > 0.0));
    }
}
