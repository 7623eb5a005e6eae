//! How large errors are.

use serde::Serialize;
use wheatstone_numeric::statistics::{median, percentile, root_mean_square};

/// Sizes of errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorSummary {
    /// How many.
    pub n: usize,
    /// Half are smaller.
    pub median: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// 95 % are smaller.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

impl ErrorSummary {
    /// Of sizes; `None` for none.
    pub(super) fn of(values: Vec<f64>) -> Option<Self> {
        (!values.is_empty()).then(|| Self {
            n: values.len(),
            median: median(&values),
            rms: root_mean_square(&values),
            p95: percentile(&values, 0.95),
            max: values.iter().copied().fold(0.0, f64::max),
        })
    }
}
