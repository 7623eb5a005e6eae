//! From where points were seen to where they were expected.

use super::{super::plot::Plot, Figure, every, round_below, thinned};
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
        &format!(
            "Misses in the picture of {}: {} pixels rms a coordinate.",
            camera.name,
            digits(rms)
        ),
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
        title: "Misses in each picture",
        how: format!(
            "Each stroke leads from where a point was seen (the dot) to where the fit expected it, {exaggeration} times as long as it is.{}",
            thinned(count)
        ),
        good: "Short strokes in all directions at random; whirls or strokes that agree with their neighbours mean a lens that the method does not follow.",
        panels: panels.map(|(camera, misses)| panel(camera, misses, exaggeration)).collect(),
    })
}
