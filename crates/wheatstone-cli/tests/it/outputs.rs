//! What `-o` does to what stands at its place: files are replaced, links kept, pipes written through, inputs refused.

use crate::program::command;
use std::{
    fs,
    io::Read,
    os::unix::fs::{FileTypeExt, PermissionsExt, symlink},
    path::Path,
};

/// Verbs that write one file: their arguments before its name, its extension, and what of the arguments is an input.
const VERBS: [(&[&str], &str, &[&str]); 6] = [
    (&["fit", "points.csv", "--method", "brown", "--no-validation", "-o"], "json", &["points.csv"]),
    (&["locate", "model.json", "points.csv", "-o"], "csv", &["model.json", "points.csv"]),
    (&["export", "model.json", "--format", "opencv", "-o"], "yml", &["model.json"]),
    (&["convert", "points.csv"], "csv", &["points.csv"]),
    (&["check", "points.csv", "--fix"], "csv", &["points.csv"]),
    (&["chart", "-o"], "pdf", &[]),
];

fn run(folder: &Path, arguments: &[&str], output: &str) -> Option<i32> {
    let done = command(folder, &[arguments, &[output]].concat()).output().unwrap();
    assert!(!String::from_utf8_lossy(&done.stderr).contains("panicked"));
    done.status.code()
}

/// A folder with points and a model.
fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let points = ["synth", "--points", "--noise", "0.1", "--count", "200", "-o"];
    assert_eq!(run(folder.path(), &points, "points.csv"), Some(0));
    assert_eq!(run(folder.path(), VERBS[0].0, "model.json"), Some(0));
    folder
}

#[test]
fn a_link_stays_and_its_target_is_replaced() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    for (arguments, extension, _) in VERBS {
        let [plain, target, link] =
            ["plain", "target", "link"].map(|name| format!("{name}.{extension}"));
        assert_eq!(run(folder.path(), arguments, &plain), Some(0), "{arguments:?}");
        fs::write(at(&target), "old").unwrap();
        fs::set_permissions(at(&target), fs::Permissions::from_mode(0o600)).unwrap();
        symlink(&target, at(&link)).unwrap();
        assert_eq!(run(folder.path(), arguments, &link), Some(0), "{arguments:?}");
        assert!(fs::symlink_metadata(at(&link)).unwrap().is_symlink(), "{arguments:?}");
        assert_eq!(fs::metadata(at(&target)).unwrap().permissions().mode() & 0o777, 0o600);
        assert!(fs::read(at(&target)).unwrap() == fs::read(at(&plain)).unwrap(), "{arguments:?}");
        [plain, target, link].iter().for_each(|name| fs::remove_file(at(name)).unwrap());
    }
}

#[test]
fn a_pipe_is_written_through() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    for (arguments, extension, _) in VERBS {
        let [plain, pipe] = ["plain", "pipe"].map(|name| format!("{name}.{extension}"));
        assert_eq!(run(folder.path(), arguments, &plain), Some(0), "{arguments:?}");
        let made = std::process::Command::new("mkfifo").arg(at(&pipe)).status().unwrap();
        assert!(made.success());
        let reader = std::thread::spawn({
            let pipe = at(&pipe);
            move || {
                let mut bytes = Vec::new();
                fs::File::open(pipe).unwrap().read_to_end(&mut bytes).unwrap();
                bytes
            }
        });
        assert_eq!(run(folder.path(), arguments, &pipe), Some(0), "{arguments:?}");
        assert!(reader.join().unwrap() == fs::read(at(&plain)).unwrap(), "{arguments:?}");
        assert!(fs::metadata(at(&pipe)).unwrap().file_type().is_fifo(), "{arguments:?}");
        [plain, pipe].iter().for_each(|name| fs::remove_file(at(name)).unwrap());
    }
}

#[test]
fn an_input_is_not_written_over() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    for (arguments, _, inputs) in VERBS {
        for input in inputs {
            let before = fs::read(at(input)).unwrap();
            // By its name, by another, and by a link.
            symlink(input, at("link")).unwrap();
            for name in [(*input).to_owned(), format!("./{input}"), "link".to_owned()] {
                assert_eq!(run(folder.path(), arguments, &name), Some(2), "{arguments:?} {name}");
            }
            fs::remove_file(at("link")).unwrap();
            assert!(fs::read(at(input)).unwrap() == before, "{arguments:?} {input}");
        }
    }
}
