//! What a model says of itself, whatever was fitted.

use crate::program::{done, refused};
use wheatstone::method::AnyMethod;

#[test]
fn info_works_on_every_method_and_preset() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "--count", "150", "-o", "points.csv"]);
    for method in AnyMethod::all() {
        for preset in method.presets() {
            let name = method.name();
            let mut fit = vec!["fit", "points.csv", "--method", name, "--preset", preset];
            fit.extend(["--no-validation", "--force", "-o", "model.json"]);
            if (name, *preset) == ("network", "paper") {
                fit.extend(["--epochs", "200"]);
            }
            done(at, &fit);
            let (told, _) = done(at, &["info", "model.json"]);
            let of = "Fitted to points.csv, 150 points of 7 views; error on these points";
            for words in
                [of, "World frame: that of X, Y, Z in points.csv", "Baseline of cameras 1 and 2: "]
            {
                assert!(told.contains(words), "{name} {preset}: {words} is not in {told}");
            }
            let (told, _) = done(at, &["info", "model.json", "--json"]);
            let told: serde_json::Value = serde_json::from_str(&told).unwrap();
            // The cameras are 7 cm apart; the straight cameras of the direct linear transformation are a little off.
            let baseline = told["baselines"][0].as_f64().unwrap();
            assert!((baseline - 7.0).abs() < 0.3, "{name} {preset}: {baseline}");
            let angle = told["angles"][0]["rays"].as_f64().unwrap();
            assert!((angle - 4.2).abs() < 0.3, "{name} {preset}: {angle}");
            assert_eq!(told["source"]["name"], "points.csv");
            // No lens without distortion explains these, and every one with it.
            let is_scaled = told["sigma_scale"].is_array();
            assert!(name != "dlt" || is_scaled, "{name} {preset}: {told}");
            let holds = ["brown", "neural-camera"].contains(&name) && *preset == "default";
            assert!(!holds || !is_scaled, "{name} {preset}: {told}");
            let without =
                ["network", "soloff", "interpolation"].contains(&told["method"].as_str().unwrap());
            assert_eq!(told["intrinsics"].is_null(), without, "{name} {preset}");
            for camera in told["intrinsics"].as_array().into_iter().flatten() {
                let focal = &camera["parameters"][0];
                assert!((focal["value"].as_f64().unwrap() - 695.0).abs() < 15.0, "{name}: {focal}");
                assert!(focal["sigma"].as_f64().unwrap() > 0.0, "{name} {preset}: {focal}");
            }
        }
    }
}

#[test]
fn evaluate_names_mismatches_that_make_the_error() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "--count", "150", "-o", "points.csv"]);
    done(at, &["fit", "points.csv", "--method", "brown", "--no-validation", "-o", "model.json"]);
    done(at, &["synth", "--random", "200", "--noise", "0.1", "--seed", "5", "-o", "exam.csv"]);
    let (_, said) = done(at, &["evaluate", "model.json", "exam.csv"]);
    assert!(!said.contains("mismatches"), "{said}");
    // As programs write what a camera did not see.
    let unseen = |(row, line): (usize, &str)| {
        let cells: Vec<&str> = line.split(',').collect();
        let of_one = [&cells[..2], &["-1", "-1"], &cells[4..]].concat();
        if row % 20 == 1 { of_one.join(",") } else { line.to_owned() }
    };
    let text = std::fs::read_to_string(at.join("exam.csv")).unwrap();
    let rows: Vec<String> = text.lines().enumerate().map(|row| unseen(row) + "\n").collect();
    std::fs::write(at.join("unseen.csv"), rows.concat()).unwrap();
    let (_, said) = done(at, &["evaluate", "model.json", "unseen.csv"]);
    assert!(said.contains("10 of 200 points are mismatches"), "{said}");
    assert!(said.contains("leave its cells empty"), "{said}");
}

#[test]
fn noisier_pixels_are_named_once_and_can_be_given() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "-o", "points.csv"]);
    done(at, &["fit", "points.csv", "--method", "brown", "--no-validation", "-o", "model.json"]);
    done(at, &["synth", "--random", "600", "--noise", "0.4", "--seed", "5", "-o", "noisy.csv"]);
    done(at, &["synth", "--random", "600", "--noise", "0.1", "--seed", "6", "-o", "good.csv"]);
    let named = |said: &str| said.matches("the pixels scatter by about 0.4").count();
    let (plain, said) = done(at, &["locate", "model.json", "noisy.csv"]);
    assert_eq!(named(&said), 1, "{said}");
    assert!(!said.contains("belong to these cameras"), "{said}");
    let (given, said) = done(at, &["locate", "model.json", "noisy.csv", "--pixel-sigma", "0.4"]);
    assert!(said.is_empty(), "{said}");
    let mismatches = |table: &str| table.lines().filter(|line| line.ends_with(",yes")).count();
    assert!(mismatches(&plain) > 150 && mismatches(&given) < 6, "{}", mismatches(&given));
    let (_, said) = done(at, &["evaluate", "model.json", "noisy.csv"]);
    assert_eq!(named(&said), 1, "{said}");
    let (_, said) = done(at, &["locate", "model.json", "good.csv"]);
    assert!(said.is_empty(), "{said}");
}

#[test]
fn the_noise_of_pixels_can_be_a_column_of_their_table() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--noise", "0.1", "-o", "points.csv"]);
    done(at, &["fit", "points.csv", "--method", "brown", "--no-validation", "-o", "model.json"]);
    let table = |sigma: &dyn Fn(usize) -> String| {
        let text = std::fs::read_to_string(at.join("points.csv")).unwrap();
        let mut lines = text.lines();
        let header = format!("{},quality,s2\n", lines.next().unwrap());
        let rows = lines.enumerate().map(|(row, line)| format!("{line},{},0.5\n", sigma(row)));
        header + &rows.collect::<String>()
    };
    let alternating = |row: usize| ["0.1", "1"][row % 2].to_owned();
    std::fs::write(at.join("own.csv"), table(&alternating)).unwrap();
    let sigma_z = |arguments: &[&str]| -> Vec<f64> {
        let all = [&["locate", "model.json", "own.csv", "--pixel-sigma"], arguments].concat();
        let (told, _) = done(at, &all);
        let column = told.lines().next().unwrap().split(',').position(|name| name == "sZ").unwrap();
        let cell = |line: &str| line.split(',').nth(column).unwrap().parse().unwrap();
        told.lines().skip(1).map(cell).collect()
    };
    let [good, bad, own, mixed] =
        ["0.1", "1", "quality", "quality,s2"].map(|given| sigma_z(&[given]));
    for row in 0..own.len() {
        assert_eq!(own[row], [&good, &bad][row % 2][row], "{row}");
        // The second camera's pixels are worse than 0.1 and better than 1.
        assert!(good[row] < mixed[row] && mixed[row] < bad[row], "{row}");
    }
    for (cell, words) in [("0", "is `0`"), ("", "is empty"), ("-1", "is `-1`"), ("x", "is `x`")] {
        std::fs::write(at.join("own.csv"), table(&|row| if row == 2 { cell } else { "1" }.into()))
            .unwrap();
        let said = refused(
            at,
            &["locate", "model.json", "own.csv", "--pixel-sigma", "quality", "-o", "o.csv"],
        );
        assert!(said.contains("own.csv:4") && said.contains("`quality`"), "{said}");
        assert!(said.contains(words) && !at.join("o.csv").exists(), "{said}");
    }
    for (given, words) in [("sharp", "no column `sharp`"), ("quality,s2,s2", "3 columns are named")]
    {
        let said = refused(at, &["locate", "model.json", "own.csv", "--pixel-sigma", given]);
        assert!(said.contains(words), "{said}");
    }
    for given in ["0", "-1", "nan", "s1,,s2"] {
        let given = format!("--pixel-sigma={given}");
        assert!(refused(at, &["locate", "model.json", "own.csv", &given]).contains("give a"));
    }
}

#[test]
fn views_that_are_left_out_together_are_called_groups() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    done(at, &["synth", "--points", "--step", "5", "--count", "300", "-o", "points.csv"]);
    let (_, said) = done(at, &["fit", "points.csv", "--method", "dlt", "-o", "model.json"]);
    assert!(said.contains("(leave-one-group-out, 19 views in 12 groups)"), "{said}");
    let (_, said) = done(at, &["compare", "points.csv", "--methods", "dlt"]);
    assert!(said.contains("cross-validation over 19 views in 12 groups, errors in cm"), "{said}");
}
