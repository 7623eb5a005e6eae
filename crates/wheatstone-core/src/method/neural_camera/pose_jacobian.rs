//! What charts that may move add to a camera's sums: a point tells of its own chart only.

use super::{
    chart_poses::MOTION,
    evidence::{SIDE, Sums},
    lens::PARAMETERS,
};
use wheatstone_numeric::blocked_matrix::BlockedMatrix;

/// Derivatives of points' pixels by their charts' motions.
#[derive(Default)]
pub(super) struct Motions {
    /// A point's row, the first of its chart's numbers, the slopes of x and y.
    pub(super) rows: Vec<(usize, usize, [[f64; MOTION]; 2])>,
}

impl Motions {
    /// Adds their part to sums that hold field and lens, from the points' columns of which those were made.
    pub(super) fn add_to(&self, sums: &mut Sums, (field, sides): (&BlockedMatrix, &BlockedMatrix)) {
        for (row, first, slopes) in &self.rows {
            let first = PARAMETERS + first;
            for (axis, slopes) in slopes.iter().enumerate() {
                let side = |number: usize| sides.get(axis * SIDE + number, *row);
                for (index, slope) in slopes.iter().enumerate() {
                    let place = first + index;
                    for function in 0..field.shape().0 {
                        sums.mixed[axis][(function, place)] += slope * field.get(function, *row);
                    }
                    sums.lens_errors[place] += slope * side(PARAMETERS);
                    for number in 0..PARAMETERS {
                        sums.lens[(place, number)] += slope * side(number);
                        sums.lens[(number, place)] += slope * side(number);
                    }
                    for (other, by) in slopes.iter().enumerate() {
                        sums.lens[(place, first + other)] += slope * by;
                    }
                }
            }
        }
    }
}
