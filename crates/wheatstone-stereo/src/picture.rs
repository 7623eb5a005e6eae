//! Grey pictures, as views of somebody's bytes.

use crate::error::MatchError;

/// A grey picture of eight bits a pixel, rows from top to bottom without gaps.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    width: usize,
    height: usize,
    pixels: &'a [u8],
}

impl<'a> Picture<'a> {
    /// A view of `width` x `height` bytes.
    ///
    /// # Errors
    ///
    /// Where there are no pixels, or another number of bytes.
    pub fn new(width: usize, height: usize, pixels: &'a [u8]) -> Result<Self, MatchError> {
        let expected = width.saturating_mul(height);
        if expected == 0 {
            return Err(MatchError::Empty);
        }
        if expected != pixels.len() {
            return Err(MatchError::Pixels { expected, given: pixels.len() });
        }
        Ok(Self { width, height, pixels })
    }

    /// Pixels of a row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// A picture of the same size with other pixels, as many.
    pub(crate) fn with<'b>(&self, pixels: &'b [u8]) -> Picture<'b> {
        Picture { width: self.width, height: self.height, pixels }
    }

    /// One row.
    pub(crate) fn row(&self, y: usize) -> &'a [u8] {
        &self.pixels[y * self.width..][..self.width]
    }
}
