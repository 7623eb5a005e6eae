//! The pinhole behind a lens with radial and tangential distortion.
//!
//! Source: D. C. Brown 1971, "Close-range camera calibration", Photogrammetric Engineering 37(8);
//! coefficients as OpenCV numbers them (k1, k2, k3 radial, p1, p2 tangential).

use super::{CameraModel, pinhole::Pinhole};
use crate::geometry::{Pixel, Point3};
use serde::{Deserialize, Serialize};

/// A pinhole behind a distorting lens.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrownConrady {
    /// The ideal part.
    pub pinhole: Pinhole,
    /// k1, k2, k3: radial, of second, fourth and sixth order.
    pub radial: [f64; 3],
    /// p1, p2: tangential.
    pub tangential: [f64; 2],
}

impl Default for BrownConrady {
    fn default() -> Self {
        Self { pinhole: Pinhole::default(), radial: [-0.2, 0.05, 0.0], tangential: [1e-3, -5e-4] }
    }
}

impl CameraModel for BrownConrady {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, radial, tangential } = self;
        pinhole.parameters_mut().into_iter().chain(radial).chain(tangential).collect()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        if point.z <= 0.0 {
            return None;
        }
        let (x, y) = (point.x / point.z, point.y / point.z);
        let r2 = x * x + y * y;
        let [k1, k2, k3] = self.radial;
        // Where the distorted radius no longer grows, the polynomial folds the picture over.
        if 1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3)) <= 0.0 {
            return None;
        }
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let [p1, p2] = self.tangential;
        Some(self.pinhole.pixel(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ))
    }
}
