//! How disparities change along rows and columns, on the surface that a pixel lies on.

use crate::{
    field::{Field, MARGIN},
    registers::{FLOATS, Floats, floats},
    window::{Quantities, RADIUS, Sums, sum_windows},
};

/// Disparities of neighbours that differ by more than this, in pixels, are of two surfaces.
const MOST_STEP: f32 = 1.0;
/// Steps that count as zero beside those of a window: a slope of few steps is uncertain.
const PRIOR_STEPS: f32 = 4.0;

struct Steps<'a>(&'a Field);

/// Steps to the right and their number, steps down and their number.
impl Quantities<4> for Steps<'_> {
    #[inline(always)]
    fn at(&self, y: usize, column: usize) -> [Floats; 4] {
        let row = self.0.row(y);
        let below = self.0.row((y + 1).min(self.0.height - 1));
        let here = floats(row, column);
        // Beside the picture there are no disparities: any will do behind the last.
        let right = floats(row, (column + 1).min(row.len() - FLOATS));
        let down = floats(below, column);
        let mut all = [[0.0; FLOATS]; 4];
        for lane in 0..FLOATS {
            let steps = [right[lane] - here[lane], down[lane] - here[lane]];
            for (k, step) in steps.into_iter().enumerate() {
                // No comparison with NaN holds.
                let on_surface = step.abs() <= MOST_STEP;
                all[2 * k][lane] = if on_surface { step } else { 0.0 };
                all[2 * k + 1][lane] = if on_surface { 1.0 } else { 0.0 };
            }
        }
        all
    }
}

/// Memory for the slopes of a row.
pub(crate) struct Slopes {
    sums: Sums<4>,
}

impl Slopes {
    pub(crate) fn new(stride: usize) -> Self {
        Self { sums: std::array::from_fn(|_| vec![0.0; stride]) }
    }

    /// Computes those of row `y`, in pixels per pixel: means of the steps in windows of 9 x 9 pixels.
    #[inline(always)]
    pub(crate) fn compute(&mut self, disparity: &Field, y: usize) {
        sum_windows(&Steps(disparity), y, disparity.height, &mut self.sums);
        let [along, steps_along, down, steps_down] = &mut self.sums;
        for (slope, &steps) in along.iter_mut().zip(&*steps_along) {
            *slope /= steps + PRIOR_STEPS;
        }
        for (slope, &steps) in down.iter_mut().zip(&*steps_down) {
            *slope /= steps + PRIOR_STEPS;
        }
    }

    /// Slopes along the row and down the column, of eight pixels from x on.
    #[inline(always)]
    pub(crate) fn at(&self, x: usize) -> [Floats; 2] {
        [&self.sums[0], &self.sums[2]].map(|slopes| floats(slopes, MARGIN + x - RADIUS))
    }
}
