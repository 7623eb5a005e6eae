//! How well the pictures agree where disparities put them on each other.
//!
//! Pictures of two cameras differ in brightness and contrast. Both are compared within windows of 9 x 9 pixels, over those that have a
//! disparity.

use crate::{
    field::{Field, MARGIN},
    registers::{Floats, each, floats, lanes, times},
    warp::Warped,
    window::{Quantities, RADIUS, SIDE, Sums, sum_windows},
};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Variance that is no texture, in squared grey levels: rounding and the noise of a good camera.
const NOISE: f32 = 2.0;
/// The most that one picture's contrast is believed to be above the other's.
const MOST_GAIN: f32 = 1.4;

/// What windows say of the central pixels of a row.
pub(crate) struct AgreementRow<'a> {
    /// The left picture less the right one, in grey levels, after local brightness and contrast. Zero where there is
    /// no disparity.
    pub(crate) residual: &'a mut [f32],
    /// The correlation of both pictures, -1 to 1.
    pub(crate) correlation: &'a mut [f32],
    /// The root mean square of gradients along the row, in grey levels per pixel.
    pub(crate) texture: &'a mut [f32],
    /// The share of pixels that have a disparity.
    pub(crate) known: &'a mut [f32],
}

/// Compares both pictures, row by row.
pub(crate) struct Agreement<'a> {
    disparity: &'a Field,
    warped: &'a Warped,
    sums: Sums<7>,
}

impl<'a> Agreement<'a> {
    pub(crate) fn new(disparity: &'a Field, warped: &'a Warped) -> Self {
        let sums = std::array::from_fn(|_| vec![0.0; disparity.stride]);
        Self { disparity, warped, sums }
    }

    /// Of row `y`, into `out`, which is handed back.
    pub(crate) fn compute<'o>(&mut self, y: usize, mut out: AgreementRow<'o>) -> AgreementRow<'o> {
        let pixels = Pixels { disparity: self.disparity, warped: self.warped };
        on_widest(Row { pixels, y, sums: &mut self.sums, out: &mut out });
        out
    }
}

/// The residuals of all rows.
pub(crate) fn residuals(disparity: &Field, warped: &Warped) -> Field {
    let width = disparity.width;
    let mut residual = disparity.like(0.0);
    residual.par_pixels_mut().enumerate().for_each_init(
        || (Agreement::new(disparity, warped), [(); 3].map(|()| vec![0.0; width])),
        |(agreement, [correlation, texture, known]), (y, residual)| {
            agreement.compute(y, AgreementRow { residual, correlation, texture, known });
        },
    );
    residual
}

struct Pixels<'a> {
    disparity: &'a Field,
    warped: &'a Warped,
}

/// The number of pixels with a disparity; of those, left, right, their squares and product; and squared gradients.
impl Quantities<7> for Pixels<'_> {
    #[inline(always)]
    fn at(&self, y: usize, column: usize) -> [Floats; 7] {
        let disparity = floats(self.disparity.row(y), column);
        let left = floats(self.warped.left.row(y), column);
        let right = floats(self.warped.right.row(y), column);
        let gradient = floats(self.warped.gradient.row(y), column);
        let known = each(disparity, |disparity| if disparity.is_nan() { 0.0 } else { 1.0 });
        let (left, gradient) = (lanes(known, left, times), lanes(known, gradient, times));
        [
            known,
            left,
            right,
            lanes(left, left, times),
            lanes(right, right, times),
            lanes(left, right, times),
            lanes(gradient, gradient, times),
        ]
    }
}

/// The work of one row.
struct Row<'a, 'b> {
    pixels: Pixels<'a>,
    y: usize,
    sums: &'a mut Sums<7>,
    out: &'a mut AgreementRow<'b>,
}

impl WithSimd for Row<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { pixels, y, sums, out } = self;
        let height = pixels.disparity.height;
        sum_windows(&pixels, y, height, sums);
        let disparity = pixels.disparity.pixels(y);
        // All of one length, so that nothing stands between the loop and registers.
        let width = disparity.len();
        let [left, right] =
            [&pixels.warped.left, &pixels.warped.right].map(|field| &field.pixels(y)[..width]);
        let AgreementRow { residual, correlation, texture, known } = out;
        let [residuals, correlations, textures, shares] =
            [residual, correlation, texture, known].map(|row| &mut row[..width]);
        let windows = MARGIN - RADIUS;
        let [count, sum_left, sum_right, left_left, right_right, left_right, gradients] =
            sums.each_ref().map(|sums| &sums[windows..][..width]);
        for x in 0..width {
            let inverse = 1.0 / count[x].max(1.0);
            let (mean_left, mean_right) = (sum_left[x] * inverse, sum_right[x] * inverse);
            let variance_left = (left_left[x] * inverse - mean_left * mean_left).max(0.0) + NOISE;
            let variance_right =
                (right_right[x] * inverse - mean_right * mean_right).max(0.0) + NOISE;
            let covariance = left_right[x] * inverse - mean_left * mean_right;
            let gain = (variance_left / variance_right).sqrt().clamp(1.0 / MOST_GAIN, MOST_GAIN);
            let is_known = !disparity[x].is_nan();
            let residual = left[x] - mean_left - gain * (right[x] - mean_right);
            residuals[x] = if is_known { residual } else { 0.0 };
            correlations[x] = covariance / (variance_left * variance_right).sqrt();
            textures[x] = (gradients[x] * inverse).sqrt();
            shares[x] = count[x] / (SIDE * SIDE) as f32;
        }
    }
}
