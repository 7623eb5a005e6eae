//! How disparities change along rows and columns, on the surface that a pixel lies on, and how fast that changes.

use crate::{
    field::{Field, MARGIN},
    registers::{FLOATS, Floats, floats},
    window::{Quantities, RADIUS, Sums, sum_windows},
};

/// Disparities of neighbours that differ by more than this, in pixels, are of two surfaces.
const MOST_STEP: f32 = 1.0;
/// Steps that count as zero beside those of a window: a slope of few steps is uncertain.
const PRIOR_STEPS: f32 = 4.0;
/// Pixels to either side from where slopes are compared: nearer ones leave curvatures so uncertain that planes lose more than
/// balls gain.
const REACH: usize = 12;
/// Steps that the windows there must have: what edges of depth cut off is not curved.
const LEAST_STEPS: f32 = 40.0;
/// The most that a surface is believed to curve, in pixels of disparity per squared pixel.
const MOST_CURVATURE: f32 = 0.02;

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
    /// Of the rows above and below with which they are compared.
    beside: [Sums<4>; 2],
    /// Half of the second derivatives, along the row and down the column.
    bends: [Vec<f32>; 2],
}

impl Slopes {
    pub(crate) fn new(stride: usize) -> Self {
        let sums = || std::array::from_fn(|_| vec![0.0; stride]);
        Self { sums: sums(), beside: [sums(), sums()], bends: [(); 2].map(|()| vec![0.0; stride]) }
    }

    /// Computes those of row `y`, in pixels per pixel: means of the steps in windows of 9 x 9 pixels; curvatures from
    /// their differences at both sides.
    #[inline(always)]
    pub(crate) fn compute(&mut self, disparity: &Field, y: usize) {
        let (steps, height) = (Steps(disparity), disparity.height);
        sum_windows(&steps, y, height, &mut self.sums);
        let [along, steps_along, ..] = &self.sums;
        let both = along.len().saturating_sub(2 * REACH);
        for (at, bend) in self.bends[0].iter_mut().skip(REACH).take(both).enumerate() {
            let [before, after] = [at, at + 2 * REACH].map(|k| [along[k], steps_along[k]]);
            *bend = half_curvature(before, after);
        }
        // Windows that reach out of the picture are centred elsewhere.
        if y >= REACH + RADIUS && y + REACH + RADIUS < height {
            let [above, below] = &mut self.beside;
            sum_windows(&steps, y - REACH, height, above);
            sum_windows(&steps, y + REACH, height, below);
            for (at, bend) in self.bends[1].iter_mut().enumerate() {
                let [above, below] = [&above, &below].map(|sums| [sums[2][at], sums[3][at]]);
                *bend = half_curvature(above, below);
            }
        } else {
            self.bends[1].fill(0.0);
        }
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

    /// Half of the second derivatives along the row and down the column, of eight pixels from x on.
    #[inline(always)]
    pub(crate) fn bends_at(&self, x: usize) -> [Floats; 2] {
        self.bends.each_ref().map(|bends| floats(bends, MARGIN + x - RADIUS))
    }
}

/// Half of the second derivative between two windows, each the sum of steps and their number.
#[inline(always)]
fn half_curvature(before: [f32; 2], after: [f32; 2]) -> f32 {
    if before[1].min(after[1]) < LEAST_STEPS {
        return 0.0;
    }
    let change = (after[0] / after[1] - before[0] / before[1]) / (2 * REACH) as f32;
    0.5 * change.clamp(-MOST_CURVATURE, MOST_CURVATURE)
}
