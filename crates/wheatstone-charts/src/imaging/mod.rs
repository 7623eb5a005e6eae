//! Pictures: decoding within limits, filters, sampling, writing. Knows no charts.

mod annotate;
mod colour;
mod decode;
pub mod filter;
mod names;
mod raw;
mod rounding;

pub use annotate::{Annotated, Colour};
pub use colour::ColourImage;
pub use decode::{Limits, decode_image, read_colour_image, read_image, read_size};
pub use names::{in_counting_order, is_other_picture, is_picture};

use std::path::Path;
use wheatstone_core::{Result, geometry::Pixel, storage};

/// A grey picture. Values are 0 (black) to 255 (white); deeper pictures keep their fractions.
#[derive(Clone, Debug, PartialEq)]
pub struct GrayImage {
    width: usize,
    height: usize,
    /// Row by row, top to bottom.
    values: Vec<f32>,
}

impl GrayImage {
    /// A picture with `value(column, row)` at each pixel.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, value: impl Fn(usize, usize) -> f32) -> Self {
        let values = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { width, height, values: values.map(|(x, y)| value(x, y)).collect() }
    }

    /// A picture from its values, row by row; `None` where their number does not fit.
    #[must_use]
    pub fn from_values(width: usize, height: usize, values: Vec<f32>) -> Option<Self> {
        (values.len() == width * height).then_some(Self { width, height, values })
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// One row's values.
    #[must_use]
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..(y + 1) * self.width]
    }

    /// The value at a pixel; outside, that of the nearest pixel inside.
    #[must_use]
    pub fn at(&self, x: isize, y: isize) -> f32 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.values[y * self.width + x]
    }

    /// The value between pixels, bilinear; outside, that of the nearest place inside.
    #[must_use]
    pub fn sample(&self, at: Pixel) -> f32 {
        let x = at.x.clamp(0.0, self.width as f64 - 1.0);
        let y = at.y.clamp(0.0, self.height as f64 - 1.0);
        // Not below 0, so that cutting is rounding down.
        let (left, top) = (x as usize, y as usize);
        let (right_share, low_share) = ((x - left as f64) as f32, (y - top as f64) as f32);
        let right = (left + 1).min(self.width - 1);
        let (first, second) = (self.row(top), self.row((top + 1).min(self.height - 1)));
        let upper = first[left] * (1.0 - right_share) + first[right] * right_share;
        let lower = second[left] * (1.0 - right_share) + second[right] * right_share;
        upper * (1.0 - low_share) + lower * low_share
    }

    /// Whether a place lies on the picture, at least `margin` pixels from the outermost pixel centres.
    #[must_use]
    pub fn contains(&self, at: Pixel, margin: f64) -> bool {
        at.x >= margin
            && at.y >= margin
            && at.x <= self.width as f64 - 1.0 - margin
            && at.y <= self.height as f64 - 1.0 - margin
    }

    /// Black for white.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self { values: self.values.iter().map(|v| 255.0 - v).collect(), ..*self }
    }

    /// What is taken from values, and what they are then multiplied by, for 8 bits: where all of them lie within a
    /// quarter of the range (a 12-bit camera in a 16-bit file, say) they are stretched over the whole of it.
    fn stretch(&self) -> (f32, f32) {
        let (low, high) = rounding::extremes(&self.values);
        let stretch = high > low && high - low < 64.0;
        if stretch { (low, 255.0 / (high - low)) } else { (0.0, 1.0) }
    }

    /// The same picture with the values that [`GrayImage::to_8_bit`] rounds.
    #[must_use]
    pub fn stretched(&self) -> Self {
        let (offset, factor) = self.stretch();
        Self { values: self.values.iter().map(|v| (v - offset) * factor).collect(), ..*self }
    }

    /// The same picture in 8 bits. Values are rounded; where all of them lie within a quarter of the
    /// range (a 12-bit camera in a 16-bit file, say) they are first stretched over the whole of it.
    #[must_use]
    pub fn to_8_bit(&self) -> image::GrayImage {
        let (offset, factor) = self.stretch();
        let bytes = rounding::bytes(&self.values, offset, factor);
        image::GrayImage::from_raw(self.width as u32, self.height as u32, bytes).unwrap_or_default()
    }

    /// Writes the picture as an 8-bit PNG, values rounded.
    ///
    /// # Errors
    ///
    /// [`wheatstone_core::Error::Io`].
    pub fn write_png(&self, path: &Path) -> Result<()> {
        let bytes: Vec<u8> = self.values.iter().map(|v| v.round() as u8).collect();
        let size = (self.width as u32, self.height as u32);
        storage::write(path, &png_bytes(&bytes, size, image::ExtendedColorType::L8))
    }
}

/// A PNG file's bytes.
fn png_bytes(
    values: &[u8],
    (width, height): (u32, u32),
    kind: image::ExtendedColorType,
) -> Vec<u8> {
    use image::ImageEncoder;
    let mut file = Vec::new();
    // Writing to memory cannot fail, and the caller's buffer has the size that it names.
    let written =
        image::codecs::png::PngEncoder::new(&mut file).write_image(values, width, height, kind);
    debug_assert!(written.is_ok());
    file
}
