//! `wheatstone info`.

use super::print_json;
use crate::{
    failure::Outcome,
    table::{figure, table},
};
use clap::Args;
use serde_json::{Value, json};
use std::{io::Write, path::PathBuf};
use wheatstone::{
    Calibration,
    geometry::{Point3, ProjectionMatrix, Vector3},
    method::{IntrinsicParameter, Intrinsics},
};

/// Show what a model is: what it was fitted to, held-out error, intrinsics with standard deviations,
/// camera poses
#[derive(Args)]
#[command(
    after_help = "Examples:\n  wheatstone info model.json\n  wheatstone info model.json --json\n\n\
    Methods without cameras (`network`, `soloff`, `interpolation`) have no intrinsics: where their cameras\n\
    stand is found by the direct linear transformation; `export` approximates them by parametric cameras."
)]
pub(crate) struct Info {
    /// The model file
    model: PathBuf,
    /// Print it as JSON, with the correlations of all intrinsic parameters
    #[arg(long)]
    json: bool,
    /// Show a model even if its checksum does not match
    #[arg(long)]
    force: bool,
}

/// Correlations of at least this size are shown.
const CLOSE: f64 = 0.9;

/// What is less than this share of the baseline is rounding: the camera stands at 0.
const NEGLIGIBLE: f64 = 1e-6;

/// What the three decimals of a direction do not show.
const UNSEEN: f64 = 5e-4;

/// Where a camera stands, and the direction in which it looks: a unit vector.
struct Stand {
    centre: Point3,
    axis: Vector3,
}

/// A camera beside the first.
struct Beside {
    baseline: f64,
    baseline_sigma: Option<f64>,
    /// Between the optical axes, in degrees.
    axes: f64,
    axes_sigma: Option<f64>,
    /// Between the lines from the middle of the points to both cameras, in degrees; none without points.
    rays: Option<f64>,
}

impl Info {
    pub(crate) fn run(self) -> Outcome {
        let load = if self.force { Calibration::load_damaged } else { Calibration::load };
        let model = load(&self.model)?;
        let cameras = model.reconstructor.intrinsics();
        let stands = stands(&model, cameras.as_deref());
        let beside = stands.as_deref().map(|stands| beside(stands, &model));
        if self.json {
            return print_json(&as_json(&model, cameras.as_deref(), beside.as_deref()));
        }
        let unit = &model.unit;
        let baselines = beside.iter().flatten().map(|beside| beside.baseline);
        let least = NEGLIGIBLE * baselines.fold(0.0, f64::max);
        let mut text = heading(&model, cameras.is_some());
        for (index, stand) in stands.iter().flatten().enumerate() {
            text += &format!("\nCamera {}\n", index + 1);
            if let Some(camera) = cameras.as_ref().and_then(|cameras| cameras.get(index)) {
                text += &format!("\n{}{}", parameters(camera), correlations(camera));
            }
            let [x, y, z] = [0, 1, 2].map(|axis| figure(or_zero(stand.centre[axis], least)));
            let [u, v, w] =
                [0, 1, 2].map(|axis| format!("{:.3}", or_zero(stand.axis[axis], UNSEEN)));
            text += &format!(
                "Projection centre at X {x}, Y {y}, Z {z} {unit}; optical axis along {u}, {v}, {w}\n"
            );
        }
        for (index, beside) in beside.iter().flatten().enumerate() {
            let rays = beside.rays.map_or(String::new(), |angle| {
                format!(", {angle:.2} degrees between them from the middle of the points")
            });
            let [baseline, axes] = [beside.baseline_sigma, beside.axes_sigma].map(|sigma| {
                sigma.map_or_else(String::new, |sigma| format!(" ± {}", figure(sigma)))
            });
            text += &format!(
                "Baseline of cameras 1 and {}: {}{baseline} {unit}; optical axes {:.3}{axes} degrees apart{rays}\n",
                index + 2,
                figure(beside.baseline),
                beside.axes
            );
        }
        std::io::stdout().write_all(text.as_bytes())?;
        Ok(())
    }
}

/// A value, or 0 where it is less than counts.
fn or_zero(value: f64, least: f64) -> f64 {
    if value.abs() < least { 0.0 } else { value }
}

fn as_json(
    model: &Calibration,
    cameras: Option<&[Intrinsics]>,
    beside: Option<&[Beside]>,
) -> Value {
    let each = |of: fn(&Beside) -> Value| beside.map(|all| all.iter().map(of).collect::<Vec<_>>());
    json!({
        "method": method(model),
        "unit": model.unit,
        "cameras": model.reconstructor.cameras(),
        "source": model.source,
        "views": views(model),
        "fitted_points": model.training.located,
        "fitted_rms": model.training.rms,
        "held_out": model.validation.as_ref().map(|validation| &validation.all),
        "point_noise": model.point_noise,
        "sigma_scale": model.covariance_scale.map(|scale| scale.range()),
        "intrinsics": cameras,
        "baselines": each(|beside| json!(beside.baseline)),
        "baseline_sigmas": each(|beside| json!(beside.baseline_sigma)),
        "angles": each(|beside| json!({ "axes": beside.axes, "axes_sigma": beside.axes_sigma, "rays": beside.rays })),
    })
}

/// The method that was fitted.
fn method(model: &Calibration) -> &str {
    model.choice.as_ref().map_or_else(|| model.method.name(), |choice| &choice.chosen)
}

/// How many views its points are of.
fn views(model: &Calibration) -> usize {
    let mut views = model.data.view.clone();
    views.sort_unstable();
    views.dedup();
    if model.data.views.is_empty() { 0 } else { views.len() }
}

/// What it is and how good.
fn heading(model: &Calibration, has_intrinsics: bool) -> String {
    let (name, cameras, unit) = (method(model), model.reconstructor.cameras(), &model.unit);
    let chosen = if model.choice.is_some() { ", chosen by auto" } else { "" };
    let mut text = format!("Method {name}{chosen}; cameras: {cameras}; lengths in {unit}\n");
    if let Some(imported) = &model.imported {
        let files = imported.files.join(", ");
        return text
            + &format!("Imported from {} ({files}): its accuracy is unknown\n", imported.format);
    }
    let error_unit = &model.training.unit;
    let to = model.source.as_ref().map(|source| format!("{}, ", source.name));
    let of_views = match views(model) {
        0 => String::new(),
        1 => " of 1 view".into(),
        views => format!(" of {views} views"),
    };
    text += &format!(
        "Fitted to {}{} points{of_views}; error on these points {} {error_unit} rms\n",
        to.unwrap_or_default(),
        model.training.located,
        figure(model.training.rms)
    );
    text += &match &model.validation {
        Some(validation) => {
            let rms = figure(validation.all.rms);
            format!("Held-out error ({}): {rms} {error_unit} rms\n", validation.scheme())
        }
        None => "Not cross-validated: the held-out error is unknown\n".into(),
    };
    if let Some(source) = &model.source {
        text += &format!("World frame: {}\n", source.frame);
    }
    if let Some(noise) = model.point_noise {
        let freedom = noise.freedom();
        text += &format!(
            "Pixel noise differs from point to point: Student's t with {freedom:.1} degrees of freedom\n"
        );
    }
    if let Some(scale) = model.covariance_scale {
        let [least, most] = scale.range();
        text += &if scale.is_of_few() {
            format!("Few points: error bars are {most:.2} times as long (Student's t)\n")
        } else {
            format!(
                "The camera model does not hold: by their errors on these points, error bars are scaled by {least:.1} to {most:.1}\n"
            )
        };
    }
    if !has_intrinsics {
        text += "This model has no intrinsics: `export` approximates it by a parametric camera. Where its cameras\n\
                 stand is found by the direct linear transformation (DLT) of its points\n";
    }
    text
}

/// Where the cameras stand: by their intrinsics, otherwise by the direct linear transformation of the points.
fn stands(model: &Calibration, cameras: Option<&[Intrinsics]>) -> Option<Vec<Stand>> {
    if let Some(cameras) = cameras {
        let stand = |camera: &Intrinsics| Stand {
            centre: Point3::from(camera.centre),
            axis: Vector3::from(camera.axis),
        };
        return Some(cameras.iter().map(stand).collect());
    }
    let data = model.data.restored();
    let stand = |camera: usize| {
        let matrix = ProjectionMatrix::fit(&data.seen_by_camera(camera))?;
        let (_, rotation, _) = matrix.decompose()?;
        Some(Stand { centre: matrix.centre()?, axis: rotation.row(2).transpose() })
    };
    (0..data.cameras).map(stand).collect()
}

/// The middle of the points that it was fitted to.
fn middle(model: &Calibration) -> Option<Point3> {
    let places: Vec<Vector3> =
        model.data.world.iter().flatten().map(|p| Vector3::from(*p)).collect();
    let count = places.len() as f64;
    (count > 0.0).then(|| Point3::from(places.iter().sum::<Vector3>() / count))
}

fn beside(stands: &[Stand], model: &Calibration) -> Vec<Beside> {
    let Some((first, others)) = stands.split_first() else { return Vec::new() };
    let (middle, poses) = (middle(model), model.reconstructor.relative_poses());
    let of = |(index, other): (usize, &Stand)| {
        let pose = poses.as_ref().and_then(|poses| poses.get(index));
        Beside {
            baseline: (other.centre - first.centre).norm(),
            baseline_sigma: pose.and_then(|pose| pose.baseline_sigma),
            axes: first.axis.angle(&other.axis).to_degrees(),
            axes_sigma: pose.and_then(|pose| pose.angle_sigma).map(f64::to_degrees),
            rays: middle
                .map(|middle| (first.centre - middle).angle(&(other.centre - middle)).to_degrees()),
        }
    };
    others.iter().enumerate().map(of).collect()
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
