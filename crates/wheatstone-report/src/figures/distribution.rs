//! Distribution of the errors.

use super::{
    super::plot::{Plot, scale::Scale},
    Figure,
};
use crate::{Report, text::figure as digits};

/// Corners of the curve: finer than the drawing shows.
const STEPS: usize = 200;

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let accuracy = report.accuracy.as_ref()?;
    let mut errors: Vec<f64> = report.points.iter().filter_map(|point| point.error()).collect();
    errors.sort_by(f64::total_cmp);
    if errors.len() < 10 {
        return None;
    }
    let unit = &report.unit;
    let last = errors.len() - 1;
    let curve: Vec<[f64; 2]> = (0..=STEPS)
        .map(|step| {
            let share = step as f64 / STEPS as f64;
            [errors[(share * last as f64).round() as usize], 100.0 * share]
        })
        .collect();
    let mut plot = Plot::new(
        (
            Scale::logarithmic(errors.iter().copied().filter(|e| *e >= accuracy.median / 30.0)),
            &format!("error, {unit}"),
        ),
        (Scale::exactly(0.0, 100.0), "points with a smaller error, %"),
    );
    for (value, share, class, name) in
        [(accuracy.median, 50.0, "c2 dashed", "half"), (accuracy.p95, 95.0, "c1 dashed", "95 %")]
    {
        plot.line(
            &[[value, 0.0], [value, share]],
            class,
            &format!("{name}: {} {unit}", digits(value)),
        );
    }
    let visible: Vec<[f64; 2]> =
        curve.into_iter().filter(|p| p[0] >= accuracy.median / 30.0).collect();
    plot.line(&visible, "c0", "");
    Some(Figure {
        name: "distribution",
        title: "Distribution of the errors",
        how: "Above each error on the lower axis, the curve gives the percentage of points with a smaller error.".into(),
        good: "One smooth step. A long flat tail to the right means a few outliers.",
        panels: vec![plot.finish(
            "",
            &format!(
                "Half of the points have an error below {} {unit}, 95 % below {} {unit}.",
                digits(accuracy.median),
                digits(accuracy.p95)
            ),
        )],
    })
}
