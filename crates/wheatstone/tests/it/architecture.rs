//! The shape of the code, as tests.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The crates from the ground up: each may use only those before it.
const CRATES: [&str; 9] = [
    "wheatstone-numeric",
    "wheatstone-core",
    "wheatstone-charts",
    "wheatstone-io",
    "wheatstone-synthetic",
    "wheatstone-report",
    "wheatstone-robot",
    "wheatstone",
    "wheatstone-cli",
];

fn rust_files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            rust_files(&entry, found);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            found.push(entry);
        }
    }
}

/// The Rust files of every crate.
fn all_files() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for name in CRATES {
        rust_files(&Path::new("..").join(name), &mut files);
    }
    assert!(files.len() > 100, "only {} files were found", files.len());
    files
}

#[test]
fn files_fit_on_a_few_screens() {
    const MOST_LINES: usize = 400;
    for file in all_files() {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= MOST_LINES, "{} has {lines} lines: split it by subject", file.display());
    }
}

#[test]
fn the_map_names_every_crate() {
    let map = fs::read_to_string("../../ARCHITECTURE.md").unwrap();
    for name in CRATES {
        assert!(map.contains(&format!("`{name}`")), "ARCHITECTURE.md does not name `{name}`");
    }
}

/// A crate depends only on those before it, and the program on the facade alone.
#[test]
fn crates_use_only_those_below_them() {
    for (own, name) in CRATES.iter().enumerate() {
        let text = fs::read_to_string(Path::new("..").join(name).join("Cargo.toml")).unwrap();
        let (_, after) = text.split_once("\n[dependencies]\n").unwrap();
        let used = after
            .lines()
            .take_while(|line| !line.starts_with('['))
            .filter_map(|line| line.split(['.', ' ', '=']).next())
            .filter_map(|used| CRATES.iter().position(|name| *name == used));
        for used in used {
            assert!(used < own, "{name} uses {}, which is above it", CRATES[used]);
            let facade = CRATES[used] == "wheatstone";
            assert!(*name != "wheatstone-cli" || facade, "the program uses {}", CRATES[used]);
        }
    }
}

#[test]
fn the_project_speaks_of_itself_alone() {
    // No machine's paths in code: they mean nothing to whoever reads them elsewhere.
    let forbidden = ["home", "root"].map(|folder| format!("/{folder}/"));
    for file in all_files() {
        let text = fs::read_to_string(&file).unwrap();
        for path in &forbidden {
            assert!(!text.contains(path), "{} names {path}", file.display());
        }
    }
}
