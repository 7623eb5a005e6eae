//! A picture at one scale, and smooth sampling of it.

use crate::imaging::{GrayImage, filter::gaussian_blur};
use std::cell::OnceCell;
use wheatstone_core::geometry::Pixel;

/// Blur before sub-pixel sampling, in pixels. With a pixel's own width and any lens, what is left
/// above the sampling limit is too weak to move a line by 1/1000 px, wherever the pixels fall.
const SAMPLING_BLUR: f64 = 0.8;

/// A picture halved some times.
pub(super) struct Level {
    /// How many times it was halved.
    pub(super) halvings: u32,
    /// Unblurred.
    pub(super) image: GrayImage,
    smooth: OnceCell<GrayImage>,
}

impl Level {
    fn new(halvings: u32, image: GrayImage) -> Self {
        Self { halvings, image, smooth: OnceCell::new() }
    }

    /// The picture, and its halves down to `least` pixels on the shorter side.
    pub(super) fn pyramid(image: &GrayImage, least: usize) -> Vec<Self> {
        let mut levels = vec![Self::new(0, image.clone())];
        while let Some(last) = levels.last()
            && last.image.width().min(last.image.height()) >= 2 * least
        {
            let next = Self::new(last.halvings + 1, halved(&last.image));
            levels.push(next);
        }
        levels
    }

    /// Pixels of the whole picture along the side of one of this level's.
    pub(super) fn scale(&self) -> f64 {
        f64::from(1_u32 << self.halvings)
    }

    /// A place of this level in the whole picture.
    pub(super) fn to_picture(&self, at: Pixel) -> Pixel {
        at.map(|v| (v + 0.5) * self.scale() - 0.5)
    }

    /// A place of the whole picture in this level.
    pub(super) fn in_level(&self, at: Pixel) -> Pixel {
        at.map(|v| (v + 0.5) / self.scale() - 0.5)
    }

    /// The level as a grid of the given polarity shows in it.
    pub(super) fn view(&self, polarity: Polarity) -> View<'_> {
        let smooth = self.smooth.get_or_init(|| gaussian_blur(&self.image, SAMPLING_BLUR));
        View { image: smooth, sign: polarity.sign() }
    }
}

/// Half the size; pixel (x, y) of the result lies at (2 x + 0.5, 2 y + 0.5). Weights of 1, 3, 3, 1
/// rather than 1, 1: sharp edges of wide lines would else be drawn to pixels, by 0.09 px of the
/// whole picture at a pitch of 400 (measured), where 0.03 are left.
fn halved(image: &GrayImage) -> GrayImage {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mut values = Vec::with_capacity(width * height);
    let weigh = |a: f32, b: f32, c: f32, d: f32| (a + d + 3.0 * (b + c)) / 8.0;
    let mut column = vec![0.0_f32; image.width()];
    for y in 0..height {
        let last = image.height() - 1;
        let rows = [(2 * y).saturating_sub(1), 2 * y, 2 * y + 1, (2 * y + 2).min(last)];
        let [a, b, c, d] = rows.map(|row| image.row(row));
        for (x, value) in column.iter_mut().enumerate() {
            *value = weigh(a[x], b[x], c[x], d[x]);
        }
        let last = image.width() - 1;
        values.extend((0..width).map(|x| {
            let (before, after) = ((2 * x).saturating_sub(1), (2 * x + 2).min(last));
            weigh(column[before], column[2 * x], column[2 * x + 1], column[after])
        }));
    }
    // The values are counted by construction.
    GrayImage::from_values(width, height, values).unwrap_or_else(|| image.clone())
}

/// Which of lines and ground is darker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Polarity {
    /// Dark lines on light ground.
    Dark,
    /// Light lines on dark ground.
    Light,
}

impl Polarity {
    /// What grey values are multiplied by to make lines dark.
    pub(super) fn sign(self) -> f32 {
        match self {
            Self::Dark => 1.0,
            Self::Light => -1.0,
        }
    }
}

/// A blurred picture whose lines are darker than their ground.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    image: &'a GrayImage,
    sign: f32,
}

impl View<'_> {
    /// Whether a place lies at least `margin` pixels inside.
    pub(super) fn contains(&self, at: Pixel, margin: f64) -> bool {
        self.image.contains(at, margin)
    }

    /// Pixels.
    pub(super) fn area(&self) -> usize {
        self.image.width() * self.image.height()
    }

    /// The grey value between pixels, bicubic (Keys, doi:10.1109/TASSP.1981.1163711).
    pub(super) fn sample(&self, at: Pixel) -> f64 {
        let (left, top) = (at.x.floor(), at.y.floor());
        let (across, down) = (keys((at.x - left) as f32), keys((at.y - top) as f32));
        let (column, row) = (left as isize - 1, top as isize - 1);
        let (width, height) = (self.image.width() as isize, self.image.height() as isize);
        let inside = column >= 0 && row >= 0 && column + 4 <= width && row + 4 <= height;
        let mut sum = 0.0;
        for (y, weight) in (row..).zip(down) {
            let line = if inside {
                let start = column as usize;
                let values = &self.image.row(y as usize)[start..start + 4];
                values.iter().zip(across).map(|(v, w)| v * w).sum::<f32>()
            } else {
                (column..).zip(across).map(|(x, w)| self.image.at(x, y) * w).sum::<f32>()
            };
            sum += weight * line;
        }
        f64::from(self.sign * sum)
    }
}

/// Weights of four neighbours for a place `t` of the way from the second to the third.
fn keys(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        -0.5 * t3 + t2 - 0.5 * t,
        1.5 * t3 - 2.5 * t2 + 1.0,
        -1.5 * t3 + 2.0 * t2 + 0.5 * t,
        0.5 * t3 - 0.5 * t2,
    ]
}
