//! What only a fitted model tells of the data: parameters that they hardly determine, and optics that nobody has.

use super::finding::{Finding, Severity};
use crate::{
    dataset::Dataset,
    method::{AnyReconstructor, Intrinsics},
};

/// Faults that show in what was fitted to `data`; `chosen` says whether nobody asked for this camera model: who asks for
/// tilted sensors has them.
pub(crate) fn of_fit(map: &AnyReconstructor, data: &Dataset, chosen: bool) -> Vec<Finding> {
    let oblique = if chosen && !data.has_estimated_poses() { oblique_stage(map) } else { None };
    few_points(map, data).into_iter().chain(oblique).collect()
}

/// So few points that error bars, which take what was fitted for the truth plus noise, are too short.
fn few_points(map: &AnyReconstructor, data: &Dataset) -> Option<Finding> {
    /// Points for each that the parameters take up: simulated lenses' 95 % ellipsoids then hold 91 to 93 %.
    const ENOUGH: f64 = 4.0;
    let taken_up = map.effective_parameters()?;
    let (points, wanted) = (data.known().count(), (ENOUGH * taken_up).ceil());
    let numbers = 2.0 * data.cameras as f64 * taken_up;
    ((points as f64) < wanted).then(|| Finding {
        figures: vec![("points".into(), points as f64), ("parameters".into(), numbers)],
        stays_in_fit: true,
        ..Finding::of_all(
            "few-points",
            Severity::Warning,
            format!(
                "{points} points are few for the {numbers:.0} parameters of this model: error bars may be too small, by more the farther from the points"
            ),
            format!("show {wanted:.0} points or more, and evaluate the model on points that were not fitted"),
        )
    })
}

/// Lenses that are all decentred, or sensors that are all tilted: so do ordinary cameras look by a stage that moves
/// obliquely to the plate.
fn oblique_stage(map: &AnyReconstructor) -> Option<Finding> {
    /// What ordinary cameras stay below: the six lenses of the public pairs `boofcv-bumblebee2`, `calibration-rs-stereo`
    /// and `opencv-chessboard` have tangential coefficients of 0.0007 to 0.0025. Sensors may be tilted by a degree, which
    /// displaces pixels as a coefficient of a third of that angle does.
    const ORDINARY: [(&str, f64); 2] = [("tau", 0.02), ("p", 0.004)];
    let cameras = map.intrinsics()?;
    let excess = |camera: &Intrinsics| {
        let each = ORDINARY.map(|(name, most)| certain(camera, name) / most);
        each.into_iter().fold(0.0, f64::max)
    };
    let excess: Vec<f64> = cameras.iter().map(excess).collect();
    excess.iter().all(|excess| *excess > 1.0).then(|| Finding {
        figures: vec![("decentring or tilt over that of ordinary cameras, least of all".into(), excess.iter().copied().fold(f64::INFINITY, f64::min))],
        stays_in_fit: true,
        ..Finding::of_all(
            "stage-oblique",
            Severity::Information,
            "every camera appears to have a decentred lens or a tilted sensor, as behind oblique windows: ordinary cameras do only where the stage moves at another angle to the chart than the coordinates say".into(),
            "measure the angle between the chart and the axis of the stage; tilted (Scheimpflug) sensors, and windows that stand oblique, are no fault",
        )
    })
}

/// The length of the parameters of such names and a number; none counts that is uncertain by a fifth or more.
fn certain(camera: &Intrinsics, name: &str) -> f64 {
    let told = camera.parameters.iter().filter(|it| it.name.starts_with(name));
    let certain = told.filter(|it| it.sigma.is_some_and(|sigma| it.value.abs() > 5.0 * sigma));
    certain.map(|it| it.value * it.value).sum::<f64>().sqrt()
}
