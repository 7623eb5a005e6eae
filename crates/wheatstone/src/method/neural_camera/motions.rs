//! What charts that may move add to a camera's sums: a point tells of its own chart only.

use super::{evidence::Sums, lens::PARAMETERS, loose::MOTION};
use nalgebra::{DMatrix, DVector};

/// Derivatives of points' pixels by their charts' motions.
#[derive(Default)]
pub(super) struct Motions {
    /// A point's row, the first of its chart's numbers, the slopes of x and y.
    pub(super) rows: Vec<(usize, usize, [[f64; MOTION]; 2])>,
}

impl Motions {
    /// Adds their part to sums that hold field and lens; `field` has a column a point, `lens` and
    /// `errors` a row.
    pub(super) fn add_to(
        &self,
        sums: &mut Sums,
        field: &DMatrix<f64>,
        (lens, errors): (&[DMatrix<f64>; 2], &[DVector<f64>; 2]),
    ) {
        for (row, first, slopes) in &self.rows {
            let first = PARAMETERS + first;
            let values = field.column(*row);
            for axis in 0..2 {
                for (index, slope) in slopes[axis].iter().enumerate() {
                    let place = first + index;
                    sums.mixed[axis].column_mut(place).axpy(*slope, &values, 1.0);
                    sums.lens_errors[place] += slope * errors[axis][*row];
                    for (number, own) in lens[axis].row(*row).iter().enumerate() {
                        sums.lens[(place, number)] += slope * own;
                        sums.lens[(number, place)] += slope * own;
                    }
                    for (other, by) in slopes[axis].iter().enumerate() {
                        sums.lens[(place, first + other)] += slope * by;
                    }
                }
            }
        }
    }
}
