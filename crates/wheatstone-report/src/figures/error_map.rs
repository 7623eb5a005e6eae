//! Errors over each camera's picture.

use super::{
    super::plot::{Plot, colour::cividis, colour_bar},
    Figure,
};
use crate::{CameraFigures, Grid, Report, plot::Panel, text::figure as digits};

/// A map of cells over a camera's picture; `share` says where a cell lies between dark and light.
pub(super) fn map(
    camera: &CameraFigures,
    grid: &Grid,
    share: &dyn Fn(usize) -> Option<f64>,
    words: &dyn Fn(usize) -> String,
    alternative: &str,
) -> Panel {
    let [left, top, right, bottom] = camera.area;
    let names = ["x, pixels", "y, pixels"];
    let mut plot = Plot::square((left, right), (top, bottom), (true, None), names);
    let (width, height) = ((right - left) / grid.columns as f64, (bottom - top) / grid.rows as f64);
    for cell in 0..grid.counts.len() {
        let Some(share) = share(cell) else { continue };
        let x = left + width * (cell % grid.columns) as f64;
        let y = top + height * (cell / grid.columns) as f64;
        plot.cell([x, y, x + width, y + height], &cividis(share), &words(cell));
    }
    plot.finish(&camera.name, alternative)
}

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let unit = &report.unit;
    let all = report.cameras.iter().flat_map(|camera| camera.errors.values.iter().flatten());
    let all: Vec<f64> = all.copied().collect();
    if all.len() < 4 {
        return None;
    }
    // One wild cell must not make all others alike.
    let high = wheatstone_numeric::statistics::percentile(&all, 0.98).max(1e-300);
    let panel = |camera: &CameraFigures| {
        let grid = &camera.errors;
        let words = |cell: usize| {
            let value = grid.values[cell].map_or_else(String::new, digits);
            format!("{value} {unit} rms of {} points", grid.counts[cell])
        };
        let worst = grid.values.iter().flatten().copied().fold(0.0, f64::max);
        let alternative = format!(
            "Error over the picture of {}: up to {} {unit} in its worst cell.",
            camera.name,
            digits(worst)
        );
        let mut panel =
            map(camera, grid, &|cell| Some(grid.values[cell]? / high), &words, &alternative);
        colour_bar((0.0, high), unit, &mut panel);
        panel
    };
    Some(Figure {
        name: "error-map",
        title: "Error over each picture",
        how: format!(
            "Each cell is the rms 3-D error, in {unit}, of the points seen there; empty cells have none."
        ),
        good: "Even shades without a pattern. A light rim means that the lens model fails near the edge.",
        panels: report.cameras.iter().filter(|c| !c.errors.counts.is_empty()).map(panel).collect(),
    })
}
