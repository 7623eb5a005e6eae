//! One file a verb.

pub(crate) mod chart;
pub(crate) mod compare;
pub(crate) mod demo;
pub(crate) mod detect;
pub(crate) mod evaluate;
pub(crate) mod fit;
pub(crate) mod list;
pub(crate) mod locate;
pub(crate) mod report;
pub(crate) mod reproduce;
pub(crate) mod synth;

use crate::failure::Outcome;
use std::io::Write;

/// Prints one JSON object on standard output.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Outcome {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::from)?;
    writeln!(std::io::stdout(), "{text}")?;
    Ok(())
}
