//! The ideal camera: straight lines stay straight.

use super::CameraModel;
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use nalgebra::{Matrix2, Matrix2x3};
use serde::{Deserialize, Serialize};

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

    /// Derivatives by the camera-frame point at depth `z` whose place on the plane z = 1 is `(x, y)`,
    /// where the lens has the derivatives `stretch` on that plane.
    pub(super) fn by_point(
        &self,
        stretch: &Matrix2<f64>,
        x: f64,
        y: f64,
        z: f64,
    ) -> Matrix2x3<f64> {
        let inverse = 1.0 / z;
        let row = |axis: usize| {
            let scale = self.focal[axis] * inverse;
            let (by_x, by_y) = (stretch[(axis, 0)] * scale, stretch[(axis, 1)] * scale);
            [by_x, by_y, -(by_x * x + by_y * y)]
        };
        let ([a, b, c], [d, e, f]) = (row(0), row(1));
        Matrix2x3::new(a, b, c, d, e, f)
    }

    /// Derivatives of the pixel by focal lengths, principal point and the lens's own numbers, where
    /// the lens brings the point to `distorted` and has the derivatives `of_lens` there.
    pub(super) fn slopes(
        &self,
        distorted: [f64; 2],
        of_lens: &[[f64; 2]],
        slopes: &mut [[f64; 2]],
    ) {
        let own = [[distorted[0], 0.0], [0.0, distorted[1]], [1.0, 0.0], [0.0, 1.0]];
        let Some((first, lens)) = slopes.split_first_chunk_mut::<4>() else { return };
        *first = own;
        for (slope, [x, y]) in lens.iter_mut().zip(of_lens) {
            *slope = [self.focal[0] * x, self.focal[1] * y];
        }
    }
}

impl CameraModel for Pinhole {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.focal.iter_mut().chain(&mut self.principal).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        (point.z > 0.0).then(|| self.pixel(point.x / point.z, point.y / point.z))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let [x, y] = self.place(pixel);
        Some(Ray { origin: Point3::origin(), direction: Vector3::new(x, y, 1.0).normalize() })
    }
}
