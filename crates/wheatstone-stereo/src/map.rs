//! What matching returns.

/// Disparities of every pixel of the left picture, row by row.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct DisparityMap {
    /// Pixels of a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// x on the left less x on the right, in pixels; NaN where there is none.
    pub disparity: Vec<f32>,
    /// The probability that the disparity is less than one pixel off, 0 to 1. Zero where there is none, or where it was
    /// filled in.
    pub confidence: Vec<f32>,
    /// The disparity's standard deviation, in pixels, where it is no gross error; NaN where there is none, or where it was filled in.
    pub sigma: Vec<f32>,
}

/// A disparity of this confidence is hardly ever wrong.
pub const CONFIDENT: f32 = 0.9;

/// A pixel's disparity.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Match {
    /// x on the left less x on the right, in pixels.
    pub disparity: f32,
    /// The probability that it is less than one pixel off.
    pub confidence: f32,
    /// Its standard deviation, in pixels.
    pub sigma: f32,
}

impl DisparityMap {
    /// Disparities that another matcher found, row by row, with a standard deviation for all; what is not finite is no
    /// disparity. `None` where they do not fill whole rows.
    #[must_use]
    pub fn given(width: usize, disparity: Vec<f32>, sigma: f32) -> Option<Self> {
        let height = disparity.len().checked_div(width)?;
        let each = |known: f32, unknown: f32| -> Vec<f32> {
            disparity.iter().map(|own| if own.is_finite() { known } else { unknown }).collect()
        };
        let (confidence, sigma) = (each(1.0, 0.0), each(sigma, f32::NAN));
        (width * height == disparity.len()).then_some(Self {
            width,
            height,
            disparity,
            confidence,
            sigma,
        })
    }

    /// The disparity that was measured at a pixel, if one was and the pixel lies in the picture.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> Option<Match> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = y * self.width + x;
        let (disparity, confidence) = (self.disparity[at], self.confidence[at]);
        (confidence > 0.0).then(|| Match { disparity, confidence, sigma: self.sigma[at] })
    }

    /// The share of all pixels whose confidence is above a bound, 0 to 1.
    ///
    /// Of a good pair it is above a half at a bound of 0.9. Next to nothing means that the pictures show
    /// nothing in common: they are exchanged, not rectified, or the range is wrong.
    #[must_use]
    pub fn density(&self, confidence: f32) -> f64 {
        let above = self.confidence.iter().filter(|&&value| value > confidence).count();
        above as f64 / self.confidence.len() as f64
    }
}
