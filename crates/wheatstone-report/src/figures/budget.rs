//! Where the error comes from.

use super::{
    super::plot::bars::{Bar, bars},
    Figure,
};
use crate::{Report, text::percent};

pub(super) fn figure(report: &Report) -> Option<Figure> {
    if report.budget.is_empty() {
        return None;
    }
    let row = |share: &crate::BudgetShare| Bar {
        label: share.source.clone(),
        value: Some(share.rms),
        mark: None,
        class: "f0",
        note: format!("({})", percent(share.share)),
    };
    let rows: Vec<Bar> = report.budget.iter().map(row).collect();
    let causes: Vec<String> = report
        .budget
        .iter()
        .map(|share| format!("{}: {}", share.source, share.explanation))
        .collect();
    let largest = report.budget.iter().max_by(|a, b| a.rms.total_cmp(&b.rms))?;
    Some(Figure {
        name: "budget",
        title: "Where the error comes from",
        how: format!(
            "Each bar is the error that one cause alone would produce; the squares of the bars add up to the square of the total. {}.",
            sentence(&causes.join("; "))
        ),
        good: "The bar of the pixel noise is the longest: the pixels are then the limit.",
        panels: vec![bars(
            &rows,
            &[],
            (&format!("rms error, {}", report.unit), f64::INFINITY),
            &format!("The largest contribution: {}.", largest.source),
        )],
    })
}

/// With a capital at its beginning.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
