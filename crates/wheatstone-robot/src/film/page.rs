//! The page that plays a film.

use super::Reel;
use maud::PreEscaped;
use wheatstone_report::html::{STYLE, filled, json, policy};

/// The whole page.
pub(super) fn page(reel: &Reel) -> String {
    let style = [STYLE, include_str!("film.css")].concat();
    let script = include_str!("film.js");
    let ended = reel.outcome.as_ref().map_or("", |outcome| outcome.ended.words());
    filled(
        include_str!("film.html"),
        &[
            ("policy", &policy(&style, script)),
            ("program", &concat!("wheatstone ", env!("CARGO_PKG_VERSION"))),
            ("title", &format!("World {}", reel.seed)),
            ("ended", &ended),
            ("data", &json(reel)),
            ("style", &PreEscaped(&style)),
            ("script", &PreEscaped(script)),
        ],
    )
    .into_string()
}
