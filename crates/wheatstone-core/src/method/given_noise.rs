//! Error bars for pixels of which it is known how noisy they are, in place of what the points of the fit had.
//!
//! First order: by how much a point moves with each of its pixels' coordinates, whatever the map is.

use super::{Located, Reconstructor, Residual};
use crate::geometry::{Pixel, Point3, Vector3, axes_of};
use nalgebra::Matrix3;
use std::ops::Range;

/// The step of derivatives by pixels, in pixels: small against a lens, large against rounding.
pub const PIXEL_STEP: f64 = 0.125;

/// How noisy pixels are, where it is known: standard deviations of a coordinate, in pixels.
#[derive(Clone, Debug)]
pub enum PixelSigmas<'a> {
    /// The same for all of them.
    One(f64),
    /// One for both coordinates of each pixel, infinite where nothing is known of it: a column a camera, a row a point.
    Each(Vec<&'a [f64]>),
}

impl<'a> PixelSigmas<'a> {
    /// Those of some of the points.
    pub(super) fn part(&self, points: Range<usize>) -> Self {
        match self {
            Self::One(sigma) => Self::One(*sigma),
            Self::Each(columns) => {
                Self::Each(columns.iter().map(|column| &column[points.clone()]).collect())
            }
        }
    }

    /// The variances of a point's coordinates, x and y of each camera that sees it.
    pub(super) fn variances(&self, point: usize, pixels: &[Option<Pixel>]) -> Vec<f64> {
        let seen = pixels.iter().enumerate().filter(|(_, pixel)| pixel.is_some());
        let of = |(camera, _): (usize, _)| match self {
            Self::One(sigma) => *sigma,
            Self::Each(columns) => {
                let own = columns.get(camera).and_then(|column| column.get(point));
                own.copied().unwrap_or(f64::INFINITY)
            }
        };
        seen.map(of).flat_map(|sigma: f64| [sigma * sigma; 2]).collect()
    }
}

/// What one coordinate of a pixel is to the point that it shows.
#[derive(Clone, Copy, Debug)]
pub struct PixelShare {
    /// By how much the point moves with it, in world units per pixel.
    pub slope: Vector3,
    /// The variance that the map assumes of it, in squared pixels.
    pub variance: f64,
}

/// A point's covariance without its pixels' noise: that of the fit. What is left of numbers that nearly cancel is made
/// positive semidefinite.
#[must_use]
pub fn without_pixel_noise(covariance: Matrix3<f64>, shares: &[PixelShare]) -> Matrix3<f64> {
    let noise = |share: &PixelShare| share.slope * share.slope.transpose() * share.variance;
    let left = covariance - shares.iter().map(noise).sum::<Matrix3<f64>>();
    if !left.iter().all(|value| value.is_finite()) {
        return left;
    }
    let (axes, variances) = axes_of(left);
    if variances.iter().all(|variance| *variance >= 0.0) {
        return left;
    }
    let along = axes.iter().zip(variances);
    along.map(|(axis, variance)| axis * axis.transpose() * variance.max(0.0)).sum()
}

/// What each coordinate of a point's pixels is to it; `None` where the map locates no point beside it.
pub(super) fn shares(
    map: &dyn Reconstructor,
    pixels: &[Option<Pixel>],
    point: Point3,
) -> Option<Vec<PixelShare>> {
    let mut moved = pixels.to_vec();
    let mut shares = Vec::with_capacity(2 * pixels.len());
    for (camera, pixel) in pixels.iter().enumerate() {
        let Some(pixel) = *pixel else { continue };
        let variance = variance(map, (camera, pixel), point);
        for axis in 0..2 {
            let slope = [PIXEL_STEP, -PIXEL_STEP].into_iter().find_map(|step| {
                let mut to = pixel;
                to[axis] += step;
                moved[camera] = Some(to);
                Some((map.locate_point(&moved)? - point) / step)
            });
            moved[camera] = Some(pixel);
            shares.push(PixelShare { slope: slope?, variance });
        }
    }
    Some(shares)
}

/// The variance that a map assumes of a pixel; none for maps that assume nothing.
pub(super) fn variance(
    map: &dyn Reconstructor,
    (camera, pixel): (usize, Pixel),
    point: Point3,
) -> f64 {
    map.pixel_sigma(camera, pixel, point).map_or(0.0, |sigma| sigma * sigma)
}

impl Located {
    /// The same of pixels whose coordinates have the variances `given`, one for each share; without a covariance where
    /// nothing is known of its pixels' shares. The point stays: it is not weighted by them. Where the camera model does
    /// not hold (`holds`), the variances that the map assumes are mostly what its lenses lack, which better pixels do not
    /// mend.
    pub(super) fn for_pixels(
        mut self,
        shares: Option<Vec<PixelShare>>,
        given: &[f64],
        holds: bool,
    ) -> Self {
        let Some(mut shares) = shares else {
            self.covariance.fill(f64::NAN);
            return self;
        };
        if !holds {
            let both = shares.iter_mut().zip(given);
            both.for_each(|(share, given)| share.variance = share.variance.min(*given));
        }
        let noise =
            |(share, given): (&PixelShare, &f64)| share.slope * share.slope.transpose() * *given;
        self.covariance = without_pixel_noise(self.covariance, &shares)
            + shares.iter().zip(given).map(noise).sum::<Matrix3<f64>>();
        let count = shares.len() as f64;
        let assumed = shares.iter().map(|share| share.variance).sum::<f64>() / count;
        let mean = given.iter().sum::<f64>() / count;
        self.residual = self.residual.map(|Residual { rms, sigma }| {
            let fit = (sigma * sigma - assumed).max(0.0);
            Residual { rms, sigma: (fit + mean).sqrt() }
        });
        self
    }
}
