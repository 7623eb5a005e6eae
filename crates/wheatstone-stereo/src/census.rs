//! Pictures as codes that do not change with brightness.
//!
//! The census transform (Zabih and Woodfill 1994, doi:10.1007/BFb0028345) says of a pixel which of its
//! neighbours are brighter. Here the neighbours are every second pixel of a window of 9 x 9, 24 of them, and the
//! centre is smoothed, which makes it less noisy than what it is compared with. Census says little where one
//! gradient fills the window: a fourth byte is the gradient along the row.

use crate::{
    buffers::{Buffer, Pool},
    picture::Picture,
};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Half of the census window, in pixels.
const RADIUS: usize = 4;
/// The neighbours' distance from each other, in pixels.
const SPACING: usize = 2;
/// Gradients (Sobel's, in grey levels) beyond this are cut. Zero stands at this value.
const MOST_GRADIENT: i16 = 127;

/// Four bytes of every pixel, each in a plane of its own, row by row.
pub(crate) struct Codes {
    /// The census: one bit a neighbour, set where the neighbour is brighter.
    census: [Buffer<u8>; 3],
    /// The gradient along the row.
    gradient: Buffer<u8>,
}

impl Codes {
    pub(crate) fn new(picture: &Picture<'_>, pool: &Pool<u8>) -> Self {
        let (width, height) = (picture.width(), picture.height());
        let plane = || pool.filled(width * height, 0);
        let mut codes = Self { census: [plane(), plane(), plane()], gradient: plane() };
        let bordered = Bordered::new(picture);
        let [first, second, third] = &mut codes.census;
        let census = first.par_chunks_mut(width).zip(second.par_chunks_mut(width));
        let census = census.zip(third.par_chunks_mut(width));
        census.zip(codes.gradient.par_chunks_mut(width)).enumerate().for_each_init(
            || vec![0; width + 2],
            |columns, (y, (((first, second), third), gradient))| {
                let census = [first, second, third];
                on_widest(Row { bordered: &bordered, y, columns, census, gradient });
            },
        );
        codes
    }

    /// Those of one row.
    pub(crate) fn row(&self, y: usize, width: usize) -> [&[u8]; 4] {
        let [first, second, third] = &self.census;
        [first, second, third, &self.gradient].map(|plane| &plane[y * width..][..width])
    }
}

/// A picture with a border that repeats its outermost pixels.
struct Bordered {
    stride: usize,
    pixels: Vec<u8>,
}

impl Bordered {
    fn new(picture: &Picture<'_>) -> Self {
        let (width, height) = (picture.width(), picture.height());
        let stride = width + 2 * RADIUS;
        let mut pixels = Vec::with_capacity(stride * (height + 2 * RADIUS));
        for y in 0..height + 2 * RADIUS {
            let row = picture.row(y.saturating_sub(RADIUS).min(height - 1));
            pixels.extend([row[0]; RADIUS]);
            pixels.extend_from_slice(row);
            pixels.extend([row[width - 1]; RADIUS]);
        }
        Self { stride, pixels }
    }

    /// Pixels (0, y), (1, y), ... of the picture, moved by (right - RADIUS, down - RADIUS).
    #[inline(always)]
    fn moved(&self, y: usize, right: usize, down: usize, length: usize) -> &[u8] {
        &self.pixels[(y + down) * self.stride + right..][..length]
    }
}

/// The work of one row.
struct Row<'a> {
    bordered: &'a Bordered,
    y: usize,
    /// 1 2 1 down the columns, from one pixel left of the row to one right of it.
    columns: &'a mut [u16],
    census: [&'a mut [u8]; 3],
    gradient: &'a mut [u8],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        let width = self.gradient.len();
        let rows = [RADIUS - 1, RADIUS, RADIUS + 1];
        let [above, same, below] =
            rows.map(|down| self.bordered.moved(self.y, RADIUS - 1, down, width + 2));
        for (x, sum) in self.columns.iter_mut().enumerate() {
            *sum = u16::from(above[x]) + 2 * u16::from(same[x]) + u16::from(below[x]);
        }
        self.gradient();
        self.census();
    }
}

impl Row<'_> {
    #[inline(always)]
    fn gradient(&mut self) {
        let (left, right) = (&self.columns[..], &self.columns[2..]);
        for ((gradient, &left), &right) in self.gradient.iter_mut().zip(left).zip(right) {
            let difference = right as i16 - left as i16;
            *gradient = (difference.clamp(-MOST_GRADIENT, MOST_GRADIENT) + MOST_GRADIENT) as u8;
        }
    }

    #[inline(always)]
    fn census(&mut self) {
        const PIECE: usize = 64;
        let width = self.gradient.len();
        let mut start = 0;
        while start < width {
            let length = PIECE.min(width - start);
            let mut centre = [0u8; PIECE];
            for (x, centre) in centre[..length].iter_mut().enumerate() {
                let columns = &self.columns[start + x..start + x + 3];
                *centre = ((columns[0] + 2 * columns[1] + columns[2] + 8) >> 4) as u8;
            }
            for (plane, codes) in self.census.iter_mut().enumerate() {
                let codes = &mut codes[start..start + length];
                for bit in 0..8 {
                    let (right, down) = neighbour(8 * plane + bit);
                    let pixels = self.bordered.moved(self.y, start + right, down, length);
                    for ((code, &pixel), &centre) in codes.iter_mut().zip(pixels).zip(&centre) {
                        *code |= u8::from(pixel > centre) << bit;
                    }
                }
            }
            start += length;
        }
    }
}

/// Where the neighbour of a bit stands in the window, from its upper left corner.
#[inline(always)]
fn neighbour(bit: usize) -> (usize, usize) {
    const ACROSS: usize = 2 * RADIUS / SPACING + 1;
    // The centre is none of the neighbours.
    let place = bit + usize::from(bit >= ACROSS * ACROSS / 2);
    (place % ACROSS * SPACING, place / ACROSS * SPACING)
}
