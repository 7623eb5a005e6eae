//! The right picture as the left camera would see it, were the disparities right.
//!
//! Values between pixels come from the cubic polynomial through four pixels whose slopes are central differences (Keys
//! 1981, doi:10.1109/TASSP.1981.1163711).

use crate::{field::Field, picture::Picture};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Grey levels are taken from here, so that sums of squares stay small.
const MIDDLE_GREY: f32 = 128.0;

/// The left picture and the right one moved onto it, in grey levels.
pub(crate) struct Warped {
    pub(crate) left: Field,
    /// The left picture's gradient along the row, in grey levels per pixel.
    ///
    /// The right picture's is not used: moved between pixels, it depends on the same noise as the moved picture, which would draw
    /// disparities to whole pixels.
    pub(crate) gradient: Field,
    /// Zero where there is no disparity.
    pub(crate) right: Field,
}

impl Warped {
    pub(crate) fn new(disparity: &Field, left: &Picture<'_>, right: &Picture<'_>) -> Self {
        let field = || Field::new(left.width(), left.height(), 0.0);
        let mut warped = Self { left: field(), gradient: field(), right: field() };
        let rows = warped.left.par_pixels_mut().zip(warped.gradient.par_pixels_mut());
        rows.enumerate().for_each(|(y, (out, gradient))| {
            let row = left.row(y);
            for ((out, gradient), x) in out.iter_mut().zip(gradient).zip(0..) {
                let (before, after) = (x.max(1) - 1, (x + 1).min(row.len() - 1));
                *out = f32::from(row[x]) - MIDDLE_GREY;
                *gradient = 0.5 * (f32::from(row[after]) - f32::from(row[before]));
            }
        });
        warped.move_right(disparity, right);
        warped
    }

    /// Moves the right picture by other disparities.
    pub(crate) fn move_right(&mut self, disparity: &Field, right: &Picture<'_>) {
        self.right.par_pixels_mut().enumerate().for_each(|(y, out)| {
            on_widest(Row { disparity: disparity.pixels(y), right: right.row(y), out });
        });
    }
}

/// The work of one row.
struct Row<'a> {
    disparity: &'a [f32],
    right: &'a [u8],
    out: &'a mut [f32],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (x, (out, &d)) in self.out.iter_mut().zip(self.disparity).enumerate() {
            let is_known = !d.is_nan();
            *out = if is_known { between(self.right, x as f32 - d) - MIDDLE_GREY } else { 0.0 };
        }
    }
}

/// The value of a row between pixels.
#[inline(always)]
fn between(row: &[u8], x: f32) -> f32 {
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
    b + t * (first + t * (second + t * third))
}

#[cfg(test)]
mod tests {
    use super::between;

    #[test]
    fn straight_lines_and_parabolas_come_back() {
        let row: Vec<u8> = (0..12).map(|x| 3 * x * x / 2 + 5).map(|v| v as u8).collect();
        let line: Vec<u8> = (0..12).map(|x| 7 * x + 2).collect();
        assert!((between(&line, 4.3) - 32.1).abs() < 1e-4);
        assert!((between(&row, 6.0) - 59.0).abs() < 1e-4);
        assert!((between(&line, -3.5) - 2.0).abs() < 1e-4);
    }
}
