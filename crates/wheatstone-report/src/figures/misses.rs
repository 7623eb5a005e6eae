//! From where points were seen to where they were expected.

use super::{
    super::plot::{Plot, scale::round_below},
    Figure, every, thinned,
};
use crate::{
    CameraFigures, Report,
    plot::{Panel, short},
    text::figure as digits,
};
use std::fmt::Write;
use wheatstone_numeric::statistics::percentile;

/// One camera's misses: pixel, miss, number of the point.
fn misses(report: &Report, camera: usize) -> Vec<([f64; 2], [f64; 2], usize)> {
    let of = |(index, point): (usize, &crate::PointFigures)| {
        let miss = (*point.located.as_ref()?.misses.get(camera)?)?;
        Some(((*point.pixels.get(camera)?)?, miss, index))
    };
    report.points.iter().enumerate().filter_map(of).collect()
}

fn panel(
    camera: &CameraFigures,
    misses: &[([f64; 2], [f64; 2], usize)],
    exaggeration: f64,
) -> Panel {
    let [left, top, right, bottom] = camera.area;
    let mut plot =
        Plot::square((left, right), (top, bottom), (true, None), ["x, pixels", "y, pixels"]);
    let mut path = String::new();
    for (at, by, index) in misses.iter().step_by(every(misses.len())) {
        let end = [at[0] + by[0] * exaggeration, at[1] + by[1] * exaggeration];
        let _ = write!(
            path,
            "M{} {}L{} {}",
            short(plot.x(at[0])),
            short(plot.y(at[1])),
            short(plot.x(end[0])),
            short(plot.y(end[1]))
        );
        plot.dot(*at, "f0", (1.5, Some(*index)));
    }
    plot.add(maud::html! { path class="line c0 thin" d=(path) {} });
    let rms = camera.miss_rms.unwrap_or(0.0);
    plot.finish(
        &format!("{}: {} px rms", camera.name, digits(rms)),
        &format!("Reprojection errors of {}: {} px rms per coordinate.", camera.name, digits(rms)),
    )
}

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let all: Vec<_> = (0..report.cameras.len()).map(|camera| misses(report, camera)).collect();
    let lengths: Vec<f64> =
        all.iter().flatten().map(|(_, by, _)| (by[0] * by[0] + by[1] * by[1]).sqrt()).collect();
    if lengths.is_empty() {
        return None;
    }
    // Nine of ten arrows stay shorter than a twentieth of the picture.
    let width = report.cameras.iter().map(|c| c.area[2] - c.area[0]).fold(0.0, f64::max);
    let exaggeration = round_below(width / 20.0 / percentile(&lengths, 0.9).max(1e-300)).max(1.0);
    let panels = report.cameras.iter().zip(&all).filter(|(_, misses)| !misses.is_empty());
    let count = all.iter().map(Vec::len).max().unwrap_or(0);
    Some(Figure {
        name: "misses",
        title: "Reprojection errors",
        how: format!(
            "Each stroke is one residual, {exaggeration} times as long as it is: from the observed pixel (the dot) towards the reprojected point.{}",
            thinned(count)
        ),
        good: "Short strokes in random directions. Whirls, or strokes that agree with their neighbours, mean that the lens model does not fit.",
        panels: panels.map(|(camera, misses)| panel(camera, misses, exaggeration)).collect(),
    })
}
