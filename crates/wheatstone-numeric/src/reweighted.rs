//! Linear least squares solved again and again with other weights.
//!
//! The unknowns are those of an orthonormal basis of the matrix's columns, found once: the normal equations of
//! any weights are then about as well determined as the weights are even, and may be squared without harm.

use super::{blocked_matrix::BlockedMatrix, cholesky::Cholesky};
use nalgebra::{DMatrix, DMatrixView};

/// A matrix made ready for other and other weights of its rows.
#[derive(Clone, Debug)]
pub struct Reweighted {
    /// Columns: those of the matrix.
    width: usize,
    /// The basis at each row of the matrix, row by row.
    basis: Vec<f64>,
    /// The rows that keep unknowns small, in the basis.
    ridge: Vec<f64>,
    /// Every so many rows are fitted.
    stride: usize,
    /// Weighted rows, then right-hand sides, a column each.
    columns: BlockedMatrix,
}

/// What rounding may take from a unit of the basis, and more: without it nothing would be left of one that
/// only rows of no weight show.
const LEAST: f64 = 1e-12;

impl Reweighted {
    /// `a` holds a matrix row by row, `width` numbers a row. Of many rows at most `most` are fitted, evenly
    /// chosen. Each unknown is held near 0 by a row of weight one in which it is multiplied by `ridge`, above 0.
    /// `None` for numbers that are not finite.
    #[must_use]
    pub fn new(a: &[f64], width: usize, ridge: f64, most: usize) -> Option<Self> {
        let height = a.len() / width;
        if a.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let stride = height.div_ceil(most).max(1);
        let mut stacked: Vec<f64> =
            a.chunks_exact(width).step_by(stride).flat_map(|row| row.to_vec()).collect();
        for own in 0..width {
            stacked.extend((0..width).map(|column| if column == own { ridge } else { 0.0 }));
        }
        let r = DMatrix::from_row_slice(stacked.len() / width, width, &stacked).qr().r();
        let inverse = r.solve_upper_triangular(&DMatrix::identity(width, width))?;
        // Row by row is the transposed matrix, column by column.
        let basis = inverse.tr_mul(&DMatrixView::from_slice(a, width, height));
        Some(Self {
            width,
            basis: basis.as_slice().to_vec(),
            ridge: (inverse.transpose() * ridge).as_slice().to_vec(),
            stride,
            columns: BlockedMatrix::default(),
        })
    }

    /// What the matrix's first `terms` columns make of all rows, fitted to `sides` with these weights, both a
    /// row each; `None` where the weights leave nothing to fit.
    pub fn fitted<const SIDES: usize>(
        &mut self,
        terms: usize,
        weights: &[f64],
        sides: &[[f64; SIDES]],
    ) -> Option<Vec<[f64; SIDES]>> {
        let fitted = weights.len().div_ceil(self.stride);
        self.columns.clear(terms + SIDES, fitted + terms);
        let mut column = vec![0.0; terms + SIDES];
        let rows = self.basis.chunks_exact(self.width).zip(weights).zip(sides).step_by(self.stride);
        for (place, ((row, weight), side)) in rows.enumerate() {
            let root = weight.sqrt();
            let values = row[..terms].iter().chain(side);
            column.iter_mut().zip(values).for_each(|(to, value)| *to = root * value);
            self.columns.fill_column(place, &column);
        }
        for (place, row) in self.ridge.chunks_exact(self.width).take(terms).enumerate() {
            self.columns.fill_column(fitted + place, &row[..terms]);
        }
        let sums = self.columns.square();
        let normal = sums.view((0, 0), (terms, terms)).into_owned();
        let factors = Cholesky::new(&normal, |_| LEAST)?;
        let solutions: [Vec<f64>; SIDES] = std::array::from_fn(|side| {
            factors.solve(&sums.as_slice()[(terms + side) * sums.nrows()..][..terms])
        });
        let at = |row: &[f64]| {
            let of = |solution: &Vec<f64>| row.iter().zip(solution).map(|(a, b)| a * b).sum();
            std::array::from_fn(|side| of(&solutions[side]))
        };
        Some(self.basis.chunks_exact(self.width).map(at).collect())
    }
}
