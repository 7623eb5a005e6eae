//! How a network and its base follow charts whose places were found.

use nalgebra::Matrix3x4;
use serde::{Deserialize, Serialize};

/// What the map does in one of the charts' independent motions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Mode {
    /// By how much the weights change.
    pub(super) weights: Vec<f64>,
    /// By how much the base's projection matrices do, a camera each; none without a base.
    pub(super) base: Vec<Matrix3x4<f64>>,
}

impl Mode {
    pub(super) fn is_consistent(&self, weights: usize, base: usize) -> bool {
        let numbers = self.weights.iter().chain(self.base.iter().flatten());
        self.weights.len() == weights
            && self.base.len() == base
            && numbers.into_iter().all(|value| value.is_finite())
    }
}
