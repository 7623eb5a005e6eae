//! What speaks for a disparity, in numbers.

use crate::{
    agreement::Agreement,
    field::{Field, MARGIN},
    registers::{FLOATS, Floats, floats},
};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// Pixels from the centre to the side of the window in which neighbours are compared.
const RADIUS: usize = 2;
/// Differences from neighbours beyond this, in pixels, say no more; a neighbour without disparity differs by as much.
const MOST_SCATTER: f32 = 2.0;

/// What the confidence of every pixel of the left picture is computed from, row by row. NaN where there is no disparity.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Evidence {
    /// By how much the second best disparity costs more, in units of the aggregated cost.
    pub gap: Vec<f32>,
    /// How far from the pixel the right picture's match of its match lies, in pixels.
    pub left_right: Vec<f32>,
    /// The mean difference from the disparities of 5 x 5 pixels, each cut at 2, in pixels.
    pub scatter: Vec<f32>,
    /// The share of 9 x 9 pixels that have a disparity.
    pub known: Vec<f32>,
    /// The correlation of both pictures over 9 x 9 pixels, -1 to 1.
    pub correlation: Vec<f32>,
    /// The root mean square of the gradient along the row over 9 x 9 pixels, in grey levels per pixel.
    pub texture: Vec<f32>,
}

impl Evidence {
    pub(crate) fn new(
        disparity: &Field,
        gap: &[u16],
        left_right: Vec<f32>,
        agreement: &Agreement,
    ) -> Self {
        let mut scatter = vec![0.0; gap.len()];
        scatter.par_chunks_mut(disparity.width).enumerate().for_each(|(y, out)| {
            Arch::new().dispatch(ScatterRow { disparity, y, out });
        });
        let gap = gap.iter().map(|&gap| f32::from(gap)).collect();
        let [known, correlation, texture] =
            [&agreement.known, &agreement.correlation, &agreement.texture].map(Vec::clone);
        let mut evidence = Self { gap, left_right, scatter, known, correlation, texture };
        evidence.forget_where_none(disparity);
        evidence
    }

    fn forget_where_none(&mut self, disparity: &Field) {
        let Self { gap, left_right, scatter, known, correlation, texture } = self;
        let width = disparity.width;
        for map in [gap, left_right, scatter, known, correlation, texture] {
            map.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                for (value, disparity) in row.iter_mut().zip(disparity.pixels(y)) {
                    if disparity.is_nan() {
                        *value = f32::NAN;
                    }
                }
            });
        }
    }
}

struct ScatterRow<'a> {
    disparity: &'a Field,
    y: usize,
    out: &'a mut [f32],
}

impl WithSimd for ScatterRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        const NEIGHBOURS: usize = (2 * RADIUS + 1) * (2 * RADIUS + 1) - 1;
        let Self { disparity, y, out } = self;
        let last = disparity.height as isize - 1;
        for (piece, out) in out.chunks_mut(FLOATS).enumerate() {
            let at = MARGIN + piece * FLOATS;
            let centre = floats(disparity.row(y), at);
            let mut sum: Floats = [0.0; FLOATS];
            for down in -(RADIUS as isize)..=RADIUS as isize {
                let row = disparity.row((y as isize + down).clamp(0, last) as usize);
                for column in at - RADIUS..=at + RADIUS {
                    let values = floats(row, column);
                    for lane in 0..FLOATS {
                        let difference = (values[lane] - centre[lane]).abs();
                        // No comparison with NaN holds.
                        let is_near = difference < MOST_SCATTER;
                        sum[lane] += if is_near { difference } else { MOST_SCATTER };
                    }
                }
            }
            for (out, sum) in out.iter_mut().zip(sum) {
                *out = sum / NEIGHBOURS as f32;
            }
        }
    }
}
