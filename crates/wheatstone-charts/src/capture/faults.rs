//! What is wrong with the text of a `capture.toml`, on which line, in plain words.

use super::AnyChart;
use serde::Deserialize;
use std::{collections::BTreeMap, path::Path};
use toml::Spanned;
use wheatstone_core::{
    Error,
    error::{Hint, Remedy},
};

/// What the reader of TOML says, as an error of the file.
pub(super) fn malformed(path: &Path, text: &str, fault: &toml::de::Error) -> Error {
    let offset = offset_in_chart(text, fault.message()).or(fault.span().map(|span| span.start));
    Error::Malformed {
        path: path.into(),
        line: offset.map(|offset| line_of(text, offset)),
        problem: plain(fault.message()),
        hint: Hint::new(
            "compare the line with the reference of `capture.toml`; lengths are in `unit`",
            Remedy::Charts,
        ),
    }
}

fn line_of(text: &str, offset: usize) -> u64 {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() as u64 + 1
}

/// Only the chart's keys and where their values stand.
#[derive(Deserialize)]
struct Places {
    chart: BTreeMap<String, Spanned<toml::Value>>,
}

/// Where the value of `[chart]` stands that is refused with this message. Which keys there may be depends on the type,
/// whereby the reader loses their places: the one sought is that with which the message first comes.
fn offset_in_chart(text: &str, message: &str) -> Option<usize> {
    if message.starts_with("missing field") {
        return None;
    }
    let Places { chart } = toml::from_str(text).ok()?;
    let mut entries: Vec<_> = chart.into_iter().collect();
    entries.sort_by_key(|(key, value)| (key != "type", value.span().start));
    let mut read = toml::Table::new();
    let mut is_refused = |key: String, value: toml::Value| {
        read.insert(key, value);
        read.clone().try_into::<AnyChart>().is_err_and(|fault| fault.message() == message)
    };
    entries.into_iter().find_map(|(key, value)| {
        let start = value.span().start;
        is_refused(key, value.into_inner()).then_some(start)
    })
}

/// A message of the reader without the words of its language.
fn plain(message: &str) -> String {
    if let Some(found) =
        message.strip_prefix("invalid type: ").or(message.strip_prefix("invalid value: "))
        && let Some((found, expected)) = found.rsplit_once(", expected ")
    {
        return format!("{} must be {}", value(found), kind(expected));
    }
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("the key {key} is missing");
    }
    if let Some(key) = message.strip_prefix("duplicate field ") {
        return format!("the key {key} is given twice");
    }
    let length = message.strip_prefix("invalid length ");
    if let Some((found, expected)) =
        length.and_then(|it| it.split_once(", expected an array of length "))
    {
        return format!("a list of {found}, where {expected} are expected");
    }
    let named = message.replacen("unknown field ", "unknown key ", 1);
    named.replacen("unknown variant ", "unknown name ", 1)
}

/// What was found, as it stands in the file.
fn value(found: &str) -> String {
    match found.split_once(' ') {
        Some(("string", text)) => format!("`{text}`"),
        Some((_, number)) if number.ends_with('`') => number.to_owned(),
        _ if found == "sequence" => "a list".into(),
        _ if found == "map" => "a table".into(),
        _ => found.to_owned(),
    }
}

/// What was expected.
fn kind(expected: &str) -> &str {
    match expected {
        "usize" | "u8" | "u16" | "u32" | "u64" => "a whole number, 0 or more",
        "f64" => "a number",
        "a string" | "path string" => "text in quotes",
        "a boolean" => "`true` or `false`",
        "a sequence" | "an array of length 3" => "a list",
        "a map" => "a table",
        _ if expected.contains("enum") || expected.starts_with("struct") => "a table",
        other => other,
    }
}
