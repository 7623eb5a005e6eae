//! `export` and `convert` as a user meets them.

use crate::program::{done, refused};

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
    // The size of the pictures stands in the model, where it was known.
    done(here, &["export", "model.json", "--format", "kalibr", "-o", "kalibr.yaml"]);
    let kalibr = std::fs::read_to_string(here.join("kalibr.yaml")).unwrap();
    assert!(kalibr.contains("[640, 480]"), "{kalibr}");
    std::fs::copy(here.join("points.csv"), here.join("bare.csv")).unwrap();
    let fit = ["fit", "bare.csv", "--method", "brown", "--no-validation", "-o"];
    done(here, &[&fit[..], &["bare.json"]].concat());
    let errors = refused(here, &["export", "bare.json", "--format", "kalibr", "-o", "k.yaml"]);
    assert!(errors.contains("--size") && !here.join("k.yaml").exists(), "{errors}");
    done(here, &[&fit[..], &["sized.json", "--size", "640x480"]].concat());
    done(here, &["export", "sized.json", "--format", "kalibr", "-o", "k.yaml"]);
    let errors = refused(here, &["convert", "points.csv", "cloud.xyz"]);
    assert!(errors.contains("--to"), "{errors}");
    let errors = refused(here, &["convert", "nothing.yml", "model.json"]);
    assert!(errors.contains("nothing.yml"), "{errors}");
    std::fs::write(here.join("table.parquet"), b"PAR1").unwrap();
    assert!(refused(here, &["convert", "table.parquet", "a.csv"]).contains("table.parquet"));
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

#[test]
fn parquet_goes_wherever_text_goes() {
    let folder = fitted("dlt");
    let here = folder.path();
    done(here, &["convert", "points.csv", "points.parquet"]);
    done(here, &["convert", "points.parquet", "back.csv"]);
    let read = |name: &str| std::fs::read_to_string(here.join(name)).unwrap();
    assert_eq!(read("points.csv"), read("back.csv"));
    for input in ["points.csv", "points.parquet"] {
        done(
            here,
            &[
                "fit",
                input,
                "--unit",
                "cm",
                "--method",
                "dlt",
                "--no-validation",
                "-o",
                "again.json",
                "--size",
                "640x480",
            ],
        );
        assert_eq!(read("model.json"), read("again.json"), "{input}");
        done(here, &["locate", "model.json", input, "-o", "located.csv", "--covariance"]);
        done(here, &["locate", "model.json", input, "-o", "located.parquet", "--covariance"]);
        // Text keeps the input's own spelling of numbers, which is the shortest here.
        let (told, _) = done(here, &["locate", "model.json", input, "--covariance"]);
        assert_eq!(told, read("located.csv"), "{input}");
        done(here, &["convert", "located.parquet", "places.csv"]);
        let places = read("places.csv");
        let (first, located) = (places.lines().nth(1).unwrap(), read("located.csv"));
        let line = located.lines().nth(1).unwrap();
        let cells: Vec<&str> = line.split(',').collect();
        assert!(first.contains(&cells[9..12].join(",")), "{first} {line}");
    }
}

#[test]
fn a_model_without_cameras_becomes_a_rectified_pair() {
    let folder = fitted("soloff");
    let here = folder.path();
    let (told, said) = done(
        here,
        &["rectify", "model.json", "--points", "points.csv", "-o", "pair", "--json", "-v"],
    );
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!((&told["left"], &told["right"]), (&1.into(), &2.into()));
    let found = told["points"]["vertical"]["rms"].as_f64().unwrap();
    let measured = told["leftover"]["measured"]["vertical"]["rms"].as_f64().unwrap();
    assert!(found > 0.0 && found < 3.0 && (found / measured - 1.0).abs() < 0.5, "{told}");
    assert!(said.contains("px median") && said.contains("rms by depth"), "{said}");
    done(here, &["export", "model.json", "--format", "remap", "-o", "same"]);
    for file in
        ["left_map_x.npy", "left_map_y.npy", "right_map_x.npy", "right_map_y.npy", "pair.yml"]
    {
        let read = |folder: &str| std::fs::read(here.join(folder).join(file)).unwrap();
        assert!(read("pair") == read("same") && read("pair").len() > 500, "{file}");
    }
    // The virtual pair is a calibration of its own.
    done(here, &["convert", "pair/pair.yml", "pair.json"]);
    done(here, &["rectify", "pair.json", "-o", "twice", "--rectified-size", "320x200"]);
    let size = std::fs::metadata(here.join("twice/left_map_x.npy")).unwrap().len();
    assert!((4 * 320 * 200..4 * 320 * 200 + 256).contains(&size), "{size}");
    let errors = refused(here, &["rectify", "model.json", "--cameras", "1,3", "-o", "no"]);
    assert!(errors.contains("counted from 1") && !here.join("no").exists(), "{errors}");
}
