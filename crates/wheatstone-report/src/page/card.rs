//! A figure with its words.

use crate::{figures::Figure, plot, text::escape};
use maud::{Markup, html};

/// How a figure is read.
pub(super) fn explained(figure: &Figure) -> Markup {
    html! {
        p { strong { "How to read:" } " " (escape(&figure.how)) }
        p { strong { "Ideally:" } " " (escape(figure.good)) }
    }
}

/// A figure with its words.
pub(super) fn card(figure: &Figure) -> Markup {
    let several = figure.panels.len() > 1;
    // Drawings of several widths keep them, so that their scales stay the same.
    let natural = several && figure.panels.iter().any(|panel| panel.size[0] < plot::WIDTH - 1.0);
    html! {
        figure.card.broad[several] id={ "figure-" (figure.name) } {
            h3 { (escape(figure.title)) }
            div.panels.natural[natural] {
                @for panel in &figure.panels {
                    div {
                        @if !panel.heading.is_empty() { h4 { (escape(&panel.heading)) } }
                        (panel.inline())
                    }
                }
            }
            figcaption { (explained(figure)) }
        }
    }
}
