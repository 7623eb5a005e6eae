//! Standard deviations of disparities.

use crate::coefficients::{REFINED, UNREFINED};

/// From what residuals of least squares tell.
pub(crate) fn refined(from_residuals: &[f32], scatter: &[f32], confidence: &[f32]) -> Vec<f32> {
    let [factor, least, per_scatter, per_doubt] = REFINED;
    let all = from_residuals.iter().zip(scatter).zip(confidence);
    all.map(|((sigma, scatter), confidence)| {
        let sigma = factor * sigma;
        let of_surface = (sigma * sigma + least * least).sqrt() * (1.0 + per_scatter * scatter);
        of_surface + per_doubt * (1.0 - confidence)
    })
    .collect()
}

/// Of disparities that aggregation found.
pub(crate) fn unrefined(scatter: &[f32], confidence: &[f32]) -> Vec<f32> {
    let [least, per_scatter] = UNREFINED;
    let both = scatter.iter().zip(confidence);
    both.map(
        |(scatter, &confidence)| {
            if confidence > 0.0 { least + per_scatter * scatter } else { f32::NAN }
        },
    )
    .collect()
}
