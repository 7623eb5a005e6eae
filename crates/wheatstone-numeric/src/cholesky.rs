//! Cholesky factors of one to a few hundred unknowns, in vector registers: the step that second-order
//! training takes most often.
//!
//! The factor is kept in panels of eight rows, each panel column by column, so that every inner loop
//! runs through memory once. Sums run in the order of the columns, whatever the registers' width.

mod lower;
mod rows;

use super::{
    blocked_matrix::{Column, ROWS},
    simd::{Real, Simd, WithSimd, add_products, on_widest},
};
pub use lower::Lower;
use nalgebra::DMatrix;

/// L of `A = L L'`.
#[derive(Clone, Debug)]
pub struct Cholesky {
    lower: Lower,
    /// One over the diagonal, panel by panel: a division waits three times as long as a product.
    inverse_pivots: Vec<Column>,
}

impl Cholesky {
    /// Factors a matrix, of which only the lower triangle is read, with `more` added to its diagonal;
    /// `None` where it is not positive definite.
    #[must_use]
    pub fn new(matrix: &DMatrix<f64>, more: impl Fn(usize) -> f64) -> Option<Self> {
        Self::of(Lower::of(matrix), more)
    }

    /// As [`Cholesky::new`], of the lower triangle.
    #[must_use]
    pub fn of(matrix: Lower, more: impl Fn(usize) -> f64) -> Option<Self> {
        let mut factors = Self::begun(matrix, more);
        on_widest(Factor(&mut factors)).then_some(factors)
    }

    fn begun(mut lower: Lower, more: impl Fn(usize) -> f64) -> Self {
        lower.add_to_diagonal(more);
        Self { inverse_pivots: vec![[1.0; ROWS]; lower.panels()], lower }
    }

    fn size(&self) -> usize {
        self.lower.size()
    }

    fn panels(&self) -> usize {
        self.lower.panels()
    }

    fn panel(&self, panel: usize) -> &[Column] {
        self.lower.panel(panel)
    }

    /// The triangle that ends a panel, column by column, and one over its diagonal.
    fn triangle(&self, panel: usize) -> Triangle<'_> {
        let columns = self.panel(panel)[panel * ROWS..].as_chunks().0;
        Triangle { columns: &columns[0], inverse_pivots: &self.inverse_pivots[panel] }
    }

    /// Logarithm of the matrix's determinant.
    #[must_use]
    pub fn log_determinant(&self) -> f64 {
        2.0 * (0..self.size()).map(|index| libm::log(self.lower.get(index, index))).sum::<f64>()
    }

    /// The x of `A x = b`.
    #[must_use]
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        x.resize(self.panels() * ROWS, 0.0);
        on_widest(Solve(self, &mut x));
        x.truncate(self.size());
        x
    }

    /// The diagonal of the matrix's inverse: the squared lengths of the columns of L^-1.
    #[must_use]
    pub fn diagonal_of_inverse(&self) -> Vec<f64> {
        let mut squares = on_widest(Squares(self));
        squares.truncate(self.size());
        squares
    }
}

/// Eight by eight entries on the diagonal of L.
#[derive(Clone, Copy)]
struct Triangle<'a> {
    columns: &'a [Column; ROWS],
    inverse_pivots: &'a Column,
}

impl Triangle<'_> {
    /// Eight vectors times its inverse, in place: from the first to the last, what is known of each is taken
    /// from those that follow.
    #[inline(always)]
    fn take<S: Simd>(self, simd: S, rows: &mut [S::f64s; ROWS]) {
        let mut rest = rows.as_mut_slice();
        for (index, column) in self.columns.iter().enumerate() {
            let Some((known, later)) = rest.split_first_mut() else { return };
            *known = simd.mul_f64s(*known, simd.splat_f64s(self.inverse_pivots[index]));
            for (row, factor) in later.iter_mut().zip(&column[index + 1..]) {
                *row = f64::subtract_product(simd, *row, simd.splat_f64s(*factor), *known);
            }
            rest = later;
        }
    }
}

/// Takes the products of what is done of two panels, the pivots' and another's, from the other's next
/// eight columns.
#[inline(always)]
fn subtract<S: Simd>(simd: S, (pivots, done): (&[Column], &[Column]), columns: &mut [Column]) {
    let done = f64::vectors::<S>(done.as_flattened());
    let columns = f64::vectors_mut::<S>(columns.as_flattened_mut());
    let strips = ROWS / f64::width::<S>();
    for strip in 0..strips {
        let sums = add_products::<f64, S, ROWS>(
            simd,
            [simd.splat_f64s(0.0); ROWS],
            pivots.as_flattened(),
            done.iter().skip(strip).step_by(strips),
        );
        for (column, sum) in columns.iter_mut().skip(strip).step_by(strips).zip(sums) {
            *column = simd.sub_f64s(*column, sum);
        }
    }
}

/// Takes one panel of L, what is before its triangle and that, from eight rows of right sides: their next
/// eight columns.
#[inline(always)]
fn take_panel<S: Simd>(
    simd: S,
    (before, triangle): (&[Column], Triangle<'_>),
    rows: &mut [Column],
) {
    let (done, columns) = rows.split_at_mut(before.len());
    let columns = &mut columns[..ROWS];
    subtract(simd, (before, done), columns);
    let columns = f64::vectors_mut::<S>(columns.as_flattened_mut());
    let strips = ROWS / f64::width::<S>();
    for strip in 0..strips {
        let mut vectors: [S::f64s; ROWS] =
            std::array::from_fn(|column| columns[column * strips + strip]);
        triangle.take(simd, &mut vectors);
        for (column, vector) in vectors.into_iter().enumerate() {
            columns[column * strips + strip] = vector;
        }
    }
}

/// Factors in place; says whether the matrix is positive definite.
struct Factor<'a>(&'a mut Cholesky);

/// The triangle on the diagonal, column by column, in place, and one over its diagonal.
#[inline(always)]
fn factor_triangle(own: &mut [Column; ROWS]) -> Option<Column> {
    let mut inverse_pivots = [0.0; ROWS];
    for pivot in 0..ROWS {
        let square = own[pivot][pivot];
        if !(square > 0.0 && square.is_finite()) {
            return None;
        }
        let inverse = 1.0 / square.sqrt();
        inverse_pivots[pivot] = inverse;
        // Whole columns, which are quicker than what is below the diagonal.
        own[pivot].iter_mut().for_each(|entry| *entry *= inverse);
        let done = own[pivot];
        for (column, factor) in own.iter_mut().zip(done).skip(pivot + 1) {
            for (entry, done) in column.iter_mut().zip(&done) {
                *entry -= done * factor;
            }
        }
    }
    Some(inverse_pivots)
}

impl WithSimd for Factor<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let panels = self.0.panels();
        let mut rest = self.0.lower.columns_mut();
        for (own, inverse_pivots) in self.0.inverse_pivots.iter_mut().enumerate() {
            let (above, below) = rest.split_at_mut((own + 1) * ROWS);
            let (before, triangle) = above.split_at_mut(own * ROWS);
            let Some(triangle) = triangle.first_chunk_mut::<ROWS>() else { return false };
            let before = &*before;
            subtract(simd, (before, before), triangle);
            let Some(inverse) = factor_triangle(triangle) else { return false };
            *inverse_pivots = inverse;
            let triangle = Triangle { columns: triangle, inverse_pivots };
            let mut left = &mut *below;
            for other in own + 1..panels {
                let (panel, later) = left.split_at_mut((other + 1) * ROWS);
                take_panel(simd, (before, triangle), panel);
                left = later;
            }
            rest = below;
        }
        true
    }
}

/// Takes L and its transpose from one right side, in place.
struct Solve<'a>(&'a Cholesky, &'a mut [f64]);

impl WithSimd for Solve<'_> {
    type Output = ();

    /// Written number by number: the compiler makes registers of eight, as wide as there are.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for index in 0..self.0.panels() {
            let (known, rest) = self.1.split_at_mut(index * ROWS);
            let before = &self.0.panel(index)[..index * ROWS];
            let Triangle { columns: own, inverse_pivots } = self.0.triangle(index);
            let mut sums = [0.0; ROWS];
            for (column, value) in before.iter().zip(known) {
                for (sum, factor) in sums.iter_mut().zip(column) {
                    *sum += factor * *value;
                }
            }
            for row in 0..ROWS {
                let inside: f64 = (0..row).map(|column| own[column][row] * rest[column]).sum();
                rest[row] = (rest[row] - sums[row] - inside) * inverse_pivots[row];
            }
        }
        for index in (0..self.0.panels()).rev() {
            let (above, rest) = self.1.split_at_mut(index * ROWS);
            let before = &self.0.panel(index)[..index * ROWS];
            let Triangle { columns: own, inverse_pivots } = self.0.triangle(index);
            for row in (0..ROWS).rev() {
                let inside: f64 = (row + 1..ROWS).map(|below| own[row][below] * rest[below]).sum();
                rest[row] = (rest[row] - inside) * inverse_pivots[row];
            }
            let values: Column = std::array::from_fn(|row| rest[row]);
            for (column, sum) in before.iter().zip(above) {
                let [a, b, c, d, e, f, g, h] = std::array::from_fn(|row| column[row] * values[row]);
                *sum -= ((a + b) + (c + d)) + ((e + f) + (g + h));
            }
        }
    }
}

/// The squared lengths of the columns of L^-1, eight columns at a time.
struct Squares<'a>(&'a Cholesky);

impl WithSimd for Squares<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let (panels, width) = (self.0.panels(), f64::width::<S>());
        let mut squares = vec![0.0; panels * ROWS];
        // Rows of L^-1, as far as the register reaches across its columns.
        let mut inverse = vec![simd.splat_f64s(0.0); panels * ROWS];
        let totals = f64::vectors_mut::<S>(&mut squares);
        for (place, total) in totals.iter_mut().enumerate() {
            let first = place * width / ROWS;
            for own in first..panels {
                let before = &self.0.panel(own)[..own * ROWS];
                let known = &inverse[first * ROWS..own * ROWS];
                let mut rows = add_products::<f64, S, ROWS>(
                    simd,
                    [simd.splat_f64s(0.0); ROWS],
                    before[first * ROWS..].as_flattened(),
                    known.iter(),
                );
                let zero = simd.splat_f64s(0.0);
                rows = rows.map(|row| simd.sub_f64s(zero, row));
                if own == first {
                    for (row, vector) in rows.iter_mut().enumerate() {
                        let mut unit = [0.0; ROWS];
                        unit[row] = 1.0;
                        *vector = f64::vectors::<S>(&unit)[place % (ROWS / width)];
                    }
                }
                self.0.triangle(own).take(simd, &mut rows);
                for row in rows {
                    *total = f64::add_product(simd, *total, row, row);
                }
                inverse[own * ROWS..][..ROWS].copy_from_slice(&rows);
            }
        }
        squares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{random::Random, simd::on_each};

    fn positive(size: usize) -> DMatrix<f64> {
        let mut random = Random::new(size as u64);
        let square = DMatrix::from_fn(size, size, |_, _| random.normal());
        &square * square.transpose()
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let factors = Cholesky::new(&positive(45), |_| 0.5).unwrap();
        let diagonals = on_each(|| Squares(&factors));
        assert!(diagonals.iter().all(|other| *other == diagonals[0]));
        let right: Vec<f64> = (0..48).map(|index| libm::sin(f64::from(index))).collect();
        let mut solved = vec![right; 4];
        let mut next = solved.iter_mut();
        let widths = on_each(|| Solve(&factors, next.next().unwrap())).len();
        assert!(solved[..widths].iter().all(|other| *other == solved[0]));
        let mut all = vec![Cholesky::begun(Lower::of(&positive(45)), |_| 0.5); 4];
        let mut next = all.iter_mut();
        let done = on_each(|| Factor(next.next().unwrap()));
        assert!(done.iter().all(|done| *done));
        assert!(
            all[..done.len()].iter().all(|other| other.lower.columns() == factors.lower.columns())
        );
    }
}
