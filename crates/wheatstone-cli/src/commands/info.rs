//! `wheatstone info`.

use super::print_json;
use crate::{
    failure::Outcome,
    table::{figure, table},
    verbosity::say,
};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use wheatstone::{
    Calibration,
    geometry::Point3,
    method::{IntrinsicParameter, Intrinsics},
};

/// Show what a model is: held-out error, intrinsics with standard deviations, camera poses
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone info model.json\n  wheatstone info model.json --json\n\n\
    Only `brown` and `kannala-brandt` have intrinsics; `export` approximates other models by such a camera."
)]
pub(crate) struct Info {
    /// The model file
    model: PathBuf,
    /// Print it as JSON, with the correlations of all intrinsic parameters
    #[arg(long)]
    json: bool,
}

/// Correlations of at least this size are shown.
const CLOSE: f64 = 0.9;

impl Info {
    pub(crate) fn run(self) -> Outcome {
        let model = Calibration::load(&self.model)?;
        let cameras = model.reconstructor.intrinsics();
        if self.json {
            return print_json(&json!({
                "method": method(&model),
                "unit": model.unit,
                "cameras": model.reconstructor.cameras(),
                "fitted_points": model.training.located,
                "fitted_rms": model.training.rms,
                "held_out": model.validation.as_ref().map(|validation| &validation.all),
                "intrinsics": cameras,
                "baselines": cameras.as_deref().map(baselines),
            }));
        }
        tell(&model);
        for (index, camera) in cameras.iter().flatten().enumerate() {
            say!("\nCamera {}\n\n{}", index + 1, parameters(camera).trim_end());
            tell_correlations(camera);
            let [x, y, z] = camera.centre.map(figure);
            say!("Projection centre at X {x}, Y {y}, Z {z} {}", model.unit);
        }
        for (index, baseline) in cameras.as_deref().map(baselines).iter().flatten().enumerate() {
            say!("Baseline of cameras 1 and {}: {} {}", index + 2, figure(*baseline), model.unit);
        }
        Ok(())
    }
}

/// The method that was fitted.
fn method(model: &Calibration) -> &str {
    model.choice.as_ref().map_or_else(|| model.method.name(), |choice| &choice.chosen)
}

fn tell(model: &Calibration) {
    let (name, cameras, unit) = (method(model), model.reconstructor.cameras(), &model.unit);
    let chosen = if model.choice.is_some() { ", chosen by auto" } else { "" };
    say!("Method {name}{chosen}; cameras: {cameras}; lengths in {unit}");
    if let Some(imported) = &model.imported {
        say!("Imported from {}: its accuracy is unknown", imported.format);
        return;
    }
    let error_unit = &model.training.unit;
    say!(
        "Fitted to {} points; error on these points {} {error_unit} rms",
        model.training.located,
        figure(model.training.rms)
    );
    match &model.validation {
        Some(validation) => say!(
            "Held-out error (leave-one-view-out): {} {error_unit} rms",
            figure(validation.all.rms)
        ),
        None => say!("Not cross-validated: the held-out error is unknown"),
    }
    if model.reconstructor.intrinsics().is_none() {
        say!("This model has no intrinsics: `export` approximates it by a parametric camera");
    }
}

fn parameters(camera: &Intrinsics) -> String {
    let row = |parameter: &IntrinsicParameter| {
        let sigma = parameter.sigma.map_or_else(|| "fixed".into(), figure);
        let value = match parameter.name {
            "fx" | "fy" | "cx" | "cy" => format!("{:.3}", parameter.value),
            _ => format!("{:.6}", parameter.value),
        };
        vec![parameter.name.into(), value, sigma]
    };
    let rows: Vec<Vec<String>> = camera.parameters.iter().map(row).collect();
    table(&["parameter", "value", "standard deviation"], &rows)
}

/// Names the pairs of parameters that the points hardly tell apart.
fn tell_correlations(camera: &Intrinsics) {
    let name = |index: usize| camera.parameters[index].name;
    let mut pairs = Vec::new();
    for (a, row) in camera.correlation.iter().enumerate() {
        let close = row.iter().enumerate().skip(a + 1).filter(|(_, value)| value.abs() >= CLOSE);
        pairs.extend(close.map(|(b, value)| format!("{} and {} {value:.2}", name(a), name(b))));
    }
    if !pairs.is_empty() {
        say!("Strong correlations: {}", pairs.join(", "));
    }
}

/// Distances of the other cameras from the first.
fn baselines(cameras: &[Intrinsics]) -> Vec<f64> {
    let centre = |camera: &Intrinsics| Point3::from(camera.centre);
    let first = cameras.first().map(centre);
    let distance = |camera| Some((centre(camera) - first?).norm());
    cameras.iter().skip(1).filter_map(distance).collect()
}
