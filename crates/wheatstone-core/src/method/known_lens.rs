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

    /// With what is uncertain of numbers that were left out, added to what is uncertain of its own: those numbers, its own
    /// among them, and the covariance that is added.
    pub(super) fn with_omitted(
        self,
        (numbers, mut covariance): (Vec<usize>, DMatrix<f64>),
    ) -> Self {
        let own = self.matrix();
        let place = |number: &usize| numbers.iter().position(|other| other == number);
        for (row, to_row) in self.numbers.iter().map(place).enumerate() {
            for (column, to_column) in self.numbers.iter().map(place).enumerate() {
                let (Some(to_row), Some(to_column)) = (to_row, to_column) else { return self };
                covariance[(to_row, to_column)] += own[(row, column)];
            }
        }
        Self { covariance: covariance.transpose().as_slice().to_vec(), numbers, ..self }
    }

    /// The covariance of its uncertain numbers.
    pub(super) fn matrix(&self) -> DMatrix<f64> {
        let count = self.numbers.len();
        let at = |row, column| self.covariance.get(row * count + column).copied().unwrap_or(0.0);
        DMatrix::from_fn(count, count, at)
    }
}
