//! Whether the right picture's match of a pixel's match is that pixel.
//!
//! It is not where the right picture does not see what the left one sees, and at most wrong matches (Hirschmüller 2008,
//! section 2.5).

use crate::{
    bands::Candidates, curves::EpipolarCurves, field::Field, search_range::SearchRange,
    winner::NO_MATCH,
};
use rayon::prelude::*;

/// Matches that come back farther away than this, in pixels, are taken away.
const MOST_RESIDUAL: f32 = 1.5;

/// Disparities that pass the check, NaN elsewhere; and by how much the match of every pixel's match lies beside it, in pixels.
pub(crate) fn check(candidates: &Candidates, width: usize, range: SearchRange) -> [Field; 2] {
    let size = (width, candidates.clarity.len() / width);
    let mut disparity = Field::new(candidates.disparity.pool(), size, f32::NAN);
    let mut residuals = disparity.like(f32::INFINITY);
    let rows = disparity.par_pixels_mut().zip(residuals.par_pixels_mut());
    rows.enumerate().for_each(|(y, (disparity, residuals))| {
        let row = candidates.row(y, width);
        for (x, &found) in row.disparity.iter().enumerate() {
            residuals[x] = residual(x, found, row.right, range);
            if residuals[x] <= MOST_RESIDUAL {
                disparity[x] = found;
            }
        }
    });
    [disparity, residuals]
}

/// Takes away disparities whose curves lead above or below the right picture.
pub(crate) fn forget_outside(disparity: &mut Field, curves: &EpipolarCurves) {
    let rows = -0.5..disparity.height as f32 - 0.5;
    let largest = curves.largest();
    disparity.par_pixels_mut().enumerate().for_each(|(y, disparity)| {
        if rows.contains(&(y as f32 - largest)) && rows.contains(&(y as f32 + largest)) {
            return;
        }
        let curve = curves.row(y as f32);
        for (x, disparity) in disparity.iter_mut().enumerate() {
            if !rows.contains(&(y as f32 + curve.at(x as f32, *disparity))) {
                *disparity = f32::NAN;
            }
        }
    });
}

/// By how much the match of a pixel's match lies beside it, in pixels.
fn residual(x: usize, disparity: f32, right: &[u16], range: SearchRange) -> f32 {
    if disparity.is_nan() {
        return f32::INFINITY;
    }
    // To the nearest: a winner's fraction is at most a half.
    let index = (disparity - range.first as f32 + 0.5) as i64;
    let there = x as i64 - i64::from(range.first) - index;
    match usize::try_from(there).ok().and_then(|there| right.get(there)) {
        Some(&index) if index != NO_MATCH => {
            (disparity - (range.first + i32::from(index)) as f32).abs()
        }
        _ => f32::INFINITY,
    }
}
