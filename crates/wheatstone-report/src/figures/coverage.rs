//! Where in each picture points were seen.

use super::{super::plot::colour_bar, Figure, error_map::map};
use crate::{CameraFigures, Report, text::percent};

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let counts = report.cameras.iter().flat_map(|camera| camera.coverage.counts.iter());
    let most = counts.copied().max().filter(|most| *most > 0)? as f64;
    let panel = |camera: &CameraFigures| {
        let grid = &camera.coverage;
        let alternative = format!(
            "{}: {} points, in {} of the cells.",
            camera.name,
            camera.seen,
            percent(grid.covered())
        );
        let share = |cell: usize| (grid.counts[cell] > 0).then(|| grid.counts[cell] as f64 / most);
        let words = |cell: usize| format!("{} points", grid.counts[cell]);
        let mut panel = map(camera, grid, &share, &words, &alternative);
        panel.heading = format!("{}: {} of the cells", camera.name, percent(grid.covered()));
        colour_bar((0.0, most), "points", &mut panel);
        panel
    };
    let whole = report.cameras.iter().all(|camera| camera.area_is_picture);
    let cells = if whole {
        ""
    } else {
        " The size of the picture is unknown: the frame encloses the points."
    };
    Some(Figure {
        name: "coverage",
        title: "Coverage of each picture",
        how: format!("Each cell counts the points seen there; empty cells have none.{cells}"),
        good: "No empty cells, corners included: where no point was seen, the lens is extrapolated.",
        panels: report
            .cameras
            .iter()
            .filter(|c| !c.coverage.counts.is_empty())
            .map(panel)
            .collect(),
    })
}
