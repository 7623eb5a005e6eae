//! Sums over windows of 9 x 9 pixels.

use crate::registers::{FLOATS, Floats, floats, lanes, plus};

/// Pixels from the centre of a window to its side.
pub(crate) const RADIUS: usize = 4;
/// Pixels of a window's side.
pub(crate) const SIDE: usize = 2 * RADIUS + 1;

/// Quantities of pixels that sums are made of.
pub(crate) trait Quantities<const N: usize> {
    /// Those of eight pixels of a row, from a column on (of a [`Field`](crate::field::Field), with its margin).
    fn at(&self, y: usize, column: usize) -> [Floats; N];
}

/// Memory for the sums of a row.
pub(crate) type Sums<const N: usize> = [Vec<f32>; N];

/// Sums over the windows around the pixels of row `y`. Those of the window whose first column is k stand at k.
#[inline(always)]
pub(crate) fn sum_windows<const N: usize>(
    quantities: &impl Quantities<N>,
    y: usize,
    height: usize,
    sums: &mut Sums<N>,
) {
    let stride = sums[0].len();
    let rows = y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height);
    for column in (0..stride).step_by(FLOATS) {
        let mut down = [[0.0; FLOATS]; N];
        for row in rows.clone() {
            let values = quantities.at(row, column);
            for (down, values) in down.iter_mut().zip(values) {
                *down = lanes(*down, values, plus);
            }
        }
        for (sums, down) in sums.iter_mut().zip(&down) {
            sums[column..column + FLOATS].copy_from_slice(down);
        }
    }
    for sums in sums {
        for column in (0..stride - 2 * FLOATS + 1).step_by(FLOATS) {
            let mut across = floats(sums, column);
            for next in 1..SIDE {
                across = lanes(across, floats(sums, column + next), plus);
            }
            sums[column..column + FLOATS].copy_from_slice(&across);
        }
    }
}
