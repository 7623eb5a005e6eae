//! `wheatstone check` as a user meets it.

use crate::program::{done, said, wheatstone};
use std::path::Path;

/// A points file in which the two cameras are exchanged in one view.
fn swapped(folder: &Path) {
    let made = wheatstone(folder, &["synth", "--points", "--noise", "0.1", "-o", "good.csv"]);
    assert!(made.status.success(), "{}", said(&made));
    let text = std::fs::read_to_string(folder.join("good.csv")).unwrap();
    let mut lines = text.lines();
    let mut bad = lines.next().unwrap().to_owned() + "\n";
    assert!(bad.starts_with("x1,y1,x2,y2,X,Y,Z,view"));
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[7] == "080" {
            let own = [cells[2], cells[3], cells[0], cells[1]].join(",");
            bad += &format!("{own},{}\n", cells[4..].join(","));
        } else {
            bad += &format!("{line}\n");
        }
    }
    std::fs::write(folder.join("bad.csv"), bad).unwrap();
}

#[test]
fn a_fault_is_named_told_of_and_put_right() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    swapped(at);
    let good = wheatstone(at, &["check", "good.csv"]);
    assert!(good.status.success() && good.stdout.is_empty(), "{}", said(&good));
    assert!(said(&good).contains("No fault found"), "{}", said(&good));
    let text = said(&good);
    let after = text.split("camera 2 is ").nth(1).unwrap();
    let baseline: f64 = after.split_whitespace().next().unwrap().parse().unwrap();
    assert!((baseline - 7.0).abs() < 0.07, "{text}");
    let bad = wheatstone(at, &["check", "bad.csv", "--json"]);
    assert_eq!(bad.status.code(), Some(1), "{}", said(&bad));
    let told: serde_json::Value = serde_json::from_slice(&bad.stdout).unwrap();
    let finding = &told["findings"][0];
    assert_eq!(finding["code"], "cameras-swapped");
    assert_eq!(finding["severity"], "fatal");
    assert_eq!(finding["views"], serde_json::json!(["080"]));
    assert_eq!(finding["cameras"], serde_json::json!([1, 2]));
    assert_eq!(finding["fixable"], true);
    assert!(finding["hint"].as_str().is_some_and(|hint| !hint.is_empty()));
    assert!(told["cannot_be_seen"].as_array().is_some_and(|all| all.len() >= 3));
    let text = said(&wheatstone(at, &["check", "bad.csv"]));
    assert!(text.contains("fatal[cameras-swapped]: cameras 1, 2, view `080`"), "{text}");
    assert!(text.contains("error: fatal faults in the data: cameras-swapped"), "{text}");
    let fixed = wheatstone(at, &["check", "bad.csv", "--fix", "fixed.csv"]);
    assert!(fixed.status.success(), "{}", said(&fixed));
    let [good, fixed] =
        ["good.csv", "fixed.csv"].map(|name| std::fs::read_to_string(at.join(name)).unwrap());
    assert_eq!(fixed, good);
}

/// What shows only once boards in the hand are placed is put right in what was recorded.
#[test]
fn a_fault_of_a_board_in_the_hand_is_put_right_too() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let synth = ["synth", "--points", "--hand-held", "10", "--noise", "0.1", "-o", "good.csv"];
    assert!(wheatstone(at, &synth).status.success());
    let text = std::fs::read_to_string(at.join("good.csv")).unwrap();
    let columns: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert_eq!(columns, ["x1", "y1", "x2", "y2", "board_x", "board_y", "view", "id"]);
    let swapped = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        match cells[6] {
            "004" => [&cells[2..4], &cells[..2], &cells[4..]].concat().join(","),
            _ => line.into(),
        }
    };
    let bad: Vec<String> = text.lines().map(swapped).collect();
    std::fs::write(at.join("bad.csv"), bad.join("\n") + "\n").unwrap();
    let told = said(&wheatstone(at, &["check", "bad.csv"]));
    assert!(told.contains("fatal[cameras-swapped]: cameras 1, 2, view `004`"), "{told}");
    assert!(told.contains("`wheatstone check --fix OUT` does"), "{told}");
    let fixed = wheatstone(at, &["check", "bad.csv", "--fix", "fixed.csv"]);
    assert!(fixed.status.success(), "{}", said(&fixed));
    assert_eq!(std::fs::read_to_string(at.join("fixed.csv")).unwrap(), text);
    let refused = wheatstone(at, &["fit", "bad.csv", "-o", "model.json"]);
    assert!(said(&refused).contains("`--fix`"), "{}", said(&refused));
    let fit = wheatstone(at, &["fit", "bad.csv", "--fix", "--method", "brown", "-o", "model.json"]);
    assert!(fit.status.success(), "{}", said(&fit));
    assert!(said(&fit).contains("corrected: cameras 1, 2, view `004`"), "{}", said(&fit));
    // Its world frame is none that a table of a stage has.
    let stage = ["synth", "--points", "--noise", "0.1", "-o", "stage.csv"];
    assert!(wheatstone(at, &stage).status.success());
    let judged = wheatstone(at, &["evaluate", "model.json", "stage.csv"]);
    assert!(said(&judged).contains("their world frame is not the model's"), "{}", said(&judged));
    assert!(!said(&judged).contains("Contributions to its squared error"), "{}", said(&judged));
    let judged = wheatstone(at, &["evaluate", "model.json", "stage.csv", "--align"]);
    assert!(!said(&judged).contains("their world frame"), "{}", said(&judged));
    assert!(said(&judged).contains("Contributions to its squared error"), "{}", said(&judged));
    let of_no_view = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[..6].join(",")
    };
    let bare: Vec<String> = text.lines().map(of_no_view).collect();
    std::fs::write(at.join("bare.csv"), bare.join("\n") + "\n").unwrap();
    let fit = wheatstone(at, &["fit", "bare.csv", "-o", "other.json"]);
    assert!(said(&fit).contains("no column `view`"), "{}", said(&fit));
}

/// A picture of another instant cannot be corrected: the file is written without it, and the exit status tells.
#[test]
fn a_picture_that_is_left_out_is_told_by_the_exit_status() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    swapped(at);
    let text = std::fs::read_to_string(at.join("good.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let of = |view: &str| rows.iter().filter(|row| row[7] == view).collect::<Vec<_>>();
    let mut other = of("095").into_iter();
    let mut bad = String::new();
    for row in &rows {
        let mut row = row.clone();
        if row[7] == "080" {
            let other = other.next().expect("as many points as in the other view");
            (row[2], row[3]) = (other[2], other[3]);
        }
        bad += &format!("{}\n", row.join(","));
    }
    std::fs::write(at.join("bad.csv"), bad).unwrap();
    let fixed = wheatstone(at, &["check", "bad.csv", "--fix", "fixed.csv"]);
    assert_eq!(fixed.status.code(), Some(1), "{}", said(&fixed));
    let told = said(&fixed);
    assert!(told.contains("left out: view `080` of camera 2"), "{told}");
    let again = wheatstone(at, &["check", "fixed.csv"]);
    assert!(again.status.success(), "{}", said(&again));
}

/// How much larger a chart was printed, the pixels tell with an error, which a calibration would take on.
#[test]
fn an_estimate_is_told_by_the_exit_status_and_fitted_on_request_only() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    swapped(at);
    let text = std::fs::read_to_string(at.join("good.csv")).unwrap();
    let larger = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(String::from).collect();
        if cells[7] == "080" {
            for cell in &mut cells[4..6] {
                *cell = (1.1 * cell.parse::<f64>().unwrap()).to_string();
            }
        }
        cells.join(",")
    };
    let bad: Vec<String> = text.lines().map(larger).collect();
    std::fs::write(at.join("bad.csv"), bad.join("\n") + "\n").unwrap();
    let fixed = wheatstone(at, &["check", "bad.csv", "--fix", "fixed.csv"]);
    assert_eq!(fixed.status.code(), Some(1), "{}", said(&fixed));
    assert!(said(&fixed).contains("corrected by an estimate"), "{}", said(&fixed));
    let fit = ["fit", "bad.csv", "--fix", "--method", "dlt", "-o", "model.json"];
    let refused = wheatstone(at, &fit);
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(said(&refused).contains("is an estimate from the pixels"), "{}", said(&refused));
    assert!(said(&refused).contains("`--force` continues anyway"), "{}", said(&refused));
    assert!(!at.join("model.json").exists());
    let insisted = wheatstone(at, &[&fit[..], &["--force"]].concat());
    assert!(insisted.status.success(), "{}", said(&insisted));
}

#[test]
fn a_measured_baseline_is_compared() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    swapped(at);
    let right = wheatstone(at, &["check", "good.csv", "--expect-baseline", "7:5%"]);
    assert!(right.status.success(), "{}", said(&right));
    let wrong = wheatstone(at, &["check", "good.csv", "--expect-baseline", "70"]);
    assert_eq!(wrong.status.code(), Some(1));
    assert!(said(&wrong).contains("baseline-differs"), "{}", said(&wrong));
    for text in ["wide", "0", "7:-1%", "7:x"] {
        let refused = wheatstone(at, &["check", "good.csv", "--expect-baseline", text]);
        assert_eq!(refused.status.code(), Some(2), "{text}");
    }
}

#[test]
fn a_measured_baseline_is_compared_for_boards_in_the_hand() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let synth =
        ["synth", "--hand-held", "8", "--chart", "chessboard", "--seed", "2", "-o", "waved"];
    assert!(wheatstone(at, &synth).status.success());
    let right = wheatstone(at, &["check", "waved", "--expect-baseline", "7:1%"]);
    assert!(right.status.success(), "{}", said(&right));
    assert!(said(&right).contains("by these data, as measured (ratio"), "{}", said(&right));
    let wrong = wheatstone(at, &["check", "waved", "--expect-baseline", "7.7:1%"]);
    assert_eq!(wrong.status.code(), Some(1));
    assert!(said(&wrong).contains("baseline-differs"), "{}", said(&wrong));
}

#[test]
fn the_survey_prints_its_table() {
    let dir = tempfile::tempdir().unwrap();
    let output = wheatstone(dir.path(), &["check", "--survey", "4", "--seed", "1"]);
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("| fault | captures | identified"), "{text}");
    assert!(
        text.contains("cameras swapped in some views") && text.contains("false alarms"),
        "{text}"
    );
    let neither = wheatstone(dir.path(), &["check"]);
    assert_eq!(neither.status.code(), Some(2));
}

/// Today's points with the pixels of camera 2 lower by half a pixel, of so many columns.
fn lowered(folder: &Path, name: &str, columns: usize) {
    let text = std::fs::read_to_string(folder.join("today.csv")).unwrap();
    let mut lines = text.lines();
    let cut = |line: &str| line.split(',').take(columns).collect::<Vec<_>>().join(",");
    let mut moved = cut(lines.next().unwrap()) + "\n";
    for line in lines {
        let mut cells: Vec<String> = line.split(',').take(columns).map(str::to_owned).collect();
        cells[3] = (cells[3].parse::<f64>().unwrap() + 0.5).to_string();
        moved += &format!("{}\n", cells.join(","));
    }
    std::fs::write(folder.join(name), moved).unwrap();
}

#[test]
fn cameras_are_checked_against_the_model_that_knows_them() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let made = ["synth", "--points", "--noise", "0.1", "-o"];
    done(at, &[&made[..], &["session.csv"]].concat());
    let later = ["today.csv", "--near", "70", "--far", "110", "--step", "20", "--seed", "1"];
    done(at, &[&made[..], &later].concat());
    done(at, &["fit", "session.csv", "--method", "brown", "-o", "model.json"]);
    let against =
        |name: &str| wheatstone(at, &["check", name, "--against", "model.json", "--json"]);
    let told = |output: &std::process::Output| -> serde_json::Value {
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let same = against("today.csv");
    assert!(same.status.success(), "{}", said(&same));
    assert_eq!(told(&same)["verdict"], "unchanged");
    assert!(told(&same)["chance"].as_f64().unwrap() > 5e-4);
    lowered(at, "moved.csv", 9);
    let moved = against("moved.csv");
    assert_eq!(moved.status.code(), Some(1), "{}", said(&moved));
    assert!(said(&moved).contains("error: Camera 2 moved since"), "{}", said(&moved));
    let change = &told(&moved)["changes"][0];
    assert_eq!(change["cameras"], serde_json::json!([2]));
    // Half a pixel of a focal length of some 620.
    let pitch = change["turn"][0].as_f64().unwrap();
    assert!((pitch.abs() - 0.046).abs() < 0.01, "{change:#}");
    // The pixels alone show it too, though not of which camera, and tell what they hide.
    lowered(at, "matches.csv", 4);
    let matches = against("matches.csv");
    assert_eq!(told(&matches)["known"], "matches");
    assert_eq!(told(&matches)["changes"][0]["cameras"].as_array().map(Vec::len), Some(2));
    let text = said(&wheatstone(at, &["check", "matches.csv", "--against", "model.json"]));
    assert!(text.contains("yaw cannot be seen"), "{text}");
    // Cameras of another program come without their uncertainty.
    done(at, &["export", "model.json", "--format", "opencv", "-o", "cameras.yml"]);
    done(at, &["convert", "cameras.yml", "imported.json", "--unit", "cm"]);
    let imported = said(&wheatstone(at, &["check", "matches.csv", "--against", "imported.json"]));
    assert!(imported.contains("its cameras are taken for exact"), "{imported}");
    assert!(imported.contains("moved: "), "{imported}");
    let refused = wheatstone(at, &["check", "today.csv", "--against", "today.csv"]);
    assert!(said(&refused).contains("not a model file"), "{}", said(&refused));
}
