//! The point that several cameras saw, from where each of them saw it.
//!
//! Source: Hartley & Sturm 1997, "Triangulation" (doi:10.1006/cviu.1997.0547): a linear start, then
//! the least sum of squared pixel errors, which is the most likely point for equal Gaussian noise.

use super::{Pixel, Point3, ProjectionMatrix, Ray};
use nalgebra::{Matrix2x3, Matrix3, Vector3};
use wheatstone_numeric::least_squares::solve;

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

/// Most Gauss-Newton steps; from a linear start three or four are the rule.
const MOST_STEPS: usize = 50;

/// The point with the least sum of squared pixel errors, by damped Gauss-Newton from `start`.
///
/// `project` gives, for the n-th of `seen`, where a point falls and the derivatives. `None` where
/// the start does not project, or the rays do not determine a point.
pub fn refine(
    start: Point3,
    seen: &[Pixel],
    project: impl Fn(usize, Point3) -> Option<(Pixel, Matrix2x3<f64>)>,
) -> Option<Triangulated> {
    let normal_equations = |point: Point3| {
        let (mut matrix, mut vector, mut squares) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (index, pixel) in seen.iter().enumerate() {
            let (predicted, jacobian) = project(index, point)?;
            let error = pixel - predicted;
            matrix += jacobian.transpose() * jacobian;
            vector += jacobian.transpose() * error;
            squares += error.norm_squared();
        }
        Some((matrix, vector, squares))
    };
    let mut point = start;
    let (mut matrix, mut vector, mut squares) = normal_equations(point)?;
    let mut damping = 0.0;
    for _ in 0..MOST_STEPS {
        let damped = matrix + Matrix3::from_diagonal(&(matrix.diagonal() * damping));
        let step = damped.cholesky()?.solve(&vector);
        let moved = point + step;
        match normal_equations(moved) {
            // Near the end rounding hides what a step gains; it is no reason to stop short.
            Some((m, v, s)) if s <= squares * (1.0 + 1e-12) => {
                (point, matrix, vector, squares) = (moved, m, v, s);
                damping *= 0.1;
                // Below this a step changes the pixels by less than rounding does.
                if (matrix * step).dot(&step) < 1e-22 * (1.0 + squares) {
                    break;
                }
            }
            _ if (matrix * step).dot(&step) < 1e-18 * (1.0 + squares) => break,
            _ => damping = (damping * 10.0_f64).max(1e-3),
        }
    }
    let cofactor = matrix.try_inverse()?;
    let residual = (squares / (2 * seen.len()) as f64).sqrt();
    let finite = point.iter().chain(cofactor.iter()).all(|value| value.is_finite());
    finite.then_some(Triangulated { point, cofactor, residual })
}
