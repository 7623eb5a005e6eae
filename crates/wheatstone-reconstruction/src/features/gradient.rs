//! How the grey of a picture changes from pixel to pixel.

use wheatstone_charts::imaging::{GrayImage, filter::gaussian_blur};

/// A smoothed picture and its derivatives, in grey levels a pixel.
pub struct Gradient {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The smoothed picture.
    pub smooth: GrayImage,
    /// By x, row by row.
    pub across: Vec<f32>,
    /// By y.
    pub down: Vec<f32>,
}

/// Standard deviation of the smoothing, in pixels: brings the sensor's noise to half a grey level.
const SMOOTHING: f64 = 1.0;

impl Gradient {
    /// Of a picture.
    #[must_use]
    pub fn new(picture: &GrayImage) -> Self {
        let smooth = gaussian_blur(picture, SMOOTHING);
        let (width, height) = (smooth.width(), smooth.height());
        let (mut across, mut down) = (vec![0.0; width * height], vec![0.0; width * height]);
        let values = smooth.values();
        for y in 1..height.saturating_sub(1) {
            let row = y * width;
            for x in 1..width.saturating_sub(1) {
                across[row + x] = 0.5 * (values[row + x + 1] - values[row + x - 1]);
                down[row + x] = 0.5 * (values[row + width + x] - values[row - width + x]);
            }
        }
        Self { width, height, smooth, across, down }
    }

    /// The square of its length at a place, row by row.
    #[must_use]
    pub fn square(&self, place: usize) -> f32 {
        self.across[place] * self.across[place] + self.down[place] * self.down[place]
    }
}
