//! What the reference says is all there is.

use super::{prose, quoted, root, text};
use crate::program::{done, refused};
use std::collections::BTreeSet;

/// The names at the facade's root.
fn facade() -> BTreeSet<String> {
    let face = text("crates/wheatstone/src/face.rs");
    let code: Vec<&str> = face
        .lines()
        .filter(|line| !line.starts_with("//") && !line.trim_start().starts_with('#'))
        .collect();
    let separators = |letter: char| letter.is_whitespace() || "{},;".contains(letter);
    code.join("\n")
        .split(separators)
        .filter(|word| !["", "pub", "use"].contains(word) && !word.ends_with("::"))
        .map(|word| word.rsplit("::").next().unwrap().to_owned())
        .collect()
}

#[test]
fn the_glossary_has_every_name_of_the_facade() {
    let quoted = quoted(&text("docs/glossary.md"));
    let names = facade();
    assert!(names.len() > 50 && names.contains("Calibration"), "{names:?}");
    for name in names {
        assert!(quoted.contains(&name), "docs/glossary.md does not have `{name}`");
    }
}

/// The keys that a part of a page documents: what its tables have in their first column.
fn keys_of(part: &str) -> BTreeSet<String> {
    let first = part.lines().filter_map(|line| line.strip_prefix("| `")?.split(" |").next());
    first.flat_map(|cell| quoted(&format!("`{cell}"))).collect()
}

/// The part of a page below a heading, up to the next one.
fn part<'a>(page: &'a str, heading: &str) -> &'a str {
    let start = page.find(&format!("\n{heading}\n")).unwrap() + heading.len() + 2;
    page[start..].split("\n#").next().unwrap()
}

/// The keys that are accepted where an unknown one stands.
fn accepted(capture: &str) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("capture.toml"), capture).unwrap();
    let said = refused(folder.path(), &["check", "."]);
    let (_, keys) = said.split_once("expected one of ").unwrap();
    quoted(keys.lines().next().unwrap()).into_iter().collect()
}

#[test]
fn every_key_of_a_capture_is_documented_and_no_other() {
    let page = prose(&text("docs/reference/capture.md"));
    let charts = done(&root(), &["list", "charts"]).0;
    for chart in charts.split_whitespace() {
        let file = format!("unit = \"mm\"\n[chart]\ntype = \"{chart}\"\nunknown = 1\n[cameras]\n");
        assert_eq!(keys_of(part(&page, &format!("### {chart}"))), accepted(&file), "{chart}");
    }
    assert_eq!(keys_of(part(&page, "## At the top")), accepted("unknown = 1\n"));
    let chart = "[chart]\ntype = \"chessboard\"\ncolumns = 9\nrows = 6\npitch = 3\n";
    let file = format!("unit = \"mm\"\n{chart}[cameras]\n[[views]]\nunknown = 1\n");
    assert_eq!(keys_of(part(&page, "## [[views]]")), accepted(&file));
}

/// The codes of faults in the sources of their checks: names in kebab case, and what follows `code:` or
/// `itself(`.
fn codes() -> BTreeSet<String> {
    let folder = root().join("crates/wheatstone-core/src/preparation/checks");
    let mut codes = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let source = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        let source = source.split("#[cfg(test)]").next().unwrap();
        let parts: Vec<&str> = source.split('"').collect();
        for pair in parts.chunks_exact(2) {
            let (before, literal) = (pair[0].trim_end(), pair[1]);
            let is_name = !literal.is_empty()
                && literal.bytes().all(|b| b.is_ascii_lowercase() || b == b'-')
                && !literal.starts_with('-');
            let is_code = before.ends_with("code:") || before.ends_with("itself(");
            if is_name && (literal.contains('-') || is_code) {
                codes.insert(literal.to_owned());
            }
        }
    }
    codes
}

#[test]
fn every_code_of_a_finding_is_documented_and_no_other() {
    let page = prose(&text("docs/reference/messages.md"));
    let codes = codes();
    assert!(codes.len() > 20 && codes.contains("unexplained"), "{codes:?}");
    assert_eq!(keys_of(part(&page, "## Findings")), codes);
}

#[test]
fn every_key_of_a_model_and_every_column_is_documented() {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &[&str]| done(folder.path(), words);
    run(&["synth", "--points", "--count", "100", "-o", "points.csv"]);
    run(&["fit", "points.csv", "--method", "dlt", "--no-validation", "-o", "model.json"]);
    let model = std::fs::read_to_string(folder.path().join("model.json")).unwrap();
    let model: serde_json::Value = serde_json::from_str(&model).unwrap();
    let keys: BTreeSet<String> = model.as_object().unwrap().keys().cloned().collect();
    let page = prose(&text("docs/reference/model.md"));
    let optional = |line: &&str| line.ends_with("| yes |");
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `")).collect();
    let always: String =
        rows.iter().filter(|line| !optional(line)).flat_map(|l| [l, "\n"]).collect();
    let documented = keys_of(&rows.join("\n"));
    assert!(keys.is_subset(&documented), "{keys:?} {documented:?}");
    assert!(keys_of(&always).is_subset(&keys), "{keys:?} {always}");

    let located = run(&["locate", "model.json", "points.csv", "--covariance"]).0;
    let documented = keys_of(&prose(&text("docs/reference/tables.md")));
    for column in located.lines().next().unwrap().split(',') {
        let column = column.strip_prefix("input_").unwrap_or(column);
        assert!(documented.contains(column), "docs/reference/tables.md has no `{column}`");
    }
}
