//! Linear filters and halving.

use super::GrayImage;
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// A Gaussian's weights for whole-pixel steps, out to four standard deviations (1e-4 of its mass
/// lies beyond), summing to 1.
#[must_use]
pub fn gaussian_kernel(sigma: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as i32;
    let weights: Vec<f64> =
        (-reach..=reach).map(|i| libm::exp(-f64::from(i * i) / (2.0 * sigma * sigma))).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

/// Convolves with a Gaussian of `sigma` pixels; the border is continued with its own values.
#[must_use]
pub fn gaussian_blur(image: &GrayImage, sigma: f64) -> GrayImage {
    if sigma <= 0.0 {
        return image.clone();
    }
    separable(image, &gaussian_kernel(sigma), &gaussian_kernel(sigma))
}

/// Correlates rows with `across` and columns with `down` (odd lengths, centred).
#[must_use]
pub fn separable(image: &GrayImage, across: &[f32], down: &[f32]) -> GrayImage {
    let (width, height) = (image.width(), image.height());
    let (reach_x, reach_y) = ((across.len() / 2) as isize, (down.len() / 2) as isize);
    let mut rows = vec![0.0_f32; width * height];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let source = image.row(y);
        let padded: Vec<f32> = (-reach_x..width as isize + reach_x)
            .map(|x| source[x.clamp(0, width as isize - 1) as usize])
            .collect();
        let shifted: Vec<&[f32]> = (0..across.len()).map(|shift| &padded[shift..]).collect();
        on_widest(Weighted { weights: across, rows: &shifted, out });
    });
    let mut values = vec![0.0_f32; width * height];
    values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = |shift: usize| {
            let row =
                (y as isize + shift as isize - reach_y).clamp(0, height as isize - 1) as usize;
            &rows[row * width..][..width]
        };
        let shifted: Vec<&[f32]> = (0..down.len()).map(row).collect();
        on_widest(Weighted { weights: down, rows: &shifted, out });
    });
    GrayImage { width, height, values }
}

/// The weighted sum of rows, in their order, whatever the width of registers.
struct Weighted<'a> {
    weights: &'a [f32],
    rows: &'a [&'a [f32]],
    out: &'a mut [f32],
}

impl WithSimd for Weighted<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        // Sums that stay in registers.
        const BLOCK: usize = 32;
        let (blocks, rest) = self.out.as_chunks_mut::<BLOCK>();
        for (number, out) in blocks.iter_mut().enumerate() {
            let mut sums = [0.0; BLOCK];
            for (weight, row) in self.weights.iter().zip(self.rows) {
                let values = &row[number * BLOCK..][..BLOCK];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += weight * value;
                }
            }
            *out = sums;
        }
        rest.fill(0.0);
        for (weight, row) in self.weights.iter().zip(self.rows) {
            for (sum, value) in rest.iter_mut().zip(&row[blocks.len() * BLOCK..]) {
                *sum += weight * value;
            }
        }
    }
}

/// Half the size: means of 2 x 2 pixels, an odd last row or column left out. Pixel (x, y) of the
/// result lies at (2 x + 0.5, 2 y + 0.5) of the picture.
#[must_use]
pub fn halve(image: &GrayImage) -> GrayImage {
    let (width, height) = ((image.width() / 2).max(1), (image.height() / 2).max(1));
    if image.width() > 1 && image.height() > 1 {
        let mut values = vec![0.0; width * height];
        on_widest(Halve { image, values: &mut values });
        return GrayImage { width, height, values };
    }
    GrayImage::from_fn(width, height, |x, y| {
        let (x, y) = (2 * x as isize, 2 * y as isize);
        (image.at(x, y) + image.at(x + 1, y) + image.at(x, y + 1) + image.at(x + 1, y + 1)) / 4.0
    })
}

/// The picture, its half, the half of that, and so on, the shorter side of the last at least `least` pixels long unless
/// it is the picture's own.
#[must_use]
pub fn halvings(image: &GrayImage, least: usize) -> Vec<GrayImage> {
    let is_large = |last: &&GrayImage| last.width().min(last.height()) >= 2 * least;
    let mut sizes = vec![image.clone()];
    while let Some(half) = sizes.last().filter(is_large).map(halve) {
        sizes.push(half);
    }
    sizes
}

struct Halve<'a> {
    image: &'a GrayImage,
    values: &'a mut [f32],
}

impl WithSimd for Halve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (y, out) in self.values.chunks_exact_mut(self.image.width / 2).enumerate() {
            let (upper, lower) = (self.image.row(2 * y), self.image.row(2 * y + 1));
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            for (value, (a, b)) in out.iter_mut().zip(pairs) {
                *value = (a[0] + a[1] + b[0] + b[1]) / 4.0;
            }
        }
    }
}
