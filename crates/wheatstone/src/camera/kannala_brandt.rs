//! The fisheye whose picture radius is an odd polynomial of the angle from the axis.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153), in the four-coefficient form that
//! OpenCV's fisheye module uses.

use super::{CameraModel, pinhole::Pinhole};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use serde::{Deserialize, Serialize};

/// Radius = focal * (t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9) for the angle t from the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KannalaBrandt {
    /// Focal lengths and principal point.
    pub pinhole: Pinhole,
    /// k1 to k4.
    pub coefficients: [f64; 4],
}

impl Default for KannalaBrandt {
    fn default() -> Self {
        Self {
            pinhole: Pinhole { focal: [260.0, 260.0], principal: [319.5, 239.5] },
            coefficients: [-0.02, 0.004, -0.003, 0.0005],
        }
    }
}

impl KannalaBrandt {
    /// The distorted angle and its derivative.
    fn distort(&self, angle: f64) -> (f64, f64) {
        let t2 = angle * angle;
        let [k1, k2, k3, k4] = self.coefficients;
        (
            angle * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))),
            1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4))),
        )
    }
}

impl CameraModel for KannalaBrandt {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, coefficients } = self;
        pinhole.parameters_mut().into_iter().chain(coefficients).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        let radius = (point.x * point.x + point.y * point.y).sqrt();
        if radius == 0.0 {
            return (point.z > 0.0).then(|| self.pinhole.pixel(0.0, 0.0));
        }
        let (distorted, slope) = self.distort(libm::atan2(radius, point.z));
        let scale = distorted / radius;
        (slope > 0.0).then(|| self.pinhole.pixel(point.x * scale, point.y * scale))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let [x, y] = self.pinhole.place(pixel);
        let radius = (x * x + y * y).sqrt();
        let mut angle = radius;
        for _ in 0..50 {
            let (distorted, slope) = self.distort(angle);
            let step = (radius - distorted) / slope;
            // Half a radian a step keeps Newton on the branch that starts at the axis.
            angle += step.clamp(-0.5, 0.5);
            if step.abs() < 1e-15 {
                break;
            }
        }
        let (distorted, slope) = self.distort(angle);
        if slope <= 0.0 || (distorted - radius).abs() > 1e-11 || angle > std::f64::consts::PI {
            return None;
        }
        let sine = if radius > 0.0 { libm::sin(angle) / radius } else { 0.0 };
        let direction = Vector3::new(x * sine, y * sine, libm::cos(angle));
        Some(Ray { origin: Point3::origin(), direction: direction.normalize() })
    }
}
