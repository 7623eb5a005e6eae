//! The median of a pixel and its four neighbours.

use crate::field::{Field, MARGIN};
use rayon::prelude::*;

/// Every disparity becomes the median of five; a neighbour without one counts as the pixel itself.
pub(crate) fn of_five(disparity: &Field) -> Field {
    let last = disparity.height - 1;
    let mut out = Field::new(disparity.width, disparity.height, f32::NAN);
    out.par_pixels_mut().enumerate().for_each(|(y, out)| {
        let (above, below) =
            (disparity.pixels(y.saturating_sub(1)), disparity.pixels((y + 1).min(last)));
        let row = disparity.row(y);
        let (left, right) = (&row[MARGIN - 1..], &row[MARGIN + 1..]);
        for (x, (out, &here)) in out.iter_mut().zip(disparity.pixels(y)).enumerate() {
            let or_here = |value: f32| if value.is_nan() { here } else { value };
            *out = median(here, [above[x], below[x], left[x], right[x]].map(or_here));
        }
    });
    out
}

/// The median of five, by comparisons in pairs.
fn median(centre: f32, [a, b, c, d]: [f32; 4]) -> f32 {
    // Neither the least nor the greatest of four is the median.
    let low = a.min(b).max(c.min(d));
    let high = a.max(b).min(c.max(d));
    let (low, high) = (low.min(high), low.max(high));
    if centre.is_nan() { centre } else { centre.max(low).min(high) }
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
