//! The pinhole behind a lens with radial, tangential and thin-prism distortion, before a sensor that may be
//! tilted.
//!
//! The numbering of all coefficients is OpenCV's (k1 to k6, p1, p2, s1 to s4, tauX, tauY); sources are
//! named where the parts are.

use super::{composed::Composed, distortion::Rational, pinhole::Pinhole, projection::Perspective};
use serde::{Deserialize, Serialize};

/// A pinhole behind a distorting lens. A place `(x, y)` on the plane z = 1, at squared radius s, goes
/// to `(x, y) (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)` and from there by the
/// tangential and prism terms, then onto the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrownConrady {
    /// The ideal part.
    pub pinhole: Pinhole,
    /// k1, k2, k3: radial, of second, fourth and sixth order.
    pub radial: [f64; 3],
    /// p1, p2: tangential.
    pub tangential: [f64; 2],
    /// k4, k5, k6: the denominator of the radial part.
    #[serde(default)]
    pub rational: [f64; 3],
    /// s1 to s4: thin prism, of second and fourth order along x, then along y.
    #[serde(default)]
    pub prism: [f64; 4],
    /// tauX, tauY: the angles in radians by which the sensor is turned about x, then about y, as in a camera
    /// after Scheimpflug.
    #[serde(default, skip_serializing_if = "is_upright")]
    pub tilt: [f64; 2],
}

fn is_upright(tilt: &[f64; 2]) -> bool {
    *tilt == [0.0; 2]
}

impl Default for BrownConrady {
    fn default() -> Self {
        Self {
            radial: [-0.2, 0.05, 0.0],
            tangential: [1e-3, -5e-4],
            ..Self::ideal(Pinhole::default())
        }
    }
}

impl BrownConrady {
    /// A lens that does not distort.
    #[must_use]
    pub fn ideal(pinhole: Pinhole) -> Self {
        Self {
            pinhole,
            radial: [0.0; 3],
            tangential: [0.0; 2],
            rational: [0.0; 3],
            prism: [0.0; 4],
            tilt: [0.0; 2],
        }
    }
}

impl Composed for BrownConrady {
    type Projection = Perspective;
    type Distortion = Rational;

    #[inline(always)]
    fn distortion(&self) -> Rational {
        let Self { radial, tangential, rational, prism, .. } = *self;
        Rational { above: radial, tangential, below: rational, prism }
    }

    #[inline(always)]
    fn pinhole(&self) -> &Pinhole {
        &self.pinhole
    }

    #[inline(always)]
    fn tilt(&self) -> Option<[f64; 2]> {
        Some(self.tilt)
    }

    fn numbers_mut(&mut self) -> Vec<&mut f64> {
        let Self { pinhole, radial, tangential, rational, prism, tilt } = self;
        let lens = radial.iter_mut().chain(tangential).chain(rational).chain(prism).chain(tilt);
        pinhole.numbers_mut().into_iter().chain(lens).collect()
    }
}
