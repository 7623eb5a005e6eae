//! Where in space points were.

use super::{super::plot::Plot, Figure, every, thinned};
use crate::Report;

/// The ends of one coordinate, a little widened; apart even where all values are equal.
fn ends(values: impl Iterator<Item = f64>, least: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let room = (0.05 * (high - low)).max(least);
    (low - room, high + room)
}

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let points: Vec<(usize, [f64; 3])> = report
        .points
        .iter()
        .enumerate()
        .filter_map(|(index, point)| Some((index, point.world?)))
        .collect();
    if points.is_empty() {
        return None;
    }
    let extent = |axis: usize| {
        let (low, high) = ends(points.iter().map(|(_, p)| p[axis]), 0.0);
        high - low
    };
    let longest = (0..3).map(extent).fold(0.0, f64::max);
    let names = ["X", "Y", "Z"];
    // The longer axis lies across.
    let lying = |[a, b]: [usize; 2]| if extent(b) > extent(a) { [b, a] } else { [a, b] };
    let views = [[0, 2], [1, 2], [0, 1]].map(lying);
    let of = |axis: usize| ends(points.iter().map(|(_, p)| p[axis]), 0.05 * longest);
    // One scale for all, by which the longest axis is as wide as a drawing usually is.
    let scale = 330.0 / (1.1 * longest).max(1e-300);
    let panel = |[across, up]: [usize; 2]| {
        let name = |axis: usize| format!("{}, {}", names[axis], report.unit);
        let mut plot =
            Plot::square(of(across), of(up), (false, Some(scale)), [&name(across), &name(up)]);
        for (index, p) in points.iter().step_by(every(points.len())) {
            let class = ["f0", "f1", "f2", "f3", "f4", "f5"][report.points[*index].view % 6];
            plot.dot([p[across], p[up]], class, (2.0, Some(*index)));
        }
        let heading = format!("{} and {}", names[across], names[up]);
        let alternative = format!("The known points along {heading}.");
        plot.finish(&heading, &alternative)
    };
    Some(Figure {
        name: "volume",
        title: "Coverage of space",
        how: format!(
            "The known points seen along each axis; points of one view share a colour.{}",
            thinned(points.len())
        ),
        good: "The points enclose the whole volume in which you will measure, at five depths or more.",
        panels: views.into_iter().map(panel).collect(),
    })
}
