//! The median of a pixel and its four neighbours.

use crate::{
    field::{Field, MARGIN},
    registers::{FLOATS, Floats, floats, lanes},
};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Every disparity becomes the median of five; a neighbour without one counts as the pixel itself.
pub(crate) fn of_five(disparity: &Field) -> Field {
    let last = disparity.height - 1;
    let mut out = disparity.like(f32::NAN);
    out.par_pixels_mut().enumerate().for_each(|(y, out)| {
        let rows = [y.saturating_sub(1), y, (y + 1).min(last)].map(|y| disparity.row(y));
        on_widest(Row { rows, out });
    });
    out
}

/// The work of one row: three rows with margins, and the medians of the middle one.
struct Row<'a> {
    rows: [&'a [f32]; 3],
    out: &'a mut [f32],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [above, same, below] = self.rows;
        for (pixels, out) in self.out.chunks_mut(FLOATS).enumerate() {
            let at = MARGIN + pixels * FLOATS;
            let centre = floats(same, at);
            let neighbours =
                [floats(above, at), floats(below, at), floats(same, at - 1), floats(same, at + 1)]
                    .map(|values| lanes(values, centre, or_other));
            let medians: Floats = std::array::from_fn(|lane| {
                median(centre[lane], neighbours.map(|values| values[lane]))
            });
            out.copy_from_slice(&medians[..out.len()]);
        }
    }
}

#[inline(always)]
fn or_other(value: f32, other: f32) -> f32 {
    if value.is_nan() { other } else { value }
}

/// The median of five, by comparisons in pairs.
#[inline(always)]
fn median(centre: f32, [a, b, c, d]: [f32; 4]) -> f32 {
    // The median lies between the greater of two minima and the smaller of two maxima.
    let (one, other) =
        (greater(smaller(a, b), smaller(c, d)), smaller(greater(a, b), greater(c, d)));
    let (low, high) = (smaller(one, other), greater(one, other));
    if centre.is_nan() { centre } else { smaller(greater(centre, low), high) }
}

/// As registers have it, which do not care for NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn is_the_median() {
        for code in 0..5usize.pow(5) {
            let values: [f32; 5] =
                std::array::from_fn(|k| (code / 5usize.pow(k as u32) % 5) as f32);
            let mut sorted = values;
            sorted.sort_by(f32::total_cmp);
            let [centre, others @ ..] = values;
            assert_eq!(median(centre, others), sorted[2], "{values:?}");
        }
    }
}
