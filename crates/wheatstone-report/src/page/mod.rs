//! One HTML file of a report: what stands in it is escaped, and its policy lets no request out.

mod parts;
mod placed;
mod scene;
mod table;

use super::{Report, plot, text};
use crate::html::{STYLE, filled, policy};
use maud::{PreEscaped, html};
use parts::Part;

const TEMPLATE: &str = include_str!("page.html");

/// The one style and the one script; the policy names both by their digests.
fn style() -> String {
    [plot::STYLE, STYLE].concat()
}

fn script() -> String {
    [include_str!("three/three.min.js"), include_str!("page.js"), include_str!("scene.js")].concat()
}

/// The whole page.
pub(super) fn page(report: &Report) -> String {
    let (style, script) = (style(), script());
    let parts: Vec<Part> = parts::all(report);
    let contents = html! {
        @for part in &parts {
            li { a href={ "#" (part.name) } { (text::escape(part.short)) } }
        }
    };
    let body = html! { @for part in &parts { (part.html) } };
    filled(
        TEMPLATE,
        &[
            ("policy", &policy(&style, &script)),
            ("program", &text::escape(&report.program)),
            ("title", &text::escape(&report.title)),
            ("grade", &text::escape(&report.verdict.grade)),
            ("verdict", &parts::verdict(report)),
            ("contents", &contents),
            ("parts", &body),
            ("data", &text::json(&scene::data(report))),
            ("style", &PreEscaped(&style)),
            ("script", &PreEscaped(&script)),
        ],
    )
    .into_string()
}
