//! Why there is no point.

use super::depths::searched;
use crate::failure::Failure;
use wheatstone::{
    Calibration, Error,
    reconstruction::{Emptied, SceneReconstructor},
};

/// Why there is no point, and what to do about it.
pub(super) struct Empty {
    pub(super) problem: String,
    way_out: String,
}

impl Empty {
    /// Of the limit that took the last points away, of matches that were `given` or of our own.
    pub(super) fn of(
        emptied: Emptied,
        (made, model): (&SceneReconstructor, &Calibration),
        given: bool,
    ) -> Self {
        let depths = searched(made, model);
        let settings = made.settings();
        let region = if settings.region.is_some() { " in the region" } else { "" };
        let (problem, way_out) = match emptied {
            Emptied::NothingMatched if given => (
                format!(
                    "none of the matches means a point{region}: pixels are far from their epipolar lines, or points \
                     outside of the pictures and the depths of {depths}"
                ),
                "`--range NEAR:FAR` names other depths; are the columns in the order of the model's cameras?",
            ),
            Emptied::NothingMatched | Emptied::Region => (
                format!("no pixel is matched{region} at depths of {depths}"),
                if region.is_empty() {
                    "`--range NEAR:FAR` names other depths"
                } else {
                    "`--region X,Y,W,H` names another part of the left camera's picture, `--range NEAR:FAR` other depths"
                },
            ),
            Emptied::Confidence => (
                format!(
                    "no point{region} is right with a probability of {} or more",
                    settings.least_confidence
                ),
                "`--confidence P` takes points with a smaller one",
            ),
            Emptied::StandardDeviation => (
                format!(
                    "no point{region} has standard deviations of X, Y and Z of at most {} {}",
                    settings.most_sigma.unwrap_or_default(),
                    model.unit
                ),
                "name a larger length with `--max-sigma`; without that option it is said how large they are",
            ),
            _ => (
                format!("no match{region} has a point in front of the cameras"),
                "are the pictures in the order of `--cameras`? Were the cameras moved since the calibration?",
            ),
        };
        Self { problem, way_out: format!("nothing was written; {way_out}") }
    }
}

impl From<Empty> for Failure {
    fn from(Empty { problem, way_out }: Empty) -> Self {
        Self::Library(Error::Degenerate { problem, hint: way_out.into() })
    }
}
