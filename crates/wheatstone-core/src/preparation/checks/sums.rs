//! What small changes of single views would do to a camera's fit, to first order.

use super::{
    decentred_camera::{Row, UNKNOWNS},
    pairs::Pair,
    resection::Normal,
    robust_camera::RobustCamera,
};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// Weighted sums of a camera's fit to all views, and of each view: what changes of single views would
/// do to the fit follows from them to first order.
pub(super) struct Sums {
    /// Inverse of the normal matrix.
    pub(super) inverse: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Slopes times errors, of all views.
    pub(super) gradient: SVector<f64, UNKNOWNS>,
    /// Each view's slopes by x and y.
    pub(super) slopes: Vec<SMatrix<f64, UNKNOWNS, 2>>,
    /// Each view's errors.
    pub(super) errors: Vec<Vector2<f64>>,
    /// Each view's weight.
    pub(super) weights: Vec<f64>,
}

/// All errors count alike but gross ones. A weight that falls with the error would draw the offset of
/// a view towards nothing: its points are the ones with the greatest errors.
fn even(error: f64, scale: f64) -> f64 {
    // Whole pixels of offset are to be seen, beside all that noise and lens leave.
    if error < 3.0 * scale + 2.0 { 1.0 / (scale * scale) } else { 0.0 }
}

impl Sums {
    /// Of a camera fitted to all views, starting from one fitted to most.
    pub(super) fn of(camera: &RobustCamera, views: &[Vec<Pair>]) -> Self {
        let all: Vec<Pair> = views.iter().flatten().copied().collect();
        let camera = camera.without_field().refined(&all, 8);
        let whole = Normal::weighed(&camera.formula, &all, even);
        let mut sums = Self {
            inverse: whole.matrix.try_inverse().unwrap_or_else(SMatrix::zeros),
            gradient: whole.gradient,
            slopes: Vec::new(),
            errors: Vec::new(),
            weights: Vec::new(),
        };
        for pairs in views {
            let mut slopes = SMatrix::zeros();
            let (mut errors, mut weights) = (Vector2::zeros(), 0.0);
            for (world, pixel) in pairs {
                let Some(Row { by_turn, by_point, by_lens, pixel: seen, .. }) =
                    camera.formula.row(*world)
                else {
                    continue;
                };
                let error = pixel - seen;
                let weight = even(error.norm(), whole.scale);
                for axis in 0..2 {
                    for index in 0..3 {
                        slopes[(index, axis)] += weight * by_turn[(axis, index)];
                        slopes[(3 + index, axis)] += weight * by_point[(axis, index)];
                    }
                    for (index, slope) in by_lens.iter().enumerate() {
                        slopes[(6 + index, axis)] += weight * slope[axis];
                    }
                }
                errors += error * weight;
                weights += weight;
            }
            sums.slopes.push(slopes);
            sums.errors.push(errors);
            sums.weights.push(weights);
        }
        sums
    }
}

/// Sums over views whose pictures are shifted together, each by so many times the shift.
#[derive(Default)]
pub(super) struct Total {
    slopes: SMatrix<f64, UNKNOWNS, 2>,
    pub(super) weight: f64,
    errors: Vector2<f64>,
}

impl Total {
    pub(super) fn add(&mut self, sums: &Sums, (view, times): (usize, f64)) {
        self.slopes += sums.slopes[view] * times;
        self.weight += sums.weights[view] * times * times;
        self.errors += sums.errors[view] * times;
    }

    /// The normal equations of the shift, of what the camera cannot take up: matrix and right side.
    pub(super) fn reduced(&self, sums: &Sums) -> (Matrix2<f64>, Vector2<f64>) {
        let carried = sums.inverse * self.slopes;
        let matrix = Matrix2::identity() * self.weight - self.slopes.transpose() * carried;
        (matrix, self.errors - carried.transpose() * sums.gradient)
    }
}
