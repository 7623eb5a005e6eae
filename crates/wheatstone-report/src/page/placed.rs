//! Where charts of unknown place were found, as a table.

use super::table::table;
use crate::{
    Report,
    text::{escape, figure},
};
use maud::{Markup, html};
use wheatstone_core::fit::bundle::{Gauge, ViewPose};

/// None where all places were known.
pub(super) fn html(report: &Report) -> Option<Markup> {
    let placed = report.placed.as_ref()?;
    let unit = &report.unit;
    let frame = match placed.gauge {
        Some(Gauge::FirstView) => "the chart of the first view",
        Some(Gauge::FirstCamera) => "the first camera",
        Some(_) => "another frame",
        None => "that of the known points",
    };
    let freed = if placed.freed { ", then refined together with the neural cameras" } else { "" };
    let apart: Vec<String> = placed
        .baselines
        .iter()
        .enumerate()
        .map(|(index, length)| format!("cameras 1 and {}: {} {unit}", index + 2, figure(*length)))
        .collect();
    let words = html! {
        p {
            "The chart poses were not measured. They were estimated by bundle adjustment in " (placed.views.len())
            " views with lenses of type " code { (escape(&placed.lens)) } ", "
            (figure(placed.rms)) " px rms reprojection error" (freed)
            ". The world frame is " (frame) "."
            @if !apart.is_empty() { " Baselines: " (escape(&apart.join(", "))) "." }
            @if !placed.unplaced.is_empty() {
                " Too few points to estimate the pose in: " (escape(&placed.unplaced.join(", "))) "."
            }
        }
    };
    let row = |view: &ViewPose| {
        let [x, y, z] = view.translation.map(figure);
        let size = |values: &[f64; 3]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
        let degrees = figure(size(&view.rotation).to_degrees());
        let sigma = size(&view.translation_sigma) / 3.0_f64.sqrt();
        let numbers = [x, y, z, degrees, figure(sigma), view.points.to_string()];
        let numbers = numbers.into_iter().map(|number| escape(&number));
        [escape(&view.view)].into_iter().chain(numbers).collect()
    };
    let rows: Vec<Vec<Markup>> = placed.views.iter().map(row).collect();
    let heads = ["view", "X", "Y", "Z", "turned, degrees", "standard deviation", "points"];
    let stood = table(&format!("Chart poses, in {unit}"), &heads, &rows);
    Some(html! { (words) (stood) })
}
