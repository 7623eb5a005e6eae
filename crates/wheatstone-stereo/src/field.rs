//! Numbers of every pixel, with room beside each row for windows that reach out of the picture.

use crate::{
    buffers::{Buffer, Pool},
    registers::FLOATS,
};
use rayon::prelude::*;

/// Columns beside the picture: at least a window's radius, and whole registers.
pub(crate) const MARGIN: usize = FLOATS;

/// One number a pixel, row by row; pixel x of a row stands at `MARGIN + x`.
pub(crate) struct Field {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) stride: usize,
    values: Buffer<f32>,
}

impl Field {
    /// The same number everywhere, beside the picture too.
    pub(crate) fn new(pool: &Pool<f32>, (width, height): (usize, usize), value: f32) -> Self {
        let stride = width.next_multiple_of(FLOATS) + 2 * MARGIN;
        Self { width, height, stride, values: pool.filled(stride * height, value) }
    }

    /// Of the same size.
    pub(crate) fn like(&self, value: f32) -> Self {
        Self::new(self.pool(), (self.width, self.height), value)
    }

    /// Where its memory comes from.
    pub(crate) fn pool(&self) -> &Pool<f32> {
        self.values.pool()
    }

    /// A row with its margins.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.stride..][..self.stride]
    }

    /// The pixels of a row.
    #[inline(always)]
    pub(crate) fn pixels(&self, y: usize) -> &[f32] {
        &self.row(y)[MARGIN..MARGIN + self.width]
    }

    /// The pixels of all rows, to be written in parallel.
    pub(crate) fn par_pixels_mut(&mut self) -> impl IndexedParallelIterator<Item = &mut [f32]> {
        let width = self.width;
        self.values.par_chunks_mut(self.stride).map(move |row| &mut row[MARGIN..MARGIN + width])
    }

    /// The pixels of so many rows at a time, each in its place, to be written in parallel.
    pub(crate) fn par_bands_mut(
        &mut self,
        rows: usize,
    ) -> impl IndexedParallelIterator<Item = Vec<&mut [f32]>> {
        let width = self.width;
        let bands = self.values.par_chunks_mut(self.stride * rows);
        let stride = self.stride;
        bands.map(move |band| {
            band.chunks_mut(stride).map(|row| &mut row[MARGIN..MARGIN + width]).collect()
        })
    }

    /// All pixels without margins.
    pub(crate) fn to_pixels(&self) -> Vec<f32> {
        let mut pixels = Vec::with_capacity(self.width * self.height);
        (0..self.height).for_each(|y| pixels.extend_from_slice(self.pixels(y)));
        pixels
    }
}
