//! Where the error comes from.

use super::{
    super::plot::bars::{Bar, bars},
    Figure,
};
use crate::report::Report;

pub(super) fn figure(report: &Report) -> Option<Figure> {
    if report.budget.is_empty() {
        return None;
    }
    let row = |share: &crate::report::BudgetShare| Bar {
        label: share.source.clone(),
        value: Some(share.rms),
        mark: None,
        class: "f0",
        note: String::new(),
    };
    let rows: Vec<Bar> = report.budget.iter().map(row).collect();
    let largest = report.budget.iter().max_by(|a, b| a.rms.total_cmp(&b.rms))?;
    Some(Figure {
        name: "budget",
        title: "Where the error comes from",
        how: "Each bar is the error that one source alone would cause; squares of bars add up to the square of the whole.".into(),
        good: "The detector's bar is the longest: what is left is the pixels'.",
        panels: vec![bars(
            &rows,
            &[],
            (&format!("rms error, {}", report.unit), f64::INFINITY),
            &format!("The largest part comes from: {}.", largest.source),
        )],
    })
}
