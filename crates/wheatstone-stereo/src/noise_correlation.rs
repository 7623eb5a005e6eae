//! How much the noise of neighbouring pixels has in common.
//!
//! Pictures that were resampled, as by a rectification, share noise between neighbours: it is smaller than that of the camera, and
//! averages out more slowly. Least squares take it for independent.

use crate::field::Field;
use rayon::prelude::*;

/// Less confident pixels may show two things.
const SURE: f32 = 0.9;
/// Rows from one that is looked at to the next.
const STEP: usize = 3;
/// The most that two neighbours are believed to share.
const MOST: f64 = 0.5;

/// By how much means over windows scatter more than those of independent noise would: the root of the sum of correlations,
/// where neighbours along rows and columns share noise, and pixels farther apart do not.
///
/// From residuals' differences between neighbours, against those two pixels apart: what changes slowly is in neither.
pub(crate) fn excess(residual: &Field, confidence: &[f32]) -> f32 {
    let (width, height) = (residual.width, residual.height);
    let is_sure = |x: usize, y: usize| confidence[y * width + x] > SURE;
    let of_row = |y: usize| -> [[f64; 2]; 2] {
        let [above, row, below] = [y - 1, y, y + 1].map(|y| residual.pixels(y));
        let mut sums = [[0.0; 2]; 2];
        let mut add = |axis: usize, [before, own, after]: [f32; 3]| {
            sums[axis][0] += f64::from((own - before).abs() + (after - own).abs());
            sums[axis][1] += f64::from(2.0 * (after - before).abs());
        };
        for x in (1..width.saturating_sub(1)).filter(|x| is_sure(*x, y)) {
            if is_sure(x - 1, y) && is_sure(x + 1, y) {
                add(0, [row[x - 1], row[x], row[x + 1]]);
            }
            if is_sure(x, y - 1) && is_sure(x, y + 1) {
                add(1, [above[x], row[x], below[x]]);
            }
        }
        sums
    };
    let rows: Vec<usize> = (1..height.saturating_sub(1)).step_by(STEP).collect();
    let sums: Vec<[[f64; 2]; 2]> = rows.into_par_iter().map(of_row).collect();
    let factor = [0, 1].map(|axis| {
        let [near, far] = [0, 1].map(|which| sums.iter().map(|row| row[axis][which]).sum::<f64>());
        // The variance of a difference is twice that of the noise, less twice what both share.
        let shared = if far > 0.0 { 1.0 - (near / far).powi(2) } else { 0.0 };
        1.0 + 2.0 * shared.clamp(0.0, MOST)
    });
    (factor[0] * factor[1]).sqrt() as f32
}
