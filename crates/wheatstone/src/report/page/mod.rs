//! One HTML file of a report: what stands in it is escaped, and its policy lets no request out.

mod parts;
mod placed;
mod scene;

use super::{Report, digest, plot, text};
use parts::Part;

const TEMPLATE: &str = include_str!("page.html");

/// The one style and the one script; the policy names both by their digests.
fn style() -> String {
    [plot::STYLE, include_str!("page.css")].concat()
}

fn script() -> String {
    [include_str!("three/three.min.js"), include_str!("page.js"), include_str!("scene.js")].concat()
}

/// Nothing may be loaded or sent; pictures travel inside the page.
fn policy(style: &str, script: &str) -> String {
    format!(
        "default-src 'none'; script-src '{}'; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'",
        digest::source(script),
        digest::source(style)
    )
}

/// Replaces `{{name}}` by values; what a value holds is not looked at again.
fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let mut text = String::new();
    for (index, piece) in template.split("{{").enumerate() {
        match piece.split_once("}}").filter(|_| index > 0) {
            Some((name, rest)) => {
                let value = values.iter().find(|(known, _)| *known == name);
                text += value.map_or("", |(_, value)| value);
                text += rest;
            }
            None => text += piece,
        }
    }
    text
}

/// The whole page.
pub(super) fn page(report: &Report) -> String {
    let (style, script) = (style(), script());
    let parts: Vec<Part> = parts::all(report);
    let contents: String = parts
        .iter()
        .map(|part| format!("<li><a href=\"#{}\">{}</a></li>", part.name, text::escape(part.short)))
        .collect();
    let body: String = parts.into_iter().map(|part| part.html).collect();
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
            ("style", &style),
            ("script", &script),
        ],
    )
}
