//! How well the pictures agree where disparities put them on each other.
//!
//! Pictures of two cameras differ in brightness and contrast. Both are compared within windows of 9 x 9 pixels, over those that have a
//! disparity.

use crate::{
    field::{Field, MARGIN},
    registers::{FLOATS, Floats, floats},
    warp::Warped,
    window::{Quantities, RADIUS, SIDE, Sums, sum_windows},
};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Variance that is no texture, in squared grey levels: rounding and the noise of a good camera.
const NOISE: f32 = 2.0;
/// The most that one picture's contrast is believed to be above the other's.
const MOST_GAIN: f32 = 1.4;

/// What windows say of their central pixels.
pub(crate) struct Agreement {
    /// The left picture less the right one, in grey levels, after local brightness and contrast. Zero where there is no disparity.
    pub(crate) residual: Field,
    /// The correlation of both pictures, -1 to 1.
    pub(crate) correlation: Vec<f32>,
    /// The root mean square of gradients along the row, in grey levels per pixel.
    pub(crate) texture: Vec<f32>,
    /// The share of pixels that have a disparity.
    pub(crate) known: Vec<f32>,
}

impl Agreement {
    pub(crate) fn new(disparity: &Field, warped: &Warped) -> Self {
        let (width, height) = (disparity.width, disparity.height);
        let map = || vec![0.0; width * height];
        let mut residual = Field::new(width, height, 0.0);
        let (mut correlation, mut texture, mut known) = (map(), map(), map());
        let maps = correlation.par_chunks_mut(width).zip(texture.par_chunks_mut(width));
        let maps = maps.zip(known.par_chunks_mut(width));
        residual.par_pixels_mut().zip(maps).enumerate().for_each_init(
            || std::array::from_fn(|_| vec![0.0; disparity.stride]),
            |sums, (y, (residual, ((correlation, texture), known)))| {
                let out = Out { residual, correlation, texture, known };
                Arch::new().dispatch(Row { pixels: Pixels { disparity, warped }, y, sums, out });
            },
        );
        Self { residual, correlation, texture, known }
    }
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
        let mut all = [[0.0; FLOATS]; 7];
        for lane in 0..FLOATS {
            let (l, r, g) = (left[lane], right[lane], gradient[lane]);
            all[0][lane] = if disparity[lane].is_nan() { 0.0 } else { 1.0 };
            all[1][lane] = l;
            all[2][lane] = r;
            all[3][lane] = l * l;
            all[4][lane] = r * r;
            all[5][lane] = l * r;
            all[6][lane] = g * g;
        }
        all
    }
}

struct Out<'a> {
    residual: &'a mut [f32],
    correlation: &'a mut [f32],
    texture: &'a mut [f32],
    known: &'a mut [f32],
}

/// The work of one row.
struct Row<'a> {
    pixels: Pixels<'a>,
    y: usize,
    sums: &'a mut Sums<7>,
    out: Out<'a>,
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { pixels, y, sums, out } = self;
        let height = pixels.disparity.height;
        sum_windows(&pixels, y, height, sums);
        let disparity = pixels.disparity.pixels(y);
        let (left, right) = (pixels.warped.left.pixels(y), pixels.warped.right.pixels(y));
        let windows = MARGIN - RADIUS;
        let [count, sum_left, sum_right, left_left, right_right, left_right, gradients] =
            sums.each_ref().map(|sums| &sums[windows..windows + disparity.len()]);
        for x in 0..disparity.len() {
            let inverse = 1.0 / count[x].max(1.0);
            let (mean_left, mean_right) = (sum_left[x] * inverse, sum_right[x] * inverse);
            let variance_left = (left_left[x] * inverse - mean_left * mean_left).max(0.0) + NOISE;
            let variance_right =
                (right_right[x] * inverse - mean_right * mean_right).max(0.0) + NOISE;
            let covariance = left_right[x] * inverse - mean_left * mean_right;
            let gain = (variance_left / variance_right).sqrt().clamp(1.0 / MOST_GAIN, MOST_GAIN);
            let is_known = !disparity[x].is_nan();
            let residual = left[x] - mean_left - gain * (right[x] - mean_right);
            out.residual[x] = if is_known { residual } else { 0.0 };
            out.correlation[x] = covariance / (variance_left * variance_right).sqrt();
            out.texture[x] = (gradients[x] * inverse).sqrt();
            out.known[x] = count[x] / (SIDE * SIDE) as f32;
        }
    }
}
