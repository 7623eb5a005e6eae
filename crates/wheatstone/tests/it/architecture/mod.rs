//! The shape of the code, as tests.

mod graph;
mod source;

use graph::Crate;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// The crates, each of which may use only those before it.
const CRATES: [&str; 12] = [
    "wheatstone-numeric",
    "wheatstone-core",
    "wheatstone-stereo",
    "wheatstone-charts",
    "wheatstone-io",
    "wheatstone-synthetic",
    "wheatstone-report",
    "wheatstone-reconstruction",
    "wheatstone-robot",
    "wheatstone",
    "wheatstone-cli",
    "wheatstone-py",
];

fn folder(name: &str) -> PathBuf {
    Path::new("..").join(name)
}

fn rust_files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            rust_files(&entry, found);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            found.push(entry);
        }
    }
}

#[test]
fn files_fit_on_a_few_screens() {
    const MOST_LINES: usize = 400;
    let mut files = Vec::new();
    CRATES.iter().for_each(|name| rust_files(&folder(name), &mut files));
    assert!(files.len() > 300, "{files:?}");
    for file in files {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= MOST_LINES, "{} has {lines} lines: split it by subject", file.display());
    }
}

/// The crates of this workspace that one depends on, tests aside.
fn dependencies(name: &str) -> Vec<String> {
    let text = fs::read_to_string(folder(name).join("Cargo.toml")).unwrap();
    let mut section = "";
    let mut found = Vec::new();
    for line in text.lines().map(str::trim) {
        if line.starts_with('[') {
            section = line;
        } else if section.ends_with("dependencies]") && !section.contains("dev-") {
            let key = line.split(['.', ' ', '=']).next().unwrap();
            found.extend(key.starts_with("wheatstone").then(|| key.to_owned()));
        }
    }
    found
}

#[test]
fn a_crate_uses_only_those_above_it() {
    let mut folders: Vec<String> = fs::read_dir("..")
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    folders.sort();
    let mut named = CRATES.to_vec();
    named.sort_unstable();
    assert_eq!(folders, named);
    for (own, name) in CRATES.iter().enumerate() {
        for used in dependencies(name) {
            let other = CRATES.iter().position(|other| *other == used);
            assert!(other.is_some_and(|other| other < own), "{name} uses {used}");
        }
    }
    assert_eq!(dependencies("wheatstone-core"), ["wheatstone-numeric"]);
    for name in ["wheatstone-cli", "wheatstone-py"] {
        assert_eq!(dependencies(name), ["wheatstone"], "{name} uses the facade alone");
    }
}

#[test]
fn every_crate_carries_the_licences() {
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        let text = fs::read_to_string(Path::new("../..").join(licence)).unwrap();
        for name in CRATES {
            let own = fs::read_to_string(Path::new("..").join(name).join(licence));
            assert_eq!(own.ok().as_ref(), Some(&text), "{licence} of {name}");
        }
    }
}

#[test]
fn the_map_names_every_crate_and_module() {
    let map = fs::read_to_string("../../ARCHITECTURE.md").unwrap();
    for name in CRATES {
        assert!(map.contains(&format!("`{name}`")), "ARCHITECTURE.md does not name `{name}`");
        for module in Crate::read(&folder(name)).layers() {
            assert!(
                map.contains(&format!("`{module}`")),
                "ARCHITECTURE.md does not name `{module}` of {name}"
            );
        }
    }
}

/// In these crates a module may use only modules declared above it in `lib.rs`.
#[test]
fn modules_use_only_those_above_them() {
    for name in ["wheatstone-core", "wheatstone-charts"] {
        let read = Crate::read(&folder(name));
        let place = |module: &str| read.layers().iter().position(|layer| *layer == module);
        let uses = read.uses_of_layers();
        assert!(uses.len() > 10, "{name} was not understood");
        let wrong: Vec<String> = uses
            .iter()
            .filter(|(_, own, other)| place(own) < place(other))
            .map(|(file, _, other)| format!("{name}: {file} uses `{other}`, which is below it"))
            .collect();
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}

#[test]
fn files_do_not_use_each_other_in_circles() {
    let mut found = Vec::new();
    for name in CRATES {
        let read = Crate::read(&folder(name));
        for circle in read.circles() {
            let uses = read.uses_among(&circle).join("\n    ");
            found.push(format!("{name}: {}\n    {uses}", circle.join(" <-> ")));
        }
    }
    assert!(found.is_empty(), "circles:\n{}", found.join("\n"));
}

/// Words of our own for which the field has a term.
#[test]
fn names_are_the_words_of_the_field() {
    const FORBIDDEN: [&str; 10] = [
        "hear",
        "Believed",
        "Complaint",
        "Witness",
        "LooseCamera",
        "Mishap",
        "Told",
        "sees",
        "meeting",
        "voice",
    ];
    let mut found = Vec::new();
    for name in CRATES {
        for (file, source) in Crate::read(&folder(name)).sources() {
            for word in FORBIDDEN {
                if source.tokens.iter().any(|token| token.is(word)) {
                    found.push(format!("{name}: {file} has `{word}`"));
                }
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Programs differ in how they are called: hints carry a `Remedy`, and each program has its words.
#[test]
fn the_library_names_no_options_of_a_program() {
    let mut files = Vec::new();
    for name in CRATES.iter().filter(|name| !matches!(**name, "wheatstone-cli" | "wheatstone-py")) {
        rust_files(&folder(name).join("src"), &mut files);
    }
    files.retain(|file| !file.ends_with("tests.rs"));
    assert!(files.len() > 300, "{files:?}");
    for file in files {
        // Readers of tables are still to follow.
        if file.starts_with("../wheatstone-io/src/tables") {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for option in ["`--", "`wheatstone "] {
                assert!(!line.contains(option), "{} names an option: {line}", file.display());
            }
        }
    }
}

#[test]
fn the_project_speaks_of_itself_alone() {
    // No machine's paths in code or docs: they mean nothing to whoever reads them elsewhere.
    let mut files = Vec::new();
    CRATES.iter().for_each(|name| rust_files(&folder(name).join("src"), &mut files));
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for path in ["/home/", "/root/"] {
            assert!(!text.contains(path), "{} names {path}", file.display());
        }
    }
}
