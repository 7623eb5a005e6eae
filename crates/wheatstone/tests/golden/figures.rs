//! Named figures, and in which of them two runs differ.

use hmac_sha256::Hash;
use serde::Serialize;
use serde_json::Value;
use std::fmt::Write;

/// Figures in the order in which they were computed. Numbers are written in the fewest digits that give back
/// their bits.
#[derive(Default)]
pub(crate) struct Figures(Vec<(String, String)>);

/// More numbers than this of one value are a hash, and the first of them.
const WRITTEN: usize = 40;

/// So many differences are told of a file.
const TOLD: usize = 5;

impl Figures {
    /// A number.
    pub(crate) fn number(&mut self, name: &str, value: f64) {
        self.0.push((name.into(), format!("{value:?}")));
    }

    /// A word or a count.
    pub(crate) fn word(&mut self, name: &str, value: impl ToString) {
        self.0.push((name.into(), value.to_string()));
    }

    /// The hash of bytes.
    pub(crate) fn bytes(&mut self, name: &str, bytes: &[u8]) {
        let hash = Hash::hash(bytes).iter().fold(String::new(), |mut text, byte| {
            write!(text, "{byte:02x}").unwrap();
            text
        });
        self.word(&format!("{name} sha256"), hash);
    }

    /// The hash of many numbers' bits.
    pub(crate) fn numbers(&mut self, name: &str, values: &[f64]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_bits().to_le_bytes()).collect();
        self.bytes(name, &bytes);
    }

    /// All of a value: the hash of its JSON, and its first numbers by their places in it.
    pub(crate) fn value(&mut self, name: &str, value: &impl Serialize) {
        self.bytes(name, &serde_json::to_vec(value).unwrap());
        let mut leaves = Vec::new();
        flatten(name, &serde_json::to_value(value).unwrap(), &mut leaves);
        self.0.extend(leaves.into_iter().take(WRITTEN));
    }

    pub(crate) fn text(&self) -> String {
        self.0.iter().map(|(name, value)| format!("{name} = {value}\n")).collect()
    }

    /// Where these are not those of a file.
    pub(crate) fn differences<'a>(&'a self, stored: &'a str) -> impl Iterator<Item = String> + 'a {
        let lines: Vec<(&str, &str)> =
            stored.lines().map(|line| line.split_once(" = ").unwrap_or((line, ""))).collect();
        let count = (lines.len() != self.0.len())
            .then(|| format!("{} figures, and {} in the file", self.0.len(), lines.len()));
        let each = self.0.iter().zip(lines).filter_map(|((name, found), (old_name, old))| {
            if name != old_name {
                return Some(format!("`{name}` where the file has `{old_name}`"));
            }
            (found != old).then(|| format!("{name} is {found}, not {old}{}", apart(found, old)))
        });
        count.into_iter().chain(each).take(TOLD)
    }
}

/// How far two numbers are apart, in the units of their last place.
fn apart(found: &str, old: &str) -> String {
    match (found.parse::<f64>(), old.parse::<f64>()) {
        (Ok(found), Ok(old)) if found.is_sign_positive() == old.is_sign_positive() => {
            format!(" ({} units in the last place)", found.to_bits().abs_diff(old.to_bits()))
        }
        _ => String::new(),
    }
}

fn flatten(name: &str, value: &Value, leaves: &mut Vec<(String, String)>) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, leaves));
        }
        Value::Array(items) => items
            .iter()
            .enumerate()
            .for_each(|(index, value)| flatten(&format!("{name}[{index}]"), value, leaves)),
        Value::Number(number) => leaves.push((name.into(), number.to_string())),
        _ => {}
    }
}
