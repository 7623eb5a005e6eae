//! The right picture as the left camera would see it, were the disparities right.

use crate::{
    cubic::{along, around},
    curves::CurveRow,
    field::Field,
    pair::Pair,
    picture::Picture,
};
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
    pub(crate) fn new(disparity: &Field, pair: &Pair<'_>) -> Self {
        let [left, gradient, right] = [(); 3].map(|()| disparity.like(0.0));
        let mut warped = Self { left, gradient, right };
        let rows = warped.left.par_pixels_mut().zip(warped.gradient.par_pixels_mut());
        rows.enumerate().for_each(|(y, (out, gradient))| {
            let row = pair.left.row(y);
            for ((out, gradient), x) in out.iter_mut().zip(gradient).zip(0..) {
                let (before, after) = (x.max(1) - 1, (x + 1).min(row.len() - 1));
                *out = f32::from(row[x]) - MIDDLE_GREY;
                *gradient = 0.5 * (f32::from(row[after]) - f32::from(row[before]));
            }
        });
        warped.move_right(disparity, pair);
        warped
    }

    /// Moves the right picture by other disparities.
    pub(crate) fn move_right(&mut self, disparity: &Field, pair: &Pair<'_>) {
        self.right.par_pixels_mut().enumerate().for_each(|(y, out)| {
            let curve = pair.curves.map(|curves| curves.row(y as f32));
            on_widest(Row { disparity: disparity.pixels(y), right: pair.right, y, curve, out });
        });
    }
}

/// The work of one row.
struct Row<'a> {
    disparity: &'a [f32],
    right: &'a Picture<'a>,
    y: usize,
    curve: Option<CurveRow>,
    out: &'a mut [f32],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { disparity, right, y, curve, out } = self;
        if let Some(curve) = curve {
            move_each(disparity, out, |x, d| around(right, x - d, y as f32 + curve.at(x, d)));
        } else {
            let row = right.row(y);
            move_each(disparity, out, |x, d| along(row, x - d));
        }
    }
}

/// The right picture's value for every pixel and its disparity.
#[inline(always)]
fn move_each(disparity: &[f32], out: &mut [f32], value: impl Fn(f32, f32) -> f32) {
    for (x, (out, &d)) in out.iter_mut().zip(disparity).enumerate() {
        let is_known = !d.is_nan();
        *out = if is_known { value(x as f32, d) - MIDDLE_GREY } else { 0.0 };
    }
}
