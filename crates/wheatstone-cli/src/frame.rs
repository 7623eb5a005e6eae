//! The world frame of a fit, in words.

use crate::input::{Loaded, Source};
use std::path::Path;
use wheatstone::{
    fit::bundle::Gauge,
    geometry::{Pose, Vector3},
    preparation::Prepared,
};

/// Axes of a chart's frame.
const CHART: &str = "X right along the chart's rows, Y down along its columns, Z into the chart";

/// What the axes and the origin of the world are.
pub(crate) fn world_frame(input: &Path, loaded: &Loaded, prepared: &Prepared) -> String {
    let placed = prepared.placed.as_ref();
    let first = placed.and_then(|placed| placed.views.first()).map_or("", |first| &first.view);
    match (placed.and_then(|placed| placed.gauge), &loaded.source) {
        (Some(Gauge::FirstCamera), _) => {
            "camera 1's: X right, Y down, Z forward; its origin is the projection centre".into()
        }
        (Some(_), Some(_)) => {
            format!("the chart's in view {first}: {CHART}; its origin is that of the chart")
        }
        (Some(_), None) => format!(
            "the board's in view {first}: X along board_x, Y along board_y, Z into the board; its origin is that of the board"
        ),
        (None, Some(source)) => given(source),
        (None, None) => format!("that of X, Y, Z in {}", name_of(input)),
    }
}

/// The name of a file, or of a capture's folder.
pub(crate) fn name_of(path: &Path) -> String {
    let whole = path.canonicalize().unwrap_or_else(|_| path.into());
    whole.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into())
}

/// That of the poses in `capture.toml`, and how the charts stand in it.
fn given(source: &Source) -> String {
    let poses: Vec<&Pose> =
        source.capture.views.iter().filter_map(|view| view.world_from_chart.as_ref()).collect();
    let turned = poses.iter().any(|pose| pose.rotation_vector().norm() > 0.0);
    if turned || poses.is_empty() {
        return "that of the chart poses in capture.toml".into();
    }
    let stage =
        stage_axis(&poses).map_or(String::new(), |axis| format!("; the stage moves along {axis}"));
    format!("that of the chart poses in capture.toml: {CHART}{stage}")
}

/// The axis along which charts that are not turned were moved, if it is one.
fn stage_axis(poses: &[&Pose]) -> Option<&'static str> {
    let first = poses.first()?.translation;
    let moves: Vec<Vector3> = poses.iter().map(|pose| pose.translation - first).collect();
    let farthest = moves.iter().map(|by| by.norm()).fold(0.0, f64::max);
    let is_along = |axis: usize| {
        let aside = |by: &Vector3| (by.norm_squared() - by[axis] * by[axis]).max(0.0).sqrt();
        farthest > 0.0 && moves.iter().all(|by| aside(by) < 0.01 * farthest)
    };
    (0..3).find(|axis| is_along(*axis)).map(|axis| ["X", "Y", "Z"][axis])
}
