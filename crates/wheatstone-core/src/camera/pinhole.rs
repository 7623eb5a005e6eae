//! The ideal camera: straight lines stay straight.

use super::CameraModel;
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::number::Number;

/// Focal lengths and principal point, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pinhole {
    /// Focal length over pixel width and over pixel height.
    pub focal: [f64; 2],
    /// Where the optical axis meets the picture.
    pub principal: [f64; 2],
}

impl Default for Pinhole {
    fn default() -> Self {
        Self { focal: [700.0, 700.0], principal: [319.5, 239.5] }
    }
}

impl Pinhole {
    /// The pixel of a place on the plane z = 1.
    #[must_use]
    pub fn pixel(&self, x: f64, y: f64) -> Pixel {
        Pixel::new(self.focal[0] * x + self.principal[0], self.focal[1] * y + self.principal[1])
    }

    /// The place on the plane z = 1 that `pixel` shows.
    #[must_use]
    pub fn place(&self, pixel: Pixel) -> [f64; 2] {
        [
            (pixel.x - self.principal[0]) / self.focal[0],
            (pixel.y - self.principal[1]) / self.focal[1],
        ]
    }

    /// All four numbers.
    pub(super) fn numbers_mut(&mut self) -> Vec<&mut f64> {
        self.focal.iter_mut().chain(&mut self.principal).collect()
    }

    /// [`Pinhole::pixel`] of one place, or of a register of them.
    #[inline(always)]
    pub(super) fn pixels<N: Number>(&self, [x, y]: [N; 2]) -> [N; 2] {
        let along = |value: N, axis: usize| {
            value.all(self.focal[axis]) * value + value.all(self.principal[axis])
        };
        [along(x, 0), along(y, 1)]
    }

    /// Derivatives of the pixel by focal lengths and principal point, where the lens brings the point to
    /// `distorted`.
    #[inline(always)]
    pub(super) fn slopes<N: Number>([x, y]: [N; 2]) -> [[N; 2]; 4] {
        let (zero, one) = (x.all(0.0), x.all(1.0));
        [[x, zero], [zero, y], [one, zero], [zero, one]]
    }
}

impl CameraModel for Pinhole {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.numbers_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        (point.z > 0.0).then(|| self.pixel(point.x / point.z, point.y / point.z))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let [x, y] = self.place(pixel);
        Some(Ray { origin: Point3::origin(), direction: Vector3::new(x, y, 1.0).normalize() })
    }
}
