//! Whether the error bars tell the truth.

use super::{
    super::plot::{Plot, scale::Scale},
    Figure,
};
use crate::{Report, text::percent};

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let bars = &report.error_bars;
    let count = report.points.iter().filter(|point| point.error().is_some()).count();
    if bars.is_empty() || count == 0 {
        return None;
    }
    let axis = Scale::exactly(0.0, 100.0);
    let mut plot = Plot::new((axis, "points expected inside, %"), (axis, "points inside, %"));
    // Two standard deviations of counting `count` points.
    let band = |side: f64| -> Vec<[f64; 2]> {
        (0..=50)
            .map(|step| f64::from(step) / 50.0)
            .map(|q| [100.0 * q, 100.0 * (q + side * 2.0 * (q * (1.0 - q) / count as f64).sqrt())])
            .collect()
    };
    plot.line(&band(1.0), "c3 thin", "");
    plot.line(&band(-1.0), "c3 thin", "by chance");
    plot.line(&[[0.0, 0.0], [100.0, 100.0]], "c2 dashed", "honest");
    let points: Vec<[f64; 2]> =
        bars.iter().map(|bar| [100.0 * bar.nominal, 100.0 * bar.actual]).collect();
    plot.line(&points, "c0", "here");
    for point in &points {
        plot.dot(*point, "f0", (2.6, None));
    }
    let at = |nominal: f64| {
        bars.iter()
            .min_by(|a, b| (a.nominal - nominal).abs().total_cmp(&(b.nominal - nominal).abs()))
    };
    let alternative = match (at(0.5), at(0.95)) {
        (Some(half), Some(most)) => format!(
            "The {} error ellipsoids contain {} of the points, the {} ellipsoids {}.",
            percent(half.nominal),
            percent(half.actual),
            percent(most.nominal),
            percent(most.actual)
        ),
        _ => String::new(),
    };
    Some(Figure {
        name: "error-bars",
        title: "Are the error bars honest?",
        how: format!(
            "Horizontal: the nominal probability of an error ellipsoid. Vertical: the share of the {} inside it.",
            report.judgement.words()
        ),
        good: "The curve lies on the diagonal. Below it the error bars are too short, above it too long.",
        panels: vec![plot.finish("", &alternative)],
    })
}
