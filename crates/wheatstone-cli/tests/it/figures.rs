//! Files of figures as programs read them: names of fields, and numbers to six digits. The last digits are for the
//! library's golden files.

use crate::program::done;
use serde_json::Value;
use std::path::Path;

/// A value with its numbers in six digits.
pub(crate) fn rounded(value: Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => {
            let exact = number.as_f64().unwrap();
            format!("{exact:.5e}").parse::<f64>().unwrap().into()
        }
        Value::Array(items) => items.into_iter().map(rounded).collect(),
        Value::Object(fields) => {
            fields.into_iter().map(|(name, value)| (name, rounded(value))).collect()
        }
        other => other,
    }
}

/// JSON as a snapshot shows it.
pub(crate) fn shown(json: &str) -> String {
    serde_json::to_string_pretty(&rounded(serde_json::from_str(json).unwrap())).unwrap()
}

fn read(path: &Path) -> String {
    shown(&std::fs::read_to_string(path).unwrap())
}

#[test]
fn the_figures_of_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["synth", "--points", "--count", "40", "--noise", "0.1", "-o", "t.csv"]);
    done(at, &["fit", "t.csv", "--method", "brown", "-o", "model.json"]);
    done(at, &["report", "model.json", "-o", "report.html", "--json", "summary.json"]);
    insta::assert_snapshot!("report-summary", read(&at.join("summary.json")));
}
