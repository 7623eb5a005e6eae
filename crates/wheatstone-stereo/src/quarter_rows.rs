//! Codes of a picture and of what lies between its rows, in quarters of a pixel.
//!
//! Finer steps find no more matches, and whole rows up to 2 % fewer.

use crate::{buffers::Pool, census::Codes, cubic::cubic, curves::EpipolarCurves, picture::Picture};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Rows of codes that one row of pixels has.
const QUARTERS: usize = 4;

/// Codes of a picture and of what lies between its rows, and the curves that lead through them.
pub(crate) struct QuarterRows<'a> {
    pub(crate) curves: &'a EpipolarCurves,
    width: usize,
    height: usize,
    /// The four bytes of every pixel, [quarter][y][x], of the picture moved up by quarters of a pixel.
    pub(crate) codes: Vec<[u8; 4]>,
}

impl<'a> QuarterRows<'a> {
    pub(crate) fn new(picture: &Picture<'_>, curves: &'a EpipolarCurves, pool: &Pool<u8>) -> Self {
        let (width, height) = (picture.width(), picture.height());
        let mut codes = vec![[0; 4]; QUARTERS * width * height];
        for (quarter, codes) in codes.chunks_exact_mut(width * height).enumerate() {
            let moved = moved_up(picture, quarter as f32 / QUARTERS as f32);
            let planes = Codes::new(&picture.with(&moved), pool);
            codes.par_chunks_mut(width).enumerate().for_each(|(y, codes)| {
                let row = planes.row(y, width);
                for (x, code) in codes.iter_mut().enumerate() {
                    *code = row.map(|plane| plane[x]);
                }
            });
        }
        Self { curves, width, height, codes }
    }

    /// Where the row begins that is nearest to a place. Beyond its ends the picture repeats its outermost rows.
    #[inline(always)]
    pub(crate) fn nearest(&self, y: f32) -> usize {
        let quarters = y.clamp(0.0, (self.height - 1) as f32) * QUARTERS as f32 + 0.5;
        let (row, quarter) = (quarters as usize / QUARTERS, quarters as usize % QUARTERS);
        (quarter * self.height + row) * self.width
    }
}

/// A picture moved up by a part of a pixel.
fn moved_up(picture: &Picture<'_>, part: f32) -> Vec<u8> {
    let last = picture.height() - 1;
    let mut moved = vec![0; picture.pixels().len()];
    moved.par_chunks_mut(picture.width()).enumerate().for_each(|(y, out)| {
        let rows = [y.saturating_sub(1), y, y + 1, y + 2].map(|y| picture.row(y.min(last)));
        on_widest(Between { rows, part, out });
    });
    moved
}

/// What lies between the second and the third of four rows.
struct Between<'a> {
    rows: [&'a [u8]; 4],
    part: f32,
    out: &'a mut [u8],
}

impl WithSimd for Between<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let rows = self.rows.map(|row| &row[..self.out.len()]);
        for (x, out) in self.out.iter_mut().enumerate() {
            let value = cubic(rows.map(|row| f32::from(row[x])), self.part);
            *out = (value.clamp(0.0, 255.0) + 0.5) as i32 as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_in_quarters() {
        let (width, height) = (7, 20);
        let pixels = vec![0; width * height];
        let picture = Picture::new(width, height, &pixels).unwrap();
        let curves = EpipolarCurves::new((width, height), 0..4, |_, _, _| None).unwrap();
        let quarters = QuarterRows::new(&picture, &curves, &Pool::default());
        let row = |quarter: usize, y: usize| (quarter * height + y) * width;
        for (y, expected) in
            [(3.0, row(0, 3)), (3.3, row(1, 3)), (3.9, row(0, 4)), (18.6, row(2, 18))]
        {
            assert_eq!(quarters.nearest(y), expected, "{y}");
        }
        assert_eq!(quarters.nearest(-0.4), row(0, 0));
        assert_eq!(quarters.nearest(-1e30), row(0, 0));
        assert_eq!(quarters.nearest(f32::MAX), row(0, height - 1));
    }
}
