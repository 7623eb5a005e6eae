//! Lenses that are known from before.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// A lens of an earlier calibration, and what was uncertain of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownLens<L> {
    /// The lens.
    pub model: L,
    /// Its uncertain numbers, as the lens lists them; none for a lens that is taken for exact.
    pub(super) numbers: Vec<usize>,
    /// Their covariance, row by row.
    pub(super) covariance: Vec<f64>,
}

impl<L> KnownLens<L> {
    /// A lens that is taken for exact.
    #[must_use]
    pub fn exact(model: L) -> Self {
        Self { model, numbers: Vec::new(), covariance: Vec::new() }
    }

    /// The covariance of its uncertain numbers.
    pub(super) fn matrix(&self) -> DMatrix<f64> {
        let count = self.numbers.len();
        let at = |row, column| self.covariance.get(row * count + column).copied().unwrap_or(0.0);
        DMatrix::from_fn(count, count, at)
    }
}
