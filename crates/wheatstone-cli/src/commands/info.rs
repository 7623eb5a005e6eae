//! `wheatstone info`.

use super::print_json;
use crate::{
    failure::Outcome,
    table::{figure, table},
};
use clap::Args;
use serde_json::json;
use std::{io::Write, path::PathBuf};
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
                "point_noise": model.point_noise,
                "intrinsics": cameras,
                "baselines": cameras.as_deref().map(baselines),
            }));
        }
        let unit = &model.unit;
        let mut text = heading(&model);
        for (index, camera) in cameras.iter().flatten().enumerate() {
            let [x, y, z] = camera.centre.map(figure);
            text += &format!("\nCamera {}\n\n{}", index + 1, parameters(camera));
            text += &correlations(camera);
            text += &format!("Projection centre at X {x}, Y {y}, Z {z} {unit}\n");
        }
        for (index, baseline) in cameras.as_deref().map(baselines).iter().flatten().enumerate() {
            let baseline = figure(*baseline);
            text += &format!("Baseline of cameras 1 and {}: {baseline} {unit}\n", index + 2);
        }
        std::io::stdout().write_all(text.as_bytes())?;
        Ok(())
    }
}

/// The method that was fitted.
fn method(model: &Calibration) -> &str {
    model.choice.as_ref().map_or_else(|| model.method.name(), |choice| &choice.chosen)
}

/// What it is and how good.
fn heading(model: &Calibration) -> String {
    let (name, cameras, unit) = (method(model), model.reconstructor.cameras(), &model.unit);
    let chosen = if model.choice.is_some() { ", chosen by auto" } else { "" };
    let mut text = format!("Method {name}{chosen}; cameras: {cameras}; lengths in {unit}\n");
    if let Some(imported) = &model.imported {
        return text + &format!("Imported from {}: its accuracy is unknown\n", imported.format);
    }
    let error_unit = &model.training.unit;
    text += &format!(
        "Fitted to {} points; error on these points {} {error_unit} rms\n",
        model.training.located,
        figure(model.training.rms)
    );
    text += &match &model.validation {
        Some(validation) => {
            let rms = figure(validation.all.rms);
            format!("Held-out error (leave-one-view-out): {rms} {error_unit} rms\n")
        }
        None => "Not cross-validated: the held-out error is unknown\n".into(),
    };
    if let Some(noise) = model.point_noise {
        let freedom = noise.freedom();
        text += &format!(
            "Pixel noise differs from point to point: Student's t with {freedom:.1} degrees of freedom\n"
        );
    }
    if model.reconstructor.intrinsics().is_none() {
        text += "This model has no intrinsics: `export` approximates it by a parametric camera\n";
    }
    text
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

/// The pairs of parameters that the points hardly tell apart.
fn correlations(camera: &Intrinsics) -> String {
    let name = |index: usize| camera.parameters[index].name;
    let mut pairs = Vec::new();
    for (a, row) in camera.correlation.iter().enumerate() {
        let close = row.iter().enumerate().skip(a + 1).filter(|(_, value)| value.abs() >= CLOSE);
        pairs.extend(close.map(|(b, value)| format!("{} and {} {value:.2}", name(a), name(b))));
    }
    if pairs.is_empty() {
        return String::new();
    }
    format!("Strong correlations: {}\n", pairs.join(", "))
}

/// Distances of the other cameras from the first.
fn baselines(cameras: &[Intrinsics]) -> Vec<f64> {
    let centre = |camera: &Intrinsics| Point3::from(camera.centre);
    let first = cameras.first().map(centre);
    let distance = |camera| Some((centre(camera) - first?).norm());
    cameras.iter().skip(1).filter_map(distance).collect()
}
