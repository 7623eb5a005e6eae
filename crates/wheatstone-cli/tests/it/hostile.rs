//! Names that would lead out of a folder, in files that come from others.

use crate::program::{done, refused};
use std::{fs, path::Path};

/// All files and folders within a folder.
fn everything(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        found.push(path.display().to_string());
        if path.is_dir() {
            found.extend(everything(&path));
        }
    }
    found.sort();
    found
}

#[test]
fn names_of_cameras_and_views_write_no_picture_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let at = &folder.path().join("deep/inner");
    fs::create_dir_all(at).unwrap();
    fs::create_dir_all(folder.path().join("deep/victim")).unwrap();
    done(at, &["synth", "--near", "90", "--far", "120", "-o", "capture"]);
    let file = at.join("capture/capture.toml");
    let text = fs::read_to_string(&file).unwrap();
    let views = text.matches("[[views]]").count();
    let hostile =
        ["/../../x", "../victim/rel", "..", "a/b/../../../../y", "/tmp/z", "CON", "new\nline"];
    assert!(views <= hostile.len(), "{views} views");
    let mut names = hostile.iter();
    let renamed: String = text
        .lines()
        .map(|line| match line.strip_prefix("name = ") {
            Some(_) => format!("name = {:?}\n", names.next().unwrap()),
            None => format!("{line}\n"),
        })
        .collect();
    let renamed =
        renamed.replace("left = ", "\"../victim/rel\" = ").replace("right = ", "\"/abs\" = ");
    assert_ne!(renamed, text);
    fs::write(&file, renamed).unwrap();
    let before = everything(folder.path());
    done(at, &["detect", "capture", "--draw", "drawn", "-o", "points.csv"]);
    let drawn = at.join("drawn").display().to_string();
    let new: Vec<String> =
        everything(folder.path()).into_iter().filter(|path| !before.contains(path)).collect();
    let pictures = new.iter().filter(|path| path.ends_with(".png")).count();
    assert_eq!(pictures, 2 * views, "{new:?}");
    assert!(
        new.iter().all(|path| path.starts_with(&drawn) || path.ends_with("points.csv")),
        "{new:?}"
    );
    assert_eq!(fs::read_dir(at.join("drawn")).unwrap().count(), 2 * views);
}

#[test]
fn patterns_that_lead_out_of_a_capture_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    done(at, &["synth", "--near", "90", "--far", "120", "-o", "capture"]);
    let file = at.join("capture/capture.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::rename(at.join("capture/right"), at.join("right")).unwrap();
    fs::write(&file, text.replace("right/*.png", "../right/*.png")).unwrap();
    let message = refused(at, &["detect", "capture"]);
    assert!(message.contains("not in the folder") && message.contains("--follow"), "{message}");
    done(at, &["detect", "capture", "--follow", "-o", "points.csv"]);
    fs::write(&file, text.replace("right/*.png", "/**/*.png")).unwrap();
    refused(at, &["fit", "capture", "-o", "model.json"]);
}
