//! How the error fell while a method learned.

use super::{
    super::plot::{Panel, Plot, scale::Scale},
    Figure,
};
use crate::{CurveFigure, Report, text::figure as digits};

/// The values of curves, upwards.
pub(super) fn values(figure: &CurveFigure) -> impl Iterator<Item = f64> {
    let points = figure.curves.iter().flat_map(|curve| curve.points.iter());
    points.map(|p| p[1]).filter(|value| value.is_finite())
}

/// Curves in one drawing, and levels that they are held against.
pub(super) fn curves(figure: &CurveFigure, up: Scale, alternative: &str) -> Panel {
    let points = || figure.curves.iter().flat_map(|curve| curve.points.iter());
    let across = Scale::around(points().map(|p| p[0]), false);
    let mut plot = Plot::new((across, &figure.across), (up, &figure.up));
    let looks = ["c0", "c1 dashed", "c2 dotted", "c3", "c4 dashed", "c5 dotted", "c0 dotted"];
    for (curve, look) in figure.curves.iter().zip(looks.iter().cycle()) {
        plot.line(&curve.points, look, &curve.name);
    }
    let ends = || points().map(|p| p[0]).filter(|value| value.is_finite());
    let (first, last) = (ends().fold(f64::MAX, f64::min), ends().fold(f64::MIN, f64::max));
    for level in &figure.levels {
        plot.line(&[[first, level.at], [last, level.at]], "ink dashed", &level.name);
    }
    plot.finish("", alternative)
}

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let learning = report.learning.as_ref()?;
    let first = learning.curves.first()?;
    let (start, end) = (first.points.first()?[1], first.points.last()?[1]);
    let (low, high) =
        values(learning).fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    // In powers of ten where they span many.
    let up = if low > 0.0 && high > 10.0 * low {
        Scale::logarithmic(values(learning))
    } else {
        Scale::around(values(learning), true)
    };
    let alternative =
        format!("Training: {} falls from {} to {}.", learning.up, digits(start), digits(end));
    Some(Figure {
        name: "learning",
        title: if report.claims.is_empty() {
            "Learning"
        } else {
            "Training (figure 5 of the 2001 paper)"
        },
        how: "The error against the number of epochs.".into(),
        good: "A steady fall that levels off. A curve that still falls needs more epochs.",
        panels: vec![curves(learning, up, &alternative)],
    })
}
