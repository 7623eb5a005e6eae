//! Ranges of depths, read and told.

use crate::table::figure;
use wheatstone::{Calibration, reconstruction::SceneReconstructor};

/// `300:1500`.
pub(in crate::commands) fn depths(text: &str) -> Result<[f64; 2], String> {
    let parts = text.split_once(':').map(|(a, b)| (a.trim().parse(), b.trim().parse()));
    match parts {
        Some((Ok(near), Ok(far))) => Ok([near, far]),
        _ => Err("write the nearest and the farthest depth as 300:1500".into()),
    }
}

/// `50 to 130 cm`.
pub(in crate::commands) fn searched(made: &SceneReconstructor, model: &Calibration) -> String {
    let [near, far] = made.depths();
    let far = if far.is_finite() { figure(far) } else { "infinity".into() };
    format!("{} to {far} {}", figure(near), model.unit)
}
