//! Standard deviations of disparities.

use crate::coefficients::{PER_DOUBT, UNREFINED};

/// From here on more doubt means more gross errors, not larger errors of the other matches.
const MOST_DOUBT: f32 = 0.05;

/// By how much the standard deviation of a refined disparity of this confidence is larger than what its residuals tell: less
/// confident matches have larger errors.
#[must_use]
pub fn doubt_factor(confidence: f32) -> f32 {
    1.0 + PER_DOUBT * (1.0 - confidence).min(MOST_DOUBT)
}

/// What errors are of those that residuals tell where noise is independent, by clouds of rendered scenes behind seven optics
/// whose truth is exact.
const OF_TOLD: f32 = 0.84;

/// Of refined disparities, from what residuals of least squares tell, and by how much their noise scatters more than
/// independent one. NaN where there is no confidence.
pub(crate) fn refined(from_residuals: &[f32], confidence: &[f32], excess: f32) -> Vec<f32> {
    let both = from_residuals.iter().zip(confidence);
    both.map(|(sigma, &confidence)| {
        let sigma = OF_TOLD * excess * sigma * doubt_factor(confidence);
        if confidence > 0.0 { sigma } else { f32::NAN }
    })
    .collect()
}

/// Of disparities that aggregation found. NaN where there is no confidence.
pub(crate) fn unrefined(scatter: &[f32], confidence: &[f32]) -> Vec<f32> {
    let [least, per_scatter] = UNREFINED;
    let both = scatter.iter().zip(confidence);
    both.map(|(scatter, &confidence)| {
        let sigma = least + per_scatter * scatter;
        if confidence > 0.0 { sigma } else { f32::NAN }
    })
    .collect()
}
