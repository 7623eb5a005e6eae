//! What only a fitted model tells of the data: parameters that they hardly determine, and optics that nobody has.

use super::finding::{Finding, Severity};
use crate::{
    dataset::Dataset,
    method::{AnyReconstructor, Intrinsics},
};

/// Faults that show in what was fitted to `data`; `chosen` says whether nobody asked for this camera model: who asks for
/// tilted sensors has them.
pub(crate) fn of_fit(map: &AnyReconstructor, data: &Dataset, chosen: bool) -> Vec<Finding> {
    let oblique = if chosen && !data.has_estimated_poses() {
        tilted_sensors(map).or_else(|| oblique_stage(map))
    } else {
        None
    };
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

/// Sensors that `auto` tilted, as pixels ask for that. They do so at stages that move obliquely, too, and where steps of
/// the stage are wrong by a factor: errors are then up to a hundred times what is told.
fn tilted_sensors(map: &AnyReconstructor) -> Option<Finding> {
    let mut parameters = map.intrinsics()?.into_iter().flat_map(|camera| camera.parameters);
    parameters.any(|it| it.name.starts_with("tau") && it.sigma.is_some()).then(|| Finding {
        stays_in_fit: true,
        ..Finding::of_all(
            "tilted-sensors",
            Severity::Warning,
            "the sensors appear to be tilted against their lenses: if no camera has a Scheimpflug mount, the stage moves at another angle to the chart, or by other steps, than the coordinates say".into(),
            "measure the stage's steps and its angle to the chart; if the sensors are tilted, ask for that model by name (`brown`, preset `tilt`)",
        )
    })
}

/// Lenses that are all decentred: so do ordinary cameras look by a stage that moves obliquely to the plate.
fn oblique_stage(map: &AnyReconstructor) -> Option<Finding> {
    /// What tangential coefficients of ordinary cameras stay below: those of the six lenses of the public pairs
    /// `boofcv-bumblebee2`, `calibration-rs-stereo` and `opencv-chessboard` come to 0.0007 to 0.0025.
    const ORDINARY: f64 = 0.004;
    let decentring: Vec<f64> = map.intrinsics()?.iter().map(certain_decentring).collect();
    decentring.iter().all(|decentring| *decentring > ORDINARY).then(|| Finding {
        figures: vec![(
            "tangential coefficients, least of all cameras".into(),
            decentring.iter().copied().fold(f64::INFINITY, f64::min),
        )],
        stays_in_fit: true,
        ..Finding::of_all(
            "stage-oblique",
            Severity::Information,
            "every camera appears to have a decentred lens, as behind oblique windows: ordinary cameras do only where the stage moves at another angle to the chart than the coordinates say".into(),
            "measure the angle between the chart and the axis of the stage; windows that stand oblique are no fault",
        )
    })
}

/// The length of the tangential coefficients; none counts that is uncertain by a fifth or more.
fn certain_decentring(camera: &Intrinsics) -> f64 {
    let told = camera.parameters.iter().filter(|it| it.name.starts_with('p'));
    let certain = told.filter(|it| it.sigma.is_some_and(|sigma| it.value.abs() > 5.0 * sigma));
    certain.map(|it| it.value * it.value).sum::<f64>().sqrt()
}
