//! Where charts of unknown place were found, as a table.

use super::parts::table;
use crate::{
    Report,
    text::{escape, figure},
};
use wheatstone_core::fit::bundle::{Gauge, ViewPose};

/// Nothing where all places were known.
pub(super) fn html(report: &Report) -> String {
    let Some(placed) = &report.placed else { return String::new() };
    let unit = escape(&report.unit);
    let frame = match placed.gauge {
        Some(Gauge::FirstView) => "the chart of the first view",
        Some(Gauge::FirstCamera) => "the first camera",
        None => "that of the known places",
    };
    let freed =
        if placed.freed { ", then adjusted together with the model-free camera" } else { "" };
    let apart: Vec<String> = placed
        .baselines
        .iter()
        .enumerate()
        .map(|(index, length)| format!("cameras 1 and {}: {} {unit}", index + 2, figure(*length)))
        .collect();
    let unplaced = match placed.unplaced.as_slice() {
        [] => String::new(),
        names => format!(" Too few points to place it in: {}.", escape(&names.join(", "))),
    };
    let apart =
        if apart.is_empty() { String::new() } else { format!(" Apart: {}.", apart.join(", ")) };
    let words = format!(
        "<p>Nobody measured where the chart stood. It was placed in {} views with lenses of type <code>{}</code>, {} px root mean square{freed}. The world's frame is {frame}.{apart}{unplaced}</p>",
        placed.views.len(),
        escape(&placed.lens),
        figure(placed.rms),
    );
    let row = |view: &ViewPose| {
        let [x, y, z] = view.translation.map(figure);
        let size = |values: &[f64; 3]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
        let degrees = figure(size(&view.rotation).to_degrees());
        let sigma = size(&view.translation_sigma) / 3.0_f64.sqrt();
        vec![escape(&view.view), x, y, z, degrees, figure(sigma), view.points.to_string()]
    };
    let rows: Vec<Vec<String>> = placed.views.iter().map(row).collect();
    let heads = ["view", "X", "Y", "Z", "turned, degrees", "standard deviation", "points"];
    words + &table(&format!("Where the chart stood, in {unit}"), &heads, &rows)
}
