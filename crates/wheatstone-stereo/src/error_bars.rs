//! Standard deviations of disparities.

use crate::coefficients::{REFINED, UNREFINED};

/// Of refined disparities, from what residuals of least squares tell. NaN where there is no confidence.
pub(crate) fn refined(from_residuals: &[f32], scatter: &[f32], confidence: &[f32]) -> Vec<f32> {
    let [factor, per_scatter] = REFINED;
    let all = from_residuals.iter().zip(scatter).zip(confidence);
    all.map(|((sigma, scatter), &confidence)| {
        let sigma = factor * sigma * (1.0 + per_scatter * scatter);
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
