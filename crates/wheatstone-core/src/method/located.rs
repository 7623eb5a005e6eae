//! A point found from its pixels, and how well it explains them.

use crate::geometry::Point3;
use nalgebra::Matrix3;

/// A point found from its pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// Where it is, in world coordinates.
    pub point: Point3,
    /// Its covariance, in squared world units.
    pub covariance: Matrix3<f64>,
    /// Its reprojection error; `None` for methods that have no rays.
    pub residual: Option<Residual>,
}

/// The reprojection error of a located point, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Root mean square over the coordinates of all pixels.
    pub rms: f64,
    /// What noise and uncertainty of the fit let expect of it, as the standard deviation of one
    /// coordinate.
    pub sigma: f64,
}

impl Residual {
    /// [`Located::misfit`].
    pub(super) fn misfit(self, cameras: usize) -> Option<(f64, usize)> {
        let coordinates = 2 * cameras;
        let chi_square = coordinates as f64 * (self.rms / self.sigma).powi(2);
        (chi_square.is_finite() && coordinates > 3).then(|| (chi_square, coordinates - 3))
    }
}

impl Located {
    /// Of a method that has no rays, and so no residual.
    #[must_use]
    pub fn without_rays(point: Point3, covariance: Matrix3<f64>) -> Self {
        Self { point, covariance, residual: None }
    }

    /// The residual as a chi-square, with its degrees of freedom: two coordinates for each of the
    /// cameras that saw the point, less three. Larger than chance allows for pixels that do not
    /// belong together. `None` where there are no rays, or no error is expected.
    #[must_use]
    pub fn misfit(&self, cameras: usize) -> Option<(f64, usize)> {
        self.residual?.misfit(cameras)
    }
}
