//! How the error grows beyond the range that was fitted.

use super::{
    super::plot::scale::Scale,
    Figure,
    learning::{curves, values},
};
use crate::Report;

pub(super) fn figure(report: &Report) -> Option<Figure> {
    let beyond = report.beyond.as_ref()?;
    let alternative =
        format!("{} beyond the fitted range, for {} methods.", beyond.up, beyond.curves.len());
    Some(Figure {
        name: "beyond",
        title: "Beyond the fitted range (figure 6 of the 2001 paper)",
        how: "The error at distances outside the fitted range.".into(),
        good: "A slow rise. A steep one means: stay within the fitted range.",
        // Linear, as in the paper.
        panels: vec![curves(beyond, Scale::around(values(beyond), true), &alternative)],
    })
}
