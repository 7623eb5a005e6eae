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

    /// [`Pinhole::pixel`] of one place, or of a register of them.
    #[inline(always)]
    pub(super) fn pixels<N: Number>(&self, [x, y]: [N; 2]) -> [N; 2] {
        let along = |value: N, axis: usize| {
            value.all(self.focal[axis]) * value + value.all(self.principal[axis])
        };
        [along(x, 0), along(y, 1)]
    }

    /// Derivatives by the camera-frame point at depth `z` whose place on the plane z = 1 is `(x, y)`,
    /// where the lens has the derivatives `stretch` on that plane.
    #[inline(always)]
    pub(super) fn by_point<N: Number>(
        &self,
        stretch: [[N; 2]; 2],
        [x, y, z]: [N; 3],
    ) -> [[N; 3]; 2] {
        let inverse = z.all(1.0) / z;
        let row = |axis: usize| {
            let scale = z.all(self.focal[axis]) * inverse;
            let (by_x, by_y) = (stretch[axis][0] * scale, stretch[axis][1] * scale);
            [by_x, by_y, z.all(0.0) - (by_x * x + by_y * y)]
        };
        [row(0), row(1)]
    }

    /// Derivatives of the pixel by focal lengths, principal point and the lens's own numbers, where
    /// the lens brings the point to `distorted` and has the derivatives `of_lens` there.
    #[inline(always)]
    pub(super) fn slopes<N: Number, const LENS: usize>(
        &self,
        distorted: [N; 2],
        of_lens: [[N; 2]; LENS],
        slopes: &mut [[N; 2]],
    ) {
        let (zero, one) = (distorted[0].all(0.0), distorted[0].all(1.0));
        let own = [[distorted[0], zero], [zero, distorted[1]], [one, zero], [zero, one]];
        let Some((first, lens)) = slopes.split_first_chunk_mut::<4>() else { return };
        *first = own;
        for (slope, [x, y]) in lens.iter_mut().zip(of_lens) {
            *slope = [zero.all(self.focal[0]) * x, zero.all(self.focal[1]) * y];
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
