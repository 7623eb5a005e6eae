//! The state of least reprojection error for a set of motions, and what the pixels say against it.

use super::rows::{Equations, Freed, Rig, State};
use crate::{Result, method::FitErrors};
use nalgebra::DMatrix;
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Patience, search},
    matrix_product::{product, scaled},
    progress::Progress,
    statistics::chi_square_beyond,
};

/// A state, linearised there.
pub(super) struct Solution {
    pub(super) state: State,
    pub(super) equations: Equations,
    /// The columns that were free.
    pub(super) columns: Vec<usize>,
}

/// What chance makes of a sum of squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChiSquare {
    pub(super) value: f64,
    pub(super) freedom: usize,
}

impl ChiSquare {
    /// The probability that chance alone makes more.
    pub(super) fn chance(self) -> f64 {
        chi_square_beyond(self.value, self.freedom)
    }
}

impl Solution {
    /// From `start`, with these columns free; `None` where a camera does not see what it saw.
    pub(super) fn of(
        rig: &Rig<'_>,
        start: State,
        columns: Vec<usize>,
        progress: &dyn Progress,
    ) -> Result<Option<Self>> {
        const PATIENCE: Patience = Patience { steps: 40, least_gain: 1e-9 };
        let problem = Freed { rig, columns: &columns };
        let found = search(&problem, start, (PATIENCE, Damping::undamped()), progress)?;
        let found = found.map(|found| (found.state, found.equations));
        Ok(found.map(|(state, equations)| Self { state, equations, columns }))
    }

    /// The covariance of the gradient: by noise of so many variances of the pixels, and by what is uncertain of the
    /// cameras as they were fitted. `None` where that does not exist for a point.
    pub(super) fn noise(
        &self,
        rig: &Rig<'_>,
        variance: f64,
        errors: Option<&FitErrors<'_>>,
    ) -> Option<DMatrix<f64>> {
        let mut covariance = &self.equations.normal * variance;
        if let Some(errors) = errors.filter(|errors| errors.count > 0) {
            let mixed = rig.mixed(&self.state, &self.equations, errors)?;
            covariance += product(&mixed, &mixed.transpose());
        }
        Some(covariance)
    }

    /// The inverse of the normal matrix of the free columns, in their order.
    fn inverse(&self) -> Option<DMatrix<f64>> {
        let own = self.equations.normal.select_rows(&self.columns);
        pseudo_inverse(own.select_columns(&self.columns)).map(|(inverse, _)| inverse)
    }

    /// What gradients are once the free columns have taken up their share.
    fn freed(&self) -> Option<DMatrix<f64>> {
        let count = self.equations.normal.nrows();
        let mut freed = DMatrix::identity(count, count);
        if !self.columns.is_empty() {
            let across = self.equations.normal.select_columns(&self.columns);
            let taken = product(&across, &self.inverse()?);
            for (place, column) in self.columns.iter().enumerate() {
                for row in 0..count {
                    freed[(row, *column)] -= taken[(row, place)];
                }
            }
        }
        Some(freed)
    }

    /// What the pixels say against there being no other motion than those that are free.
    pub(super) fn against(&self, noise: &DMatrix<f64>) -> Option<ChiSquare> {
        let freed = self.freed()?;
        let covariance = product(&product(&freed, noise), &freed.transpose());
        let left = &freed * &self.equations.gradient;
        let (inverse, rank) = pseudo_inverse_of(covariance, noise)?;
        Some(ChiSquare { value: left.dot(&(inverse * &left)), freedom: rank })
    }

    /// The covariance of the free columns, in their order.
    pub(super) fn covariance(&self, noise: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let inverse = self.inverse()?;
        let own = noise.select_rows(&self.columns).select_columns(&self.columns);
        Some(product(&product(&inverse, &own), &inverse))
    }

    /// For each column the chi-square that a motion of one unit adds on average, and the directions that the pixels tell.
    pub(super) fn power(&self, noise: &DMatrix<f64>) -> Option<(Vec<f64>, usize)> {
        let (inverse, rank) = pseudo_inverse(noise.clone())?;
        let normal = &self.equations.normal;
        let power = product(&product(normal, &inverse), normal);
        Some((power.diagonal().as_slice().to_vec(), rank))
    }

    /// Sum of the squares that no place takes up, and how many there are less the free places.
    pub(super) fn squares(&self) -> (f64, usize) {
        let groups = &self.equations.groups;
        let squares = groups.iter().map(|rows| rows.left.norm_squared()).sum();
        (squares, groups.iter().map(|rows| rows.left.len() - rows.places()).sum())
    }
}

/// The inverse on the directions that a symmetric matrix says something of, and how many they are.
pub(super) fn pseudo_inverse(matrix: DMatrix<f64>) -> Option<(DMatrix<f64>, usize)> {
    let scale = matrix.clone();
    pseudo_inverse_of(matrix, &scale)
}

/// The same, of a matrix whose numbers are to be compared with the diagonal of `scale`.
fn pseudo_inverse_of(matrix: DMatrix<f64>, scale: &DMatrix<f64>) -> Option<(DMatrix<f64>, usize)> {
    /// Rounding leaves less.
    const LEAST: f64 = 1e-10;
    if matrix.is_empty() {
        return Some((matrix, 0));
    }
    let over: Vec<f64> = scale
        .diagonal()
        .iter()
        .map(|value| if *value > 0.0 { 1.0 / value.sqrt() } else { 0.0 })
        .collect();
    let unit = scaled(&over, matrix);
    let unit = (&unit + unit.transpose()) * 0.5;
    if !unit.iter().all(|value| value.is_finite()) {
        return None;
    }
    let axes = unit.symmetric_eigen();
    let mut back = axes.eigenvectors.clone();
    let mut rank = 0;
    for (mut axis, value) in back.column_iter_mut().zip(axes.eigenvalues.iter()) {
        if *value > LEAST {
            rank += 1;
            axis /= *value;
        } else {
            axis.fill(0.0);
        }
    }
    let found = product(&back, &axes.eigenvectors.transpose());
    Some((scaled(&over, found), rank))
}
