//! Captures as they are begun, printed and recorded, with what is missing in them.

use crate::program::{done, refused};
use std::{fs, path::Path};

#[test]
fn a_chart_fits_its_paper_or_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (_, said) = done(at, &["chart", "--paper", "a4", "-o", "board.pdf"]);
    assert!(said.contains("9 columns x 6 rows of inner corners, squares of 25 mm"), "{said}");
    let pdf = fs::read_to_string(at.join("board.pdf")).unwrap();
    let media = pdf.split("/MediaBox [0 0 ").nth(1).unwrap().split(']').next().unwrap();
    let side = |word: &str| word.parse::<f64>().unwrap() / 72.0 * 25.4;
    let (width, height) = media.split_once(' ').unwrap();
    assert!((side(width) - 297.0).abs() < 1e-9 && (side(height) - 210.0).abs() < 1e-9, "{media}");
    let said = refused(at, &["chart", "--pitch", "30", "--paper", "a4", "-o", "large.pdf"]);
    assert!(said.contains("at most 25 mm") && !at.join("large.pdf").exists(), "{said}");
    let said = refused(at, &["chart", "-o", "board.png"]);
    assert!(said.contains("`.pdf` or `.svg`") && !at.join("board.png").exists(), "{said}");
    // What is written is what fits in every unit, and on every paper.
    for (unit, pitch) in [("cm", "2.5"), ("in", "1")] {
        let chart = ["chart", "--paper", "letter", "--unit", unit, "-o", "chart.svg"];
        let (_, said) = done(at, &chart);
        let millimetres = if unit == "cm" { "squares of 25 mm" } else { "squares of 25.4 mm" };
        assert!(said.contains(millimetres), "{said}");
        done(at, &[&chart[..], &["--pitch", pitch]].concat());
    }
}

/// Copies the pictures of one capture to another.
fn copy_pictures(from: &Path, to: &Path) {
    for camera in ["left", "right"] {
        for entry in fs::read_dir(from.join(camera)).unwrap().map(|entry| entry.unwrap().path()) {
            fs::copy(&entry, to.join(camera).join(entry.file_name().unwrap())).unwrap();
        }
    }
}

#[test]
fn a_capture_for_a_board_in_the_hand_needs_pictures_alone() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let (_, said) = done(at, &["new", "waved/", "--hand-held"]);
    assert!(said.contains("tilted another way"), "{said}");
    assert!(said.contains("print waved/chart.pdf"), "{said}");
    let text = fs::read_to_string(at.join("waved/capture.toml")).unwrap();
    assert!(!text.contains("\n[[views]]"), "{text}");
    done(at, &["new", "alone", "--hand-held", "--cameras", "only"]);
    done(at, &["synth", "--hand-held", "8", "--chart", "chessboard", "--seed", "2", "-o", "made"]);
    copy_pictures(&at.join("made"), &at.join("waved"));
    let fit = ["fit", "waved", "--method", "brown", "--no-validation", "-o", "model.json"];
    let (_, said) = done(at, &fit);
    let frame = "World frame: the chart's in view 001: X right along the chart's rows";
    assert!(said.contains(frame), "{said}");
    let (told, _) = done(at, &["info", "model.json"]);
    assert!(
        told.contains(frame) && told.contains("Fitted to waved, 432 points of 8 views"),
        "{told}"
    );
    let fit = [&fit[..], &["--gauge", "first-camera"]].concat();
    assert!(done(at, &fit).1.contains("World frame: camera 1's: X right, Y down, Z forward"));
    let (told, _) = done(at, &["info", "model.json"]);
    assert!(told.contains("at X 0, Y 0, Z 0 mm; optical axis along 0.000, 0.000, 1.000"), "{told}");
}

#[test]
fn a_picture_that_one_camera_lacks_leaves_a_view_without_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "-o", "capture"]);
    fs::remove_file(at.join("capture/right/080.png")).unwrap();
    let note = "note: there is no picture of view 080 by `right`";
    let (points, said) = done(at, &["detect", "capture"]);
    assert!(said.contains(note) && said.contains("63  no picture"), "{said}");
    assert!(said.contains("found in 13 of 13 pictures; 378 points"), "{said}");
    let rows = |view: &str| points.lines().filter(|line| line.contains(view)).count();
    assert_eq!((rows(",080,"), rows(",065,")), (63, 63));
    assert!(points.lines().filter(|line| line.contains(",080,")).all(|line| line.contains(",,")));
    let (_, said) = done(at, &["check", "capture"]);
    assert!(said.contains(note) && said.contains("No fault found in 441 points"), "{said}");
    let fit = ["fit", "capture", "--method", "dlt", "-o", "model.json"];
    let (_, said) = done(at, &fit);
    assert!(said.contains(note) && said.contains("Fitted dlt to 378 points"), "{said}");
    assert!(said.contains("the stage moves along Z"), "{said}");
    let report = ["report", "model.json", "--pictures", "capture", "-o", "page.html"];
    done(at, &[&report[..], &["--figures", "figures"]].concat());
    let scene = fs::read_to_string(at.join("figures/scene.svg")).unwrap();
    assert!(scene.contains("seen by one camera alone: 63"), "no legend");
    assert_eq!(scene.matches("class=\"ring\"").count(), 64, "rings of 63 points and of the legend");
    for name in [">X</text>", ">Y</text>", ">Z</text>", ">20 cm</text>"] {
        assert!(scene.contains(name), "{name}");
    }

    // Pictures of a capture that the model was not fitted to.
    done(at, &["synth", "--near", "80", "--far", "110", "--step", "30", "-o", "other"]);
    let report = ["report", "model.json", "--pictures", "other", "-o", "other.html"];
    let (_, said) = done(at, &report);
    assert!(said.contains("126 points and the model was fitted to 378: are they those"), "{said}");
}

#[test]
fn a_scene_stands_beside_the_charts_and_is_no_camera_of_the_capture() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let charts = ["synth", "--near", "80", "--far", "110", "--step", "30"];
    done(at, &[&charts[..], &["-o", "plain"]].concat());
    let (_, said) = done(at, &[&charts[..], &["--scene", "-o", "capture"]].concat());
    assert!(said.contains("Wrote capture: 4 pictures of a chart"), "{said}");
    for name in ["left.png", "left_points.npy", "right.png", "right_points.npy"] {
        assert!(at.join("capture/scene").join(name).is_file(), "{name}");
    }
    let points = |capture: &str| done(at, &["detect", capture]).0;
    assert_eq!(points("plain"), points("capture"));
    for option in [&["--points"][..], &["--random", "10"]] {
        let arguments = [&["synth", "--scene"][..], option, &["-o", "t.csv"]].concat();
        let message = refused(at, &arguments);
        assert!(message.contains("--scene") && message.contains(option[0]), "{message}");
    }
}
