//! Pictures with marks drawn on them, to be looked at.

use super::{GrayImage, png_bytes};
use std::path::Path;
use wheatstone_core::{Result, geometry::Pixel, storage};

/// Red, green, blue.
pub type Colour = [u8; 3];

/// A colour picture made from a grey one.
#[derive(Clone, Debug)]
pub struct Annotated {
    width: usize,
    height: usize,
    /// Row by row.
    values: Vec<Colour>,
    /// Colour pixels a grey pixel, along each side.
    scale: usize,
}

impl Annotated {
    /// The grey picture in paler tones, so that marks stand out, enlarged by a whole number where
    /// it is small.
    #[must_use]
    pub fn new(image: &GrayImage) -> Self {
        let scale = (1600 / image.width().max(1)).clamp(1, 4);
        let (width, height) = (image.width() * scale, image.height() * scale);
        let values = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let value = image.at((x / scale) as isize, (y / scale) as isize);
                [(60.0 + value * (195.0 / 255.0)).round() as u8; 3]
            })
            .collect();
        Self { width, height, values, scale }
    }

    /// Puts a slanting cross with a gap in its middle: what it marks stays visible, and a grid's own
    /// lines do not hide it.
    pub fn cross(&mut self, at: Pixel, colour: Colour) {
        let Some((x, y)) = self.place(at) else { return };
        for step in 3..=11 {
            for (dx, dy) in [(step, step), (-step, step), (step, -step), (-step, -step)] {
                self.set(x + dx, y + dy, colour);
                self.set(x + dx + 1, y + dy, colour);
            }
        }
    }

    /// Draws a straight line.
    pub fn line(&mut self, from: Pixel, to: Pixel, colour: Colour) {
        let (Some(a), Some(b)) = (self.place(from), self.place(to)) else { return };
        let steps = (a.0 - b.0).abs().max((a.1 - b.1).abs()).clamp(1, 100_000);
        for step in 0..=steps {
            let along = |a: isize, b: isize| a + (b - a) * step / steps;
            self.set(along(a.0, b.0), along(a.1, b.1), colour);
        }
    }

    /// Writes the picture as a PNG.
    ///
    /// # Errors
    ///
    /// [`wheatstone_core::Error::Io`].
    pub fn write_png(&self, path: &Path) -> Result<()> {
        let bytes: Vec<u8> = self.values.iter().flatten().copied().collect();
        let size = (self.width as u32, self.height as u32);
        storage::write(path, &png_bytes(&bytes, size, image::ExtendedColorType::Rgb8))
    }

    /// The colour pixel in which a place of the grey picture lies.
    fn place(&self, at: Pixel) -> Option<(isize, isize)> {
        let scaled = |v: f64| ((v + 0.5) * self.scale as f64).floor();
        let (x, y) = (scaled(at.x), scaled(at.y));
        (x.abs() < 1e6 && y.abs() < 1e6).then_some((x as isize, y as isize))
    }

    fn set(&mut self, x: isize, y: isize, colour: Colour) {
        if x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < self.height {
            self.values[y as usize * self.width + x as usize] = colour;
        }
    }
}
