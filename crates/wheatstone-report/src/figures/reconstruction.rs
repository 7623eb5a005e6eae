//! A reconstructed scene, as a drawing of its points.

use super::Figure;
use crate::Report;

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let scene = report.scene.as_ref()?;
    scene.sample.drawing(scene.points)
}
