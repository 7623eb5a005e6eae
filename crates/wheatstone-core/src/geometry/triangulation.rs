//! The point that several cameras saw, from where each of them saw it.
//!
//! Source: Hartley & Sturm 1997, "Triangulation" (doi:10.1006/cviu.1997.0547): a linear start, then
//! the least sum of squared pixel errors, which is the most likely point for equal Gaussian noise.

use super::{Pixel, Point3, ProjectionMatrix, Ray};
use nalgebra::{Matrix2x3, Matrix3, Vector3};
use wheatstone_numeric::{
    least_squares::solve,
    levenberg_marquardt::{Damping, Patience, Problem, search},
    progress::Silent,
};

/// A point found from its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangulated {
    /// The point.
    pub point: Point3,
    /// Inverse of the normal matrix: its covariance for unit pixel noise.
    pub cofactor: Matrix3<f64>,
    /// Root mean square of the leftover pixel errors over all coordinates.
    pub residual: f64,
}

/// The point nearest to all rays, taken for whole lines, by least squares. `None` for fewer than two,
/// and for those that are as good as parallel: the mean squared sine of their angles to their mean
/// direction is not above `parallel` (0 lets all pass that rounding tells from parallel ones).
#[must_use]
pub fn nearest(rays: impl Iterator<Item = Ray>, parallel: f64) -> Option<Point3> {
    let (mut matrix, mut vector, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for ray in rays {
        let across = Matrix3::identity() - ray.direction * ray.direction.transpose();
        matrix += across;
        vector += across * ray.origin.coords;
        count += 1.0;
    }
    // Eigenvalues cost more than all the rest.
    let meet = || parallel <= 0.0 || matrix.symmetric_eigenvalues().min() > parallel * count;
    if count < 2.0 || !meet() {
        return None;
    }
    Some(Point3::from(matrix.cholesky()?.solve(&vector)))
}

/// The linear solution: the least-squares point of the cameras' equations `u w = P1 X`, each
/// weighted equally. `None` for fewer than two cameras, or parallel rays.
#[must_use]
pub fn linear<'a>(seen: impl Iterator<Item = (&'a ProjectionMatrix, Pixel)>) -> Option<Point3> {
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for (camera, pixel) in seen {
        for (row, value) in [(0, pixel.x), (1, pixel.y)] {
            let equation = camera.0.row(row) - camera.0.row(2) * value;
            left.extend([equation[0], equation[1], equation[2]]);
            right.push(-equation[3]);
        }
    }
    if right.len() < 4 {
        return None;
    }
    let point = solve(&left, 3, &right, 1)?;
    Some(Point3::new(point[0], point[1], point[2]))
}

/// From a linear start three or four steps are the rule; the last one changes no pixel.
const PATIENCE: Patience = Patience { steps: 50, least_gain: 0.0 };

/// The point with the least sum of squared pixel errors, by Gauss-Newton steps from `start`, damped where one
/// leads astray.
///
/// `project` gives, for the n-th of `seen`, where a point falls and the derivatives. `None` where
/// the start does not project, or the rays do not determine a point.
pub fn refine(
    start: Point3,
    seen: &[Pixel],
    project: impl Fn(usize, Point3) -> Option<(Pixel, Matrix2x3<f64>)>,
) -> Option<Triangulated> {
    let problem = Triangulation { seen, project };
    let found = search(&problem, start, (PATIENCE, Damping::undamped()), &Silent).ok()??;
    let Equations { matrix, squares, .. } = found.equations;
    let (point, cofactor) = (found.state, matrix.try_inverse()?);
    let residual = (squares / (2 * seen.len()) as f64).sqrt();
    let finite = point.iter().chain(cofactor.iter()).all(|value| value.is_finite());
    finite.then_some(Triangulated { point, cofactor, residual })
}

/// Pixels of one point, and how cameras project.
struct Triangulation<'a, F> {
    seen: &'a [Pixel],
    project: F,
}

/// J'J, J'r for the errors r of the pixels, and the sum of their squares.
struct Equations {
    matrix: Matrix3<f64>,
    vector: Vector3<f64>,
    squares: f64,
}

impl<F: Fn(usize, Point3) -> Option<(Pixel, Matrix2x3<f64>)>> Problem for Triangulation<'_, F> {
    type State = Point3;
    type Equations = Equations;
    type Step = Vector3<f64>;

    fn linearise(&self, point: &Point3) -> Option<Equations> {
        let (mut matrix, mut vector, mut squares) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (index, pixel) in self.seen.iter().enumerate() {
            let (predicted, jacobian) = (self.project)(index, *point)?;
            let error = pixel - predicted;
            matrix += jacobian.transpose() * jacobian;
            vector += jacobian.transpose() * error;
            squares += error.norm_squared();
        }
        Some(Equations { matrix, vector, squares })
    }

    fn step(&self, equations: &Equations, damping: f64) -> Option<(Vector3<f64>, f64)> {
        let Equations { matrix, vector, .. } = equations;
        let damped = matrix + Matrix3::from_diagonal(&(matrix.diagonal() * damping));
        let step = damped.cholesky()?.solve(vector);
        Some((step, 0.5 * (step.dot(vector) + step.dot(&((damped - matrix) * step)))))
    }

    fn moved(&self, point: &Point3, step: &Vector3<f64>) -> Point3 {
        point + step
    }

    fn cost(&self, equations: &Equations) -> f64 {
        0.5 * equations.squares
    }

    /// Near the end rounding hides what a step gains; it is no reason to stop short.
    fn gain(&self, before: &Equations, after: &Equations) -> f64 {
        0.5 * (before.squares * (1.0 + 1e-12) - after.squares)
    }

    fn is_negligible(&self, equations: &Equations, step: &Vector3<f64>) -> bool {
        (equations.matrix * step).dot(step) < 1e-22 * (1.0 + equations.squares)
    }
}
