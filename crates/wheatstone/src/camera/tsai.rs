//! Tsai's camera: a pinhole whose picture must be stretched radially to become ideal.
//!
//! Source: Tsai 1987 (doi:10.1109/JRA.1987.1087109), with the first coefficient only, as the paper
//! recommends. The distortion is told from the distorted place to the ideal one, the other way round
//! than in Brown's model.

use super::{AdjustableCamera, CameraModel, pinhole::Pinhole};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use nalgebra::{Matrix2, Matrix2x3};
use serde::{Deserialize, Serialize};

/// Ideal radius = r (1 + kappa r^2) for a distorted radius r, both on the plane z = 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tsai {
    /// Focal lengths and principal point; the ratio of the focal lengths is the paper's scale factor
    /// s_x.
    pub pinhole: Pinhole,
    /// The paper's kappa_1 times the squared focal length: no unit. Positive for barrel distortion.
    pub kappa: f64,
}

impl Default for Tsai {
    fn default() -> Self {
        Self { pinhole: Pinhole::default(), kappa: 0.2 }
    }
}

impl Tsai {
    /// The distorted radius of an ideal one and its derivative: the root of the cubic on the branch
    /// that starts at the axis, by Newton's method. `None` beyond the fold.
    fn distort(&self, ideal: f64) -> Option<(f64, f64)> {
        if self.kappa < 0.0 {
            // The cubic has its highest value, 2/3 of the radius there, at r^2 = -1 / (3 kappa).
            let fold = 1.0 / (-3.0 * self.kappa).sqrt();
            if ideal >= fold * (2.0 / 3.0) {
                return None;
            }
        }
        // From 0 upwards the cubic is concave (kappa < 0) and Newton's steps stay below the root;
        // it is convex otherwise and they stay above it once they are there.
        let mut radius = if self.kappa < 0.0 { 0.0 } else { ideal };
        for _ in 0..100 {
            let square = radius * radius;
            let step =
                (ideal - radius * (1.0 + self.kappa * square)) / (1.0 + 3.0 * self.kappa * square);
            radius += step;
            if step.abs() <= 1e-15 * radius {
                break;
            }
        }
        let slope = 1.0 + 3.0 * self.kappa * radius * radius;
        (slope > 0.0).then(|| (radius, 1.0 / slope))
    }

    /// Projects and, given a place for them, writes the derivatives by the parameters.
    fn trace(
        &self,
        point: Point3,
        slopes: Option<&mut [[f64; 2]]>,
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        if point.z <= 0.0 {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let ideal = (x * x + y * y).sqrt();
        let (radius, growth) = self.distort(ideal)?;
        let square = radius * radius;
        let factor = 1.0 / (1.0 + self.kappa * square);
        // (growth - factor) / ideal^2, without the quotient of two small numbers at the axis.
        let bend = -2.0 * self.kappa * growth * factor * factor * factor;
        let stretch =
            Matrix2::new(factor + x * x * bend, x * y * bend, x * y * bend, factor + y * y * bend);
        if let Some(slopes) = slopes {
            let by_kappa = -square * growth * factor;
            let lens = [[x * by_kappa, y * by_kappa]];
            self.pinhole.slopes([x * factor, y * factor], &lens, slopes);
        }
        let pixel = self.pinhole.pixel(x * factor, y * factor);
        Some((pixel, self.pinhole.by_point(&stretch, x, y, point.z)))
    }
}

impl CameraModel for Tsai {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, kappa } = self;
        pinhole.parameters_mut().into_iter().chain([kappa]).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        if point.z <= 0.0 {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let (radius, _) = self.distort((x * x + y * y).sqrt())?;
        let factor = 1.0 / (1.0 + self.kappa * radius * radius);
        Some(self.pinhole.pixel(x * factor, y * factor))
    }

    fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.trace(point, None)
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let [x, y] = self.pinhole.place(pixel);
        let square = x * x + y * y;
        if 1.0 + 3.0 * self.kappa * square <= 0.0 {
            return None;
        }
        let factor = 1.0 + self.kappa * square;
        let direction = Vector3::new(x * factor, y * factor, 1.0).normalize();
        Some(Ray { origin: Point3::origin(), direction })
    }
}

impl AdjustableCamera for Tsai {
    fn project_with_slopes(
        &self,
        point: Point3,
        slopes: &mut [[f64; 2]],
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.trace(point, Some(slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::slopes_agree_with_differences, *};

    #[test]
    fn slopes_are_those_of_the_projection() {
        for kappa in [0.2, -0.1, 0.0] {
            slopes_agree_with_differences(&Tsai { kappa, ..Tsai::default() });
        }
    }

    #[test]
    fn rays_come_back_until_the_fold() {
        for kappa in [0.3, -0.2] {
            let camera = Tsai { kappa, ..Tsai::default() };
            for pixel in [Pixel::new(0.0, 0.0), Pixel::new(500.0, 100.0), Pixel::new(319.5, 239.5)]
            {
                let back = camera.project(camera.ray(pixel).unwrap().at(7.0)).unwrap();
                assert!((back - pixel).norm() < 1e-9, "{kappa}: {back}");
            }
        }
        let folded = Tsai { kappa: -0.2, ..Tsai::default() };
        assert!(folded.project(Point3::new(0.9, 0.0, 1.0)).is_none());
    }
}
