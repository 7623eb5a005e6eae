//! Dense normal equations, for up to some hundreds of unknowns.

use super::{Damping, Patience, Problem, search};
use crate::progress::Progress;
use crate::{Error, Result};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// J'J and J'r of a least-squares problem with residuals r and Jacobian J = dr/dp, added up row by
/// row in the caller's order, so that the same input gives the same bits.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    /// J'J; only its lower triangle is kept up while rows are added.
    matrix: DMatrix<f64>,
    /// J'r.
    gradient: DVector<f64>,
}

impl NormalEquations {
    /// Of a problem with so many unknowns.
    #[must_use]
    pub fn new(unknowns: usize) -> Self {
        Self { matrix: DMatrix::zeros(unknowns, unknowns), gradient: DVector::zeros(unknowns) }
    }

    /// Adds a residual whose derivatives by the unknowns are `row`.
    pub fn add(&mut self, row: &[f64], residual: f64) {
        let count = row.len();
        for (column, (value, gradient)) in row.iter().zip(self.gradient.iter_mut()).enumerate() {
            if *value != 0.0 {
                *gradient += value * residual;
                let below =
                    &mut self.matrix.as_mut_slice()[column * count + column..][..count - column];
                for (sum, other) in below.iter_mut().zip(&row[column..]) {
                    *sum += value * other;
                }
            }
        }
    }

    /// Adds the two residuals of a pixel, whose derivatives by the unknowns are `rows`.
    pub fn add_pixel(&mut self, rows: [&[f64]; 2], residuals: [f64; 2]) {
        let [first, second] = rows;
        let count = first.len().min(second.len());
        let mut columns = self.matrix.as_mut_slice().chunks_exact_mut(count.max(1));
        for (column, gradient) in self.gradient.iter_mut().enumerate().take(count) {
            let (a, b) = (first[column], second[column]);
            *gradient += a * residuals[0] + b * residuals[1];
            let Some(below) = columns.next() else { return };
            let others = first[column..count].iter().zip(&second[column..count]);
            for (sum, (p, q)) in below[column..].iter_mut().zip(others) {
                *sum += a * p + b * q;
            }
        }
    }

    /// Adds many residuals, of whose slopes and errors these are the products with each other; each unknown
    /// has its place among them, and the errors have one.
    pub fn add_square<const N: usize>(
        &mut self,
        places: &[usize],
        error: usize,
        products: &[[f64; N]; N],
    ) {
        for (column, place) in places.iter().enumerate() {
            self.gradient[column] += products[error][*place];
            for (row, other) in places.iter().enumerate().skip(column) {
                self.matrix[(row, column)] += products[*other][*place];
            }
        }
    }

    /// Adds a residual that depends on some unknowns only: `(unknown, derivative)`, each once.
    pub fn add_sparse(&mut self, row: &[(usize, f64)], residual: f64) {
        for (column, value) in row {
            self.gradient[*column] += value * residual;
            for (other, slope) in row {
                if other >= column {
                    self.matrix[(*other, *column)] += value * slope;
                }
            }
        }
    }

    /// J'J, whole.
    #[must_use]
    pub fn matrix(&self) -> DMatrix<f64> {
        let mut whole = self.matrix.clone();
        whole.fill_upper_triangle_with_lower_triangle();
        whole
    }

    /// J'r.
    #[must_use]
    pub fn gradient(&self) -> &DVector<f64> {
        &self.gradient
    }

    /// The factors of `J'J + damping * diag(J'J)`, if it is positive definite.
    fn damped(&self, damping: f64) -> Option<Cholesky<f64, Dyn>> {
        let mut matrix = self.matrix();
        for index in 0..matrix.nrows() {
            let diagonal = matrix[(index, index)];
            // An unknown that nothing depends on stays where it is.
            matrix[(index, index)] += damping * if diagonal > 0.0 { diagonal } else { 1.0 };
        }
        matrix.cholesky()
    }
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// The unknowns.
    pub parameters: Vec<f64>,
    /// Half the sum of squared residuals.
    pub cost: f64,
    /// The normal equations there: the inverse of their matrix is the unknowns' covariance for unit
    /// noise.
    pub normal: NormalEquations,
}

/// Looks for the least cost from `start`.
///
/// `evaluate` adds every residual and its derivatives to the normal equations, which hold none, and returns
/// half the sum of squared residuals, or `None` where they do not exist (a point behind a camera).
///
/// # Errors
///
/// [`Error::Degenerate`] where the residuals do not exist at the start, [`Error::Cancelled`].
pub fn minimise(
    start: &[f64],
    patience: Patience,
    progress: &dyn Progress,
    evaluate: impl Fn(&[f64], &mut NormalEquations) -> Option<f64>,
) -> Result<Minimum> {
    // Steps are nearly Gauss's and Newton's.
    let damping = Damping::nielsen(1e-3, 1.0 / 3.0);
    let found = search(&Dense { evaluate }, start.to_vec(), (patience, damping), progress)?;
    let found = found.ok_or_else(|| Error::Degenerate {
        problem: "the least-squares search cannot start: its initial guess explains no point"
            .into(),
        hint: "check the points for gross errors, such as exchanged columns".into(),
    })?;
    let (cost, normal) = found.equations;
    Ok(Minimum { parameters: found.state, cost, normal })
}

/// A problem whose residuals a function adds up.
struct Dense<F> {
    evaluate: F,
}

impl<F: Fn(&[f64], &mut NormalEquations) -> Option<f64>> Problem for Dense<F> {
    type State = Vec<f64>;
    /// Cost and equations.
    type Equations = (f64, NormalEquations);
    type Step = DVector<f64>;

    fn linearise(&self, state: &Vec<f64>) -> Option<Self::Equations> {
        let mut normal = NormalEquations::new(state.len());
        let cost = (self.evaluate)(state, &mut normal).filter(|cost| cost.is_finite())?;
        Some((cost, normal))
    }

    fn step(&self, (_, normal): &Self::Equations, damping: f64) -> Option<(Self::Step, f64)> {
        let step = -normal.damped(damping)?.solve(&normal.gradient);
        let diagonal = normal.matrix.diagonal().component_mul(&step);
        let promised = 0.5 * (damping * step.dot(&diagonal) - step.dot(&normal.gradient));
        Some((step, promised))
    }

    fn moved(&self, state: &Vec<f64>, step: &Self::Step) -> Vec<f64> {
        state.iter().zip(step.iter()).map(|(value, by)| value + by).collect()
    }

    fn cost(&self, (cost, _): &Self::Equations) -> f64 {
        *cost
    }
}
