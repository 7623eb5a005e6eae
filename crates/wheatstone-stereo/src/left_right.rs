//! Whether the right picture's match of a pixel's match is that pixel.
//!
//! It is not where the right picture does not see what the left one sees, and at most wrong matches (Hirschmüller 2008,
//! section 2.5).

use crate::{bands::Candidates, field::Field, search_range::SearchRange, winner::NO_MATCH};
use rayon::prelude::*;

/// Matches that come back farther away than this, in pixels, are taken away.
const MOST_RESIDUAL: f32 = 1.5;

/// Disparities that pass the check (NaN elsewhere), and by how much they come back beside, in pixels.
pub(crate) fn check(
    candidates: &Candidates,
    width: usize,
    range: SearchRange,
) -> (Field, Vec<f32>) {
    let height = candidates.gap.len() / width;
    let mut disparity = Field::new(width, height, f32::NAN);
    let mut residuals = vec![f32::NAN; width * height];
    let rows = disparity.par_pixels_mut().zip(residuals.par_chunks_mut(width));
    let found = candidates.disparity.par_chunks(width).zip(candidates.right.par_chunks(width));
    rows.zip(found).for_each(|((disparity, residuals), (found, right))| {
        for (x, &d) in found.iter().enumerate() {
            residuals[x] = residual(x, d, right, range);
            if residuals[x] <= MOST_RESIDUAL {
                disparity[x] = d;
            }
        }
    });
    (disparity, residuals)
}

fn residual(x: usize, disparity: f32, right: &[u16], range: SearchRange) -> f32 {
    if disparity.is_nan() {
        return f32::INFINITY;
    }
    let there = x as i64 - disparity.round() as i64;
    match usize::try_from(there).ok().and_then(|there| right.get(there)) {
        Some(&index) if index != NO_MATCH => {
            (disparity - (range.first + i32::from(index)) as f32).abs()
        }
        _ => f32::INFINITY,
    }
}
