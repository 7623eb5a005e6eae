//! A scene that was reconstructed with the model.

use super::card::card;
use crate::{
    Report, SceneFigures, figures,
    text::{escape, figure, percent},
};
use maud::{Markup, html};

/// None where there was no scene.
pub(super) fn html(report: &Report) -> Option<Markup> {
    let scene = report.scene.as_ref()?;
    let figures = figures::of_part(report, "reconstruction");
    Some(html! {
        (words(scene, &report.unit))
        div.figures { @for figure in &figures { (card(figure)) } }
    })
}

fn words(scene: &SceneFigures, unit: &str) -> Markup {
    let pictures = scene.pictures.join(", ");
    let [points, density] = [scene.points.to_string(), percent(scene.density)];
    html! {
        @if let Some(problem) = &scene.problem {
            p { "The scene in " (escape(&pictures)) " could not be reconstructed: " (escape(problem)) "." }
        } @else {
            p {
                "The model places " (points) " points of the scene in " (escape(&pictures)) ", "
                (density) " of the pixels; " (percent(scene.inside)) " of them lie within the calibrated volume."
                @if let Some(sigmas) = scene.sigmas {
                    @let [x, y, z] = sigmas.map(figure);
                    " Median standard deviations of X, Y and Z: " (x) ", " (y) " and " (z) " " (escape(unit)) "."
                }
                " Beyond the calibrated volume the model extrapolates: errors there may exceed their standard deviations."
            }
            @for warning in &scene.sample.warnings { p { strong { "Warning:" } " " (escape(warning)) "." } }
        }
    }
}
