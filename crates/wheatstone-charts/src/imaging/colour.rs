//! Pictures with their colours.

use super::GrayImage;

/// A grey picture, and the colours that it was made from.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourImage {
    /// Grey values.
    pub gray: GrayImage,
    /// Red, green and blue, row by row, top to bottom; as many as there are grey values.
    pub(super) colours: Vec<[u8; 3]>,
}

impl ColourImage {
    /// A grey picture, with three equal colours.
    #[must_use]
    pub fn from_gray(gray: GrayImage) -> Self {
        let colours = gray.values().iter().map(|value| [value.round() as u8; 3]).collect();
        Self { gray, colours }
    }

    /// A grey picture with colours, row by row, top to bottom; `None` where these are not as many as grey values.
    #[must_use]
    pub fn new(gray: GrayImage, colours: Vec<[u8; 3]>) -> Option<Self> {
        (gray.values().len() == colours.len()).then_some(Self { gray, colours })
    }

    /// Red, green and blue of the pixel nearest to a place; outside, of the nearest one inside.
    #[must_use]
    pub fn nearest(&self, [x, y]: [f64; 2]) -> [u8; 3] {
        let within = |at: f64, side: usize| at.round().clamp(0.0, side as f64 - 1.0) as usize;
        let (x, y) = (within(x, self.gray.width()), within(y, self.gray.height()));
        self.colours[y * self.gray.width() + x]
    }
}
