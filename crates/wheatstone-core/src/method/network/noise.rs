//! Where the errors of the network's points come from.

use crate::method::PixelNoise;
use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// The target whose errors are those of the pixels: the distance follows from small differences of directions, so
/// that what a network misses of the optics is little beside the noise.
pub(super) const DISTANCE: usize = 2;

/// Where the errors of located points come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "of", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Noise {
    /// Each target has a variance of its own, in scaled units, the same everywhere.
    Targets { variance: [f64; 3] },
    /// All cameras' pixels have the same variance, which may depend on the direction. Of older files.
    Pixels { noise: PixelNoise },
    /// Noise of the pixels, and what the network misses of the optics: it errs more in directions, which pixels fix
    /// well, than in the distance.
    PixelsByTarget {
        /// The variance of a pixel coordinate that explains the errors of each target, as a function of its
        /// [`place`].
        by_target: [PixelNoise; 3],
        /// Variance of each target's errors that the covariance of the weights goes by, in scaled units, the same
        /// everywhere.
        trained: [f64; 3],
        /// Variance of a pixel coordinate about cameras fitted to the same points, where there are such: what the errors
        /// of the distance are beyond it, the network misses there too.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pixel: Option<f64>,
    },
}

impl Noise {
    /// Standard deviation that is assumed of a pixel coordinate of a point with these targets.
    pub(super) fn pixel_sigma(&self, targets: [f64; 3]) -> Option<f64> {
        match self {
            Self::Targets { .. } => None,
            Self::Pixels { noise } => Some(noise.variance(direction(targets)).sqrt()),
            Self::PixelsByTarget { by_target, pixel, .. } => {
                let explained = by_target[DISTANCE].variance(place(targets));
                Some(pixel.map_or(explained, |pixel| pixel.min(explained)).sqrt())
            }
        }
    }

    pub(super) fn is_consistent(&self) -> bool {
        let positive = |values: &[f64; 3]| values.iter().all(|v| *v >= 0.0 && v.is_finite());
        match self {
            Self::Targets { variance } => positive(variance),
            Self::Pixels { noise } => noise.is_consistent(),
            Self::PixelsByTarget { by_target, trained, pixel } => {
                by_target.iter().all(PixelNoise::is_consistent)
                    && positive(trained)
                    && pixel.is_none_or(|pixel| pixel >= 0.0 && pixel.is_finite())
            }
        }
    }
}

/// Where a point with these targets is seen from the cameras' middle.
pub(super) fn direction([across, down, _]: [f64; 3]) -> Point2<f64> {
    Point2::new(across, down)
}

/// How far aside it is seen, and how near it is.
pub(super) fn place([across, down, near]: [f64; 3]) -> Point2<f64> {
    Point2::new((across * across + down * down).sqrt(), near)
}
