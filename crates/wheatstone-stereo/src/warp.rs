//! The right picture as the left camera would see it, were the disparities right.
//!
//! Values between pixels come from the cubic polynomial through four pixels whose slopes are central differences (Keys
//! 1981, doi:10.1109/TASSP.1981.1163711).

use crate::{field::Field, picture::Picture};
use rayon::prelude::*;

/// Grey levels are taken from here, so that sums of squares stay small.
const MIDDLE_GREY: f32 = 128.0;

/// The left picture and the right one moved onto it, in grey levels. Zero where there is no disparity.
pub(crate) struct Warped {
    pub(crate) left: Field,
    pub(crate) right: Field,
    /// The mean of both pictures' gradients along the row, in grey levels per pixel.
    pub(crate) gradient: Field,
}

impl Warped {
    pub(crate) fn new(disparity: &Field, left: &Picture<'_>, right: &Picture<'_>) -> Self {
        let field = || Field::new(left.width(), left.height(), 0.0);
        let mut warped = Self { left: field(), right: field(), gradient: field() };
        let rows = warped.left.par_pixels_mut().zip(warped.right.par_pixels_mut());
        let rows = rows.zip(warped.gradient.par_pixels_mut()).enumerate();
        rows.for_each(|(y, ((out_left, out_right), gradient))| {
            let (left, right) = (left.row(y), right.row(y));
            for (x, &d) in disparity.pixels(y).iter().enumerate() {
                if d.is_nan() {
                    continue;
                }
                let (value, slope) = between(right, x as f32 - d);
                out_left[x] = f32::from(left[x]) - MIDDLE_GREY;
                out_right[x] = value - MIDDLE_GREY;
                gradient[x] = 0.5 * (slope + central_difference(left, x));
            }
        });
        warped
    }
}

fn central_difference(row: &[u8], x: usize) -> f32 {
    0.5 * (f32::from(row[(x + 1).min(row.len() - 1)]) - f32::from(row[x.saturating_sub(1)]))
}

/// The value and the slope of a row between pixels.
fn between(row: &[u8], x: f32) -> (f32, f32) {
    let whole = x.floor();
    let t = x - whole;
    let from = whole as isize - 1;
    let inside = usize::try_from(from).ok().and_then(|from| row.get(from..from + 4));
    let last = row.len() as isize - 1;
    let [a, b, c, d] = match inside {
        Some(&[a, b, c, d]) => [a, b, c, d],
        // Beyond its ends a row repeats them.
        _ => std::array::from_fn(|k| row[(from + k as isize).clamp(0, last) as usize]),
    }
    .map(f32::from);
    let first = 0.5 * (c - a);
    let second = a - 2.5 * b + 2.0 * c - 0.5 * d;
    let third = 0.5 * (d - a) + 1.5 * (b - c);
    (b + t * (first + t * (second + t * third)), first + t * (2.0 * second + 3.0 * t * third))
}
