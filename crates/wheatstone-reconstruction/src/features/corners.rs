//! Corners: small windows that look like no other place beside them.

use super::gradient::Gradient;
use nalgebra::{Matrix2, Vector2};
use wheatstone_charts::imaging::{
    GrayImage,
    filter::{gaussian_kernel, separable},
};
use wheatstone_core::geometry::Pixel;

/// Half the side of a corner's window, in pixels.
const REACH: isize = 5;

/// Pixels of a window.
const WINDOW: usize = ((2 * REACH + 1) * (2 * REACH + 1)) as usize;

/// A window about a corner: grey levels less their mean, over their length.
pub type Look = [f32; WINDOW];

/// A corner of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// The pixel at its middle.
    pub at: Pixel,
    /// What it looks like.
    pub look: Look,
}

/// Standard deviation of the window over which gradients are compared, in pixels.
const SPREAD: f64 = 2.0;

/// The least eigenvalue of the mean square gradient, in squared grey levels a pixel: what two of the
/// faintest edges make where they cross.
const LEAST: f32 = 1.0;

/// The pixels about a corner in which there is no stronger one.
const ALONE: isize = 6;

/// The corners of a picture, the strongest first and so many at most (Shi & Tomasi 1994,
/// doi:10.1109/CVPR.1994.323794).
#[must_use]
pub fn corners(gradient: &Gradient, most: usize) -> Vec<Corner> {
    let (width, height) = (gradient.width, gradient.height);
    let product = |a: &[f32], b: &[f32]| {
        let values = a.iter().zip(b).map(|(a, b)| a * b).collect();
        let kernel = gaussian_kernel(SPREAD / std::f64::consts::SQRT_2);
        let image = GrayImage::from_values(width, height, values);
        image.map(|image| separable(&image, &kernel, &kernel))
    };
    let (gx, gy) = (&gradient.across, &gradient.down);
    let (Some(xx), Some(yy), Some(xy)) = (product(gx, gx), product(gy, gy), product(gx, gy)) else {
        return Vec::new();
    };
    let strength: Vec<f32> = (0..width * height)
        .map(|place| {
            let (a, b, c) = (xx.values()[place], yy.values()[place], xy.values()[place]);
            0.5 * (a + b - ((a - b) * (a - b) + 4.0 * c * c).sqrt())
        })
        .collect();
    let mut found = Vec::new();
    let margin = REACH + 2;
    for y in margin..height as isize - margin {
        for x in margin..width as isize - margin {
            let own = strength[y as usize * width + x as usize];
            if own >= LEAST && is_alone(&strength, width, (x, y), own) {
                found.push((own, x, y));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let corner = |(_, x, y): &(f32, isize, isize)| {
        let at = Pixel::new(*x as f64, *y as f64);
        Some(Corner { at, look: look(&gradient.smooth, at)? })
    };
    found.iter().take(most).filter_map(corner).collect()
}

fn is_alone(strength: &[f32], width: usize, (x, y): (isize, isize), own: f32) -> bool {
    let height = strength.len() / width;
    for dy in -ALONE..=ALONE {
        for dx in -ALONE..=ALONE {
            let (x, y) = (x + dx, y + dy);
            if x < 0 || y < 0 || x >= width as isize || y >= height as isize || (dx, dy) == (0, 0) {
                continue;
            }
            let other = strength[y as usize * width + x as usize];
            // Of two alike the first counts.
            if other > own || (other == own && (dy, dx) < (0, 0)) {
                return false;
            }
        }
    }
    true
}

/// What the window about a place looks like; `None` for a plain one.
#[must_use]
pub fn look(picture: &GrayImage, at: Pixel) -> Option<Look> {
    let mut look = [0.0; WINDOW];
    let side = 2 * REACH + 1;
    for (index, value) in look.iter_mut().enumerate() {
        let (dx, dy) = (index as isize % side - REACH, index as isize / side - REACH);
        *value = picture.sample(at + Vector2::new(dx as f64, dy as f64));
    }
    let mean = look.iter().sum::<f32>() / WINDOW as f32;
    look.iter_mut().for_each(|value| *value -= mean);
    let length = look.iter().map(|value| value * value).sum::<f32>().sqrt();
    if length < 1e-3 {
        return None;
    }
    look.iter_mut().for_each(|value| *value /= length);
    Some(look)
}

/// How alike two windows are, -1 to 1.
#[must_use]
pub fn likeness(first: &Look, second: &Look) -> f32 {
    first.iter().zip(second).map(|(a, b)| a * b).sum()
}

/// A window of the second picture that looks like one of the first.
#[derive(Clone, Copy, Debug)]
pub struct Aligned {
    /// Its middle.
    pub at: Pixel,
    /// How alike they are, as [`likeness`] has it.
    pub likeness: f32,
    /// The inverse of the place's covariance, in pixels, where windows differ by noise alone, of which each pixel has its
    /// own share.
    pub information: Matrix2<f64>,
}

/// The place near `start` whose window looks like `wanted`, to a fraction of a pixel (Lucas & Kanade
/// 1981). `None` where the search runs off.
#[must_use]
pub(super) fn aligned(wanted: &Look, gradient: &Gradient, start: Pixel) -> Option<Aligned> {
    settle(wanted, gradient, start, |normal, right| Some(normal.try_inverse()? * right))
}

/// As for corners, but the place moves along a unit vector only: windows of edges tell nothing of other ways.
#[must_use]
pub fn aligned_along(
    wanted: &Look,
    gradient: &Gradient,
    (start, way): (Pixel, Vector2<f64>),
) -> Option<Aligned> {
    let step = |normal: Matrix2<f64>, right: Vector2<f64>| {
        let slope = way.dot(&(normal * way));
        (slope > 0.0).then(|| way * (way.dot(&right) / slope))
    };
    settle(wanted, gradient, start, step)
}

/// Steps from `start` to where the windows are most alike; `step` solves the normal equations.
fn settle(
    wanted: &Look,
    gradient: &Gradient,
    start: Pixel,
    step: impl Fn(Matrix2<f64>, Vector2<f64>) -> Option<Vector2<f64>>,
) -> Option<Aligned> {
    // It settles within a few steps or not at all; corners are a pixel or two off at first.
    const STEPS: usize = 8;
    const FARTHEST: f64 = 3.5;
    let side = 2 * REACH + 1;
    let (mut at, mut slopes) = (start, Matrix2::zeros());
    for _ in 0..STEPS {
        let here = look(&gradient.smooth, at)?;
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        let length = window_length(&gradient.smooth, at);
        for (index, (wanted, value)) in wanted.iter().zip(&here).enumerate() {
            let (dx, dy) = (index as isize % side - REACH, index as isize / side - REACH);
            let (x, y) = (at.x.round() as isize + dx, at.y.round() as isize + dy);
            if x < 0 || y < 0 || x as usize >= gradient.width || y as usize >= gradient.height {
                return None;
            }
            let place = y as usize * gradient.width + x as usize;
            let slope = Vector2::new(
                f64::from(gradient.across[place] / length),
                f64::from(gradient.down[place] / length),
            );
            normal += slope * slope.transpose();
            right += slope * f64::from(wanted - value);
        }
        slopes = normal;
        let by = step(normal, right)?;
        at += by;
        if (at - start).norm() > FARTHEST || !gradient.smooth.contains(at, REACH as f64 + 1.0) {
            return None;
        }
        if by.norm() < 0.01 {
            break;
        }
    }
    let here = look(&gradient.smooth, at)?;
    let residual = |(wanted, value): (&f32, &f32)| f64::from(wanted - value).powi(2);
    let squares: f64 = wanted.iter().zip(&here).map(residual).sum();
    // Their mean and length are those of the wanted window, and two coordinates were fitted.
    let variance = squares / (WINDOW - 4) as f64;
    Some(Aligned { at, likeness: likeness(wanted, &here), information: slopes / variance })
}

/// The length of a window's grey levels about their mean.
fn window_length(picture: &GrayImage, at: Pixel) -> f32 {
    let (mut sum, mut squares) = (0.0_f32, 0.0_f32);
    for dy in -REACH..=REACH {
        for dx in -REACH..=REACH {
            let value = picture.at(at.x.round() as isize + dx, at.y.round() as isize + dy);
            sum += value;
            squares += value * value;
        }
    }
    (squares - sum * sum / WINDOW as f32).max(1e-6).sqrt()
}
