//! A reconstructed scene, as a drawing of its points before the report's cameras.

use super::Figure;
use crate::{CameraFigures, CloudCamera, Report, SceneCloud};

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let scene = report.scene.as_ref()?;
    let camera = |camera: &CameraFigures| CloudCamera {
        name: camera.name.clone(),
        centre: camera.centre,
        corners: camera.corners.clone(),
    };
    let cameras = report.cameras.iter().map(camera).collect();
    SceneCloud { cameras, ..scene.sample.clone() }.drawing(scene.points)
}
