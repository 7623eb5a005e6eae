//! `wheatstone list`.

use super::print_json;
use crate::failure::Outcome;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::io::Write;
use wheatstone::{
    camera::AnyCamera, chart::AnyChart, formats::FORMATS, method::AnyMethod, synthetic::Rig,
};

/// List methods, charts, camera models, file formats and synthetic rigs
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone list\n  wheatstone list methods --json")]
pub(crate) struct List {
    /// Only these
    kind: Option<Kind>,
    /// Print the names as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    Methods,
    Charts,
    Cameras,
    Formats,
    Rigs,
}

/// Names, each with a word about it.
fn entries(kind: Kind) -> Vec<(String, String)> {
    let plain = |names: &[&str]| names.iter().map(|n| ((*n).to_owned(), String::new())).collect();
    match kind {
        Kind::Methods => AnyMethod::all()
            .iter()
            .map(|method| {
                let presets = method.presets();
                let more = if presets.len() > 1 {
                    format!(" (presets: {})", presets.join(", "))
                } else {
                    String::new()
                };
                (method.name().to_owned(), format!("{}{more}", method.summary()))
            })
            .collect(),
        Kind::Charts => plain(AnyChart::NAMES),
        Kind::Cameras => plain(AnyCamera::NAMES),
        Kind::Formats => FORMATS
            .iter()
            .map(|format| {
                let holds = if format.is_calibration() { "cameras" } else { "points" };
                let way = match (format.reads(), format.writes()) {
                    (true, true) => "in and out",
                    (true, false) => "in",
                    _ => "out",
                };
                (format.name.to_owned(), format!("{holds} {way}: {}", format.about))
            })
            .collect(),
        Kind::Rigs => plain(Rig::NAMES),
    }
}

impl List {
    pub(crate) fn run(self) -> Outcome {
        let all = [Kind::Methods, Kind::Charts, Kind::Cameras, Kind::Formats, Kind::Rigs];
        let wanted = all.into_iter().filter(|kind| self.kind.is_none_or(|own| own == *kind));
        let name = |kind: Kind| {
            kind.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
        };
        if self.json {
            let names = |kind| entries(kind).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
            let object: serde_json::Map<_, _> =
                wanted.map(|kind| (name(kind), json!(names(kind)))).collect();
            return print_json(&object);
        }
        let mut out = std::io::stdout().lock();
        for kind in wanted {
            if self.kind.is_none() {
                writeln!(out, "{}:", name(kind))?;
            }
            let indent = if self.kind.is_none() { "  " } else { "" };
            for (entry, about) in entries(kind) {
                writeln!(out, "{}", format!("{indent}{entry:<16}{about}").trim_end())?;
            }
        }
        Ok(())
    }
}
