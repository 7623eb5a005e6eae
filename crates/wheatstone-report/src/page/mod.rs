//! One HTML file of a report: what stands in it is escaped, and its policy lets no request out.

mod card;
mod parts;
mod placed;
mod reconstruction;
mod scene;
pub(crate) mod shell;
pub(crate) mod table;

use super::{Report, text};
use crate::html::filled;
use maud::html;
use parts::Part;
use shell::Shell;

/// The whole page.
pub(super) fn page(report: &Report) -> String {
    let parts: Vec<Part> = parts::all(report);
    let navigation = html! {
        nav aria-label="Parts of the report" {
            ul {
                @for part in &parts { li { a href={ "#" (part.name) } { (text::escape(part.short)) } } }
            }
        }
    };
    let body = html! { @for part in &parts { (part.html) } };
    let main = filled(
        include_str!("verdict.html"),
        &[
            ("title", &text::escape(&report.title)),
            ("grade", &text::escape(&report.verdict.grade)),
            ("verdict", &parts::verdict(report)),
            ("parts", &body),
        ],
    );
    let shell = Shell {
        title: &report.title,
        kind: "Wheatstone report",
        program: &report.program,
        first: ["verdict", "To the verdict"],
        navigation,
        main,
        data: text::json(&scene::data(report)),
        script: include_str!("scene.js"),
    };
    shell.page()
}
