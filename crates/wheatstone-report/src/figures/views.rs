//! Error view by view.

use super::{
    super::plot::bars::{Bar, bars},
    Figure,
};
use crate::Report;
use wheatstone_core::dataset::split::FoldKind;

/// Rows of one drawing: more are a list, not a figure.
const MOST_ROWS: usize = 60;

pub(super) fn figure(report: &Report) -> Option<Figure> {
    if report.views.len() < 2 {
        return None;
    }
    let unit = &report.unit;
    let row = |view: &crate::ViewFigures| Bar {
        label: view.name.clone(),
        value: view.rms,
        mark: view.predicted_rms,
        class: match view.kind {
            Some(FoldKind::Extrapolation) => "f1 hatched",
            _ => "f0",
        },
        note: match &view.problem {
            Some(_) => "could not be fitted".into(),
            None if view.located < view.points => format!("({} of {})", view.located, view.points),
            None => String::new(),
        },
    };
    let rows: Vec<Bar> = report.views.iter().take(MOST_ROWS).map(row).collect();
    let held_out = report.views.iter().any(|view| view.kind.is_some());
    let legend: &[(&str, &str)] = if held_out {
        &[("f0", "between others"), ("f1 hatched", "outermost"), ("line marked", "predicted")]
    } else {
        &[("f0", "fitted"), ("line marked", "predicted")]
    };
    let worst = report.views.iter().filter_map(|v| Some((v.rms?, &v.name)));
    let worst = worst.max_by(|a, b| a.0.total_cmp(&b.0));
    let alternative = worst.map_or_else(String::new, |(rms, name)| {
        format!("Error of {} views; the largest is {rms:.3} {unit}, of {name}.", report.views.len())
    });
    let how = if held_out {
        "Each bar is the error of one view (or slab of space) in a fit without it; for the outermost views it is an extrapolation error. The upright mark is the error predicted by the covariances."
    } else {
        "Each bar is the error of one view, all of which were fitted. The upright mark is the error predicted by the covariances."
    };
    Some(Figure {
        name: "views",
        title: "Error view by view",
        how: how.into(),
        good: "Bars grow evenly with distance and end near their marks. A single long bar marks a view to check.",
        panels: vec![bars(
            &rows,
            legend,
            (&format!("rms error, {unit}"), f64::INFINITY),
            &alternative,
        )],
    })
}
