//! The shape of the code, as tests.

use std::{
    fs,
    path::{Path, PathBuf},
};

fn rust_files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            rust_files(&entry, found);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            found.push(entry);
        }
    }
}

/// Modules in the order `lib.rs` declares them.
fn layers() -> Vec<String> {
    let lib = fs::read_to_string("src/lib.rs").unwrap();
    lib.lines()
        .filter_map(|line| line.trim_start_matches("pub ").strip_prefix("mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

/// The modules a file names after `crate::`, comments left out.
fn used(code: &str) -> Vec<String> {
    let code: String =
        code.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut names = Vec::new();
    for rest in code.split("crate::").skip(1) {
        let group = rest.strip_prefix('{').map_or(rest, |inner| inner.split(';').next().unwrap());
        let mut depth = 0;
        for item in group.split_inclusive(['{', '}', ',']) {
            if depth == 0 {
                names.extend(
                    item.trim()
                        .split(|c: char| !c.is_alphanumeric() && c != '_')
                        .next()
                        .map(str::to_owned),
                );
            }
            depth += item.matches('{').count() as isize - item.matches('}').count() as isize;
            if !rest.starts_with('{') {
                break;
            }
        }
    }
    names
}

#[test]
fn files_fit_on_a_few_screens() {
    const MOST_LINES: usize = 400;
    let mut files = Vec::new();
    for folder in ["src", "tests", "../wheatstone-cli/src", "../wheatstone-cli/tests"] {
        rust_files(Path::new(folder), &mut files);
    }
    for file in files {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= MOST_LINES, "{} has {lines} lines: split it by subject", file.display());
    }
}

#[test]
fn the_map_names_every_module() {
    let map = fs::read_to_string("../../ARCHITECTURE.md").unwrap();
    for module in layers() {
        assert!(map.contains(&format!("`{module}`")), "ARCHITECTURE.md does not name `{module}`");
    }
}

/// A module may use only modules declared above it in `lib.rs`.
#[test]
fn modules_use_only_those_above_them() {
    let layers = layers();
    assert!(layers.len() > 5, "lib.rs was not understood: {layers:?}");
    let mut files = Vec::new();
    rust_files(Path::new("src"), &mut files);
    let mut wrong = Vec::new();
    for file in files {
        let module = file
            .strip_prefix("src")
            .unwrap()
            .iter()
            .next()
            .unwrap()
            .to_str()
            .unwrap()
            .trim_end_matches(".rs")
            .to_owned();
        let Some(own) = layers.iter().position(|l| *l == module) else {
            continue;
        };
        // Unit tests may build on anything, such as synthetic worlds.
        if file.ends_with("tests.rs") {
            continue;
        }
        let text = fs::read_to_string(&file).unwrap();
        for name in used(text.split("#[cfg(test)]").next().unwrap()) {
            if layers.iter().position(|l| *l == name).is_some_and(|other| other > own) {
                wrong.push(format!("{} uses `{name}`, which is below it", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_project_speaks_of_itself_alone() {
    // No machine's paths in code or docs: they mean nothing to whoever reads them elsewhere.
    let mut files = Vec::new();
    for folder in ["src", "../wheatstone-cli/src"] {
        rust_files(Path::new(folder), &mut files);
    }
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for path in ["/home/", "/root/"] {
            assert!(!text.contains(path), "{} names {path}", file.display());
        }
    }
}
