//! Where the errors of the network's points come from.

use crate::method::PixelNoise;
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Where the errors of located points come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "of", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Noise {
    /// Each target has a variance of its own, in scaled units, the same everywhere.
    Targets { variance: [f64; 3] },
    /// All cameras' pixels have the same variance, which may depend on the direction.
    Pixels { noise: PixelNoise },
}

impl Noise {
    pub(super) fn is_consistent(&self) -> bool {
        match self {
            Self::Targets { variance } => {
                variance.iter().all(|value| *value >= 0.0 && value.is_finite())
            }
            Self::Pixels { noise } => noise.is_consistent(),
        }
    }
}

/// Where a point with these targets is seen from the cameras' middle.
pub(super) fn direction([across, down, _]: [f64; 3]) -> Point2<f64> {
    Point2::new(across, down)
}
