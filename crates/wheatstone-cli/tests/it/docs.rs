//! The documentation holds together: links, pages, blocks, and what must be told completely.

mod complete;
mod links;

use std::path::{Path, PathBuf};

/// The project's folder.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folder of the documentation.
pub(crate) fn docs() -> PathBuf {
    root().join("docs")
}

/// Every page of the documentation, by its path in there.
pub(crate) fn pages() -> Vec<String> {
    let (mut found, mut folders) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(docs().join(&folder)).unwrap() {
            let name = folder.join(entry.unwrap().file_name());
            if docs().join(&name).is_dir() {
                folders.push(name);
            } else if name.extension().is_some_and(|it| it == "md") {
                found.push(name.to_str().unwrap().replace('\\', "/"));
            }
        }
    }
    found.retain(|page| page != "SUMMARY.md");
    found.sort();
    found
}

/// A file of the project.
pub(crate) fn text(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// A page, without its blocks of code.
pub(crate) fn prose(page: &str) -> String {
    let mut inside = false;
    let mut kept = String::new();
    for line in page.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if !inside {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    assert!(!inside, "a block of code does not end");
    kept
}

/// What a page has between backticks.
pub(crate) fn quoted(page: &str) -> Vec<String> {
    prose(page).split('`').skip(1).step_by(2).map(String::from).collect()
}
