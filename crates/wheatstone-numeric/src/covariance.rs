//! What is not known about numbers that least squares found: their covariance, kept as a triangle.

use crate::matrix_product::{self, scaled};
use nalgebra::{DMatrix, Matrix2};
use serde::{Deserialize, Serialize};

/// A symmetric matrix, its lower triangle row by row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Covariance(Vec<f64>);

impl Covariance {
    /// Of a matrix whose upper triangle says the same as its lower one.
    #[must_use]
    pub fn of(matrix: &DMatrix<f64>) -> Self {
        let row = |row: usize| (0..=row).map(move |column| matrix[(row, column)]);
        Self((0..matrix.nrows()).flat_map(row).collect())
    }

    /// Of so many numbers that are exact.
    #[must_use]
    pub fn zero(numbers: usize) -> Self {
        Self(vec![0.0; numbers * (numbers + 1) / 2])
    }

    /// Covariance of two numbers that depend on the uncertain ones with these `slopes`: the
    /// derivatives of both by each.
    #[must_use]
    pub fn of_two(&self, slopes: &[[f64; 2]]) -> Matrix2<f64> {
        let (mut first, mut mixed, mut second) = (0.0, 0.0, 0.0);
        let mut start = 0;
        for (index, own) in slopes.iter().enumerate() {
            let row = &self.0[start..=start + index];
            start += index + 1;
            let (mut below_first, mut below_second) = (0.0, 0.0);
            for (value, other) in row.iter().zip(&slopes[..index]) {
                below_first += value * other[0];
                below_second += value * other[1];
            }
            let diagonal = row[index];
            first += own[0] * (2.0 * below_first + diagonal * own[0]);
            second += own[1] * (2.0 * below_second + diagonal * own[1]);
            mixed += own[0] * (below_second + diagonal * own[1]) + own[1] * below_first;
        }
        Matrix2::new(first, mixed, mixed, second)
    }

    /// The covariance of two of the numbers; `None` where there are not so many.
    #[must_use]
    pub fn between(&self, first: usize, second: usize) -> Option<f64> {
        let (row, column) = (first.max(second), first.min(second));
        self.0.get(row * (row + 1) / 2 + column).copied()
    }

    /// Variance of a number that depends on the uncertain ones with these `slopes`.
    #[must_use]
    pub fn of_one(&self, slopes: &[f64]) -> f64 {
        let (mut sum, mut start) = (0.0, 0);
        for (index, own) in slopes.iter().enumerate() {
            let row = &self.0[start..=start + index];
            start += index + 1;
            sum += own * (2.0 * product(row, &slopes[..index]) + row[index] * own);
        }
        sum
    }

    /// The whole matrix of so many numbers; zeros where it holds fewer.
    #[must_use]
    pub fn matrix(&self, numbers: usize) -> DMatrix<f64> {
        DMatrix::from_fn(numbers, numbers, |row, column| self.between(row, column).unwrap_or(0.0))
    }

    /// Whether it is one of so many numbers, and finite.
    #[must_use]
    pub fn is_sound(&self, numbers: usize) -> bool {
        let diagonal = (0..numbers).map(|index| index * (index + 3) / 2);
        self.0.len() == numbers * (numbers + 1) / 2
            && self.0.iter().all(|value| value.is_finite())
            && diagonal.into_iter().all(|place| self.0[place] >= 0.0)
    }
}

/// Of as many numbers as the shorter list has, in eight sums: one would wait for each addition.
fn product(one: &[f64], other: &[f64]) -> f64 {
    let count = one.len().min(other.len());
    let (ones, one_rest) = one[..count].as_chunks::<8>();
    let (others, other_rest) = other[..count].as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (one, other) in ones.iter().zip(others) {
        for ((sum, one), other) in sums.iter_mut().zip(one).zip(other) {
            *sum += one * other;
        }
    }
    let rest: f64 = one_rest.iter().zip(other_rest).map(|(one, other)| one * other).sum();
    rest + sums.iter().sum::<f64>()
}

/// A matrix that gives a covariance when multiplied by its transpose: row by number, column by independent error of
/// standard deviation 1. The numbers may be in many units; of a matrix that rounding made indefinite, what is negative is
/// left out.
#[must_use]
pub fn square_root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    if covariance.is_empty() {
        return covariance.clone();
    }
    let sigmas = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
    let over = sigmas.map(|sigma| if sigma > 0.0 { 1.0 / sigma } else { 0.0 });
    let axes = scaled(over.as_slice(), covariance.clone()).symmetric_eigen();
    let mut root = axes.eigenvectors;
    for (mut column, value) in root.column_iter_mut().zip(axes.eigenvalues.iter()) {
        column *= value.max(0.0).sqrt();
    }
    for (mut row, sigma) in root.row_iter_mut().zip(sigmas.iter()) {
        row *= *sigma;
    }
    root
}

/// The sums from which follows the covariance of unknowns that least squares found, where each
/// equation's error has a variance of its own.
#[derive(Clone, Debug)]
pub struct LeastSquaresCovariance {
    normal: DMatrix<f64>,
    errors: DMatrix<f64>,
}

/// Added to a normal matrix of unit diagonal that rounding has made singular: what the equations say
/// less of than this is taken for unknown.
pub(crate) const UNKNOWN: f64 = 1e-12;

impl LeastSquaresCovariance {
    /// Of so many unknowns.
    #[must_use]
    pub fn new(unknowns: usize) -> Self {
        let zeros = DMatrix::zeros(unknowns, unknowns);
        Self { normal: zeros.clone(), errors: zeros }
    }

    /// Adds an equation: its derivatives by the unknowns, and its error's variance.
    pub fn add(&mut self, slopes: &[f64], variance: f64) {
        add_square(&mut self.normal, slopes, 1.0);
        add_square(&mut self.errors, slopes, variance);
    }

    /// Holds the unknowns where they are along `direction`, which no equation tells of.
    pub fn hold(&mut self, direction: &[f64]) {
        let scale = self.normal.diagonal().amax();
        add_square(&mut self.normal, direction, scale);
    }

    /// The unknowns' covariance; `None` where equations are not finite.
    #[must_use]
    pub fn covariance(mut self) -> Option<Covariance> {
        self.normal.fill_upper_triangle_with_lower_triangle();
        self.errors.fill_upper_triangle_with_lower_triangle();
        let scales = self.normal.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
        let unit = scaled(scales.as_slice(), self.normal);
        let factors = unit.clone().cholesky().or_else(|| {
            (unit + DMatrix::from_diagonal_element(scales.len(), scales.len(), UNKNOWN)).cholesky()
        })?;
        // From both sides of the errors by the factor: where unknowns hardly differ in what they do, the inverse has
        // large numbers that cancel, and twice the inverse would leave nothing but their rounding.
        let factor = factors.unpack();
        let errors = scaled(scales.as_slice(), self.errors);
        let half = factor.solve_lower_triangular(&errors)?;
        let own = factor.solve_lower_triangular(&half.transpose())?;
        let back = factor.solve_lower_triangular(&DMatrix::identity(scales.len(), scales.len()))?;
        let spread =
            matrix_product::product(&matrix_product::product(&back.transpose(), &own), &back);
        let covariance = scaled(scales.as_slice(), spread);
        covariance.iter().all(|value| value.is_finite()).then(|| Covariance::of(&covariance))
    }
}

/// Adds `factor` times the products of all pairs to the lower triangle.
fn add_square(matrix: &mut DMatrix<f64>, row: &[f64], factor: f64) {
    for (column, value) in row.iter().enumerate() {
        let scaled = factor * value;
        for (place, other) in row.iter().enumerate().skip(column) {
            matrix[(place, column)] += scaled * other;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_root_gives_the_covariance_again() {
        // In many units, and of a number that is known exactly.
        let slopes = DMatrix::from_row_slice(3, 2, &[1e-4, 2e-4, 50.0, -3.0, 0.0, 0.0]);
        let covariance = matrix_product::product(&slopes, &slopes.transpose());
        let root = square_root(&covariance);
        let again = matrix_product::product(&root, &root.transpose());
        let scales = [1e4, 0.02, 1.0];
        assert!(scaled(&scales, again - covariance).norm() < 1e-12);
        assert!(square_root(&DMatrix::zeros(0, 0)).is_empty());
    }
}
