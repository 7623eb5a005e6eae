//! `export` and `convert` as a user meets them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::{
    path::Path,
    process::{Command, Output},
};

fn wheatstone(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wheatstone"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn done(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = wheatstone(folder, arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments:?}: {errors}");
    (String::from_utf8(output.stdout).unwrap(), errors)
}

fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = wheatstone(folder, arguments);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && output.stdout.is_empty(), "{arguments:?}: {errors}");
    assert!(errors.contains("error: ") && errors.contains("hint: "), "{arguments:?}: {errors}");
    errors
}

fn fitted(method: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    done(
        here,
        &[
            "synth",
            "--rig",
            "brown",
            "--points",
            "--count",
            "300",
            "--noise",
            "0.05",
            "-o",
            "points.csv",
        ],
    );
    done(here, &["fit", "points.csv", "--method", method, "--no-validation", "-o", "model.json"]);
    folder
}

#[test]
fn a_model_goes_out_comes_back_and_locates_the_same_points() {
    let folder = fitted("brown");
    let here = folder.path();
    for (format, out, more) in [
        ("opencv", "rig.yml", &[][..]),
        ("anipose", "rig.toml", &["--size", "640x480"][..]),
        ("colmap", "colmap", &["--size", "640x480,640x480"][..]),
        ("mrcal", "mrcal", &["--size", "640x480"][..]),
    ] {
        let export = ["export", "model.json", "--format", format, "-o", out, "--json"];
        let (told, said) = done(here, &[&export[..], more].concat());
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert!(told["loss"].is_null() && told["cameras"] == 2, "{told}");
        assert!(said.contains("Wrote 2 cameras"), "{said}");
        let (_, said) = done(here, &["convert", out, "again.json", "--unit", "cm"]);
        assert!(said.contains("--pixel-sigma"), "{said}");
        let evaluate = |model| {
            let (told, _) = done(here, &["evaluate", model, "points.csv", "--json"]);
            let told: serde_json::Value = serde_json::from_str(&told).unwrap();
            told["rms"].as_f64().unwrap()
        };
        let (own, again) = (evaluate("model.json"), evaluate("again.json"));
        assert!((own / again - 1.0).abs() < 1e-9, "{format}: {own} {again}");
    }
    let errors = refused(here, &["export", "model.json", "--format", "kalibr", "-o", "k.yaml"]);
    assert!(errors.contains("--size") && !here.join("k.yaml").exists(), "{errors}");
    let errors = refused(here, &["convert", "points.csv", "cloud.xyz"]);
    assert!(errors.contains("--to"), "{errors}");
    let errors = refused(here, &["convert", "nothing.yml", "model.json"]);
    assert!(errors.contains("nothing.yml"), "{errors}");
    std::fs::write(here.join("table.parquet"), b"PAR1").unwrap();
    assert!(refused(here, &["convert", "table.parquet", "a.csv"]).contains("Parquet"));
}

#[test]
fn what_a_format_cannot_hold_is_said_in_pixels() {
    let folder = fitted("neural-camera");
    let here = folder.path();
    let export = ["export", "model.json", "--format", "opencv", "-o", "rig.yml", "--json"];
    let (told, said) = done(here, &export);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let rms = told["loss"]["rms"].as_f64().unwrap();
    assert!(rms < 0.2 && told["loss"]["largest"].as_f64().unwrap() >= rms, "{told}");
    assert!(said.contains("warning: ") && said.contains("px rms"), "{said}");
}

#[test]
fn a_table_becomes_what_other_programs_read() {
    let folder = fitted("dlt");
    let here = folder.path();
    done(here, &["convert", "points.csv", "points.npy"]);
    done(here, &["convert", "points.npy", "back.csv"]);
    done(here, &["convert", "points.csv", "points.ply"]);
    done(here, &["convert", "points.csv", "--to", "openptv-targets", "targets"]);
    done(here, &["convert", "targets", "again.csv"]);
    let rows = |name: &str| std::fs::read_to_string(here.join(name)).unwrap().lines().count();
    assert!(rows("points.csv") == rows("back.csv") && rows("back.csv") == rows("again.csv"));
    let (list, _) = done(here, &["list", "formats", "--json"]);
    assert!(list.contains("\"kalibr\"") && list.contains("\"npy\""));
}
