//! The fisheye whose picture radius is an odd polynomial of the angle from the axis.
//!
//! Source: Kannala & Brandt 2006 (doi:10.1109/TPAMI.2006.153), in the four-coefficient form that
//! OpenCV's fisheye module uses.

use super::{
    composed::Composed, distortion::Polynomial, pinhole::Pinhole, projection::Equidistant,
};
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

impl Composed for KannalaBrandt {
    type Projection = Equidistant;
    type Distortion = Polynomial;

    #[inline(always)]
    fn distortion(&self) -> Polynomial {
        Polynomial(self.coefficients)
    }

    #[inline(always)]
    fn pinhole(&self) -> &Pinhole {
        &self.pinhole
    }

    fn numbers_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, coefficients } = self;
        pinhole.numbers_mut().into_iter().chain(coefficients).collect()
    }
}
