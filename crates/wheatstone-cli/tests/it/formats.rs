//! `export` and `convert` as a user meets them.

use crate::program::{done, refused};
use wheatstone::tables::{self, Duplicates};

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
    let three = ["--size", "640x480,640x480,64x48"];
    let errors = refused(
        here,
        &[&["export", "bare.json", "--format", "opencv", "-o", "o.yml"], &three[..]].concat(),
    );
    assert!(errors.contains("`--size` gives 3 sizes, and there are 2 cameras"), "{errors}");
    let errors = refused(here, &["convert", "points.csv", "cloud.xyz"]);
    assert!(errors.contains("--to"), "{errors}");
    let errors = refused(here, &["convert", "nothing.yml", "model.json"]);
    assert!(errors.contains("nothing.yml"), "{errors}");
    std::fs::write(here.join("table.parquet"), b"PAR1").unwrap();
    assert!(refused(here, &["convert", "table.parquet", "a.csv"]).contains("table.parquet"));
}

#[test]
fn fisheyes_leave_as_lenses_of_few_terms_that_hold_over_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let synth = ["synth", "--rig", "fisheye", "--points", "--count", "400", "--noise", "0.1"];
    done(here, &[&synth[..], &["-o", "points.csv"]].concat());
    let fit = ["fit", "points.csv", "--method", "neural-camera", "--no-validation"];
    done(here, &[&fit[..], &["--size", "640x480", "-o", "model.json"]].concat());
    // A lens of another kind follows less nearly, all over the picture; a pinhole would lose ten times as much.
    for (format, most) in [("opencv-fisheye", 0.1), ("opencv", 0.5)] {
        let export = ["export", "model.json", "--format", format, "-o", "rig.yml", "--json"];
        let (told, _) = done(here, &export);
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        let loss = told["loss"].clone();
        assert!(loss["rms"].as_f64().unwrap() < most, "{format}: {loss}");
        let form = loss["form"].as_str().unwrap();
        assert!(
            form.ends_with("coefficient") || form.ends_with("with 2 distortion coefficients"),
            "{form}"
        );
    }
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
fn convert_and_fit_read_what_convert_wrote_without_being_told_what_it_is() {
    let folder = fitted("dlt");
    let here = folder.path();
    let outputs = [
        (&["t.npy"][..], "t.npy"),
        (&["t.parquet"], "t.parquet"),
        (&["t.arrow"], "t.arrow"),
        (&["--to", "openptv-targets", "targets"], "targets"),
        (&["--to", "myptv", "myptv"], "myptv"),
        (&["--to", "proptv", "proptv"], "proptv"),
    ];
    let places = |name: &str| {
        let table = tables::read(&here.join(name), "cm", Duplicates::Keep).unwrap();
        let mut places: Vec<String> =
            table.known().map(|(place, row)| format!("{place} {:?}", row.pixels)).collect();
        places.sort();
        places
    };
    let original = places("points.csv");
    for (to, name) in outputs {
        done(here, &[&["convert", "points.csv"][..], to].concat());
        done(here, &["convert", "--unit", "cm", name, "back.csv"]);
        let back = places("back.csv");
        assert_eq!(original.len(), back.len(), "{name}");
        // OpenPTV's pixels are half a pixel off, and come back within rounding.
        assert!(name == "targets" || original == back, "{name}");
        let fit = ["fit", name, "--unit", "cm", "--method", "dlt", "--no-validation"];
        let (_, said) = done(here, &[&fit[..], &["-o", "again.json"]].concat());
        assert!(said.contains(&format!("to {} points", original.len())), "{name}: {said}");
    }
    for cloud in ["t.ply", "t.pcd"] {
        done(here, &["convert", "points.csv", cloud]);
        done(here, &["convert", cloud, "back.csv"]);
        let back = std::fs::read_to_string(here.join("back.csv")).unwrap();
        assert!(back.starts_with("X,Y,Z\n"), "{back}");
        assert_eq!(back.lines().count(), 1 + original.len(), "{cloud}");
    }
}

#[test]
fn points_without_place_are_left_out_where_they_do_not_go_in_and_counted() {
    let folder = fitted("dlt");
    let here = folder.path();
    let table = std::fs::read_to_string(here.join("points.csv")).unwrap();
    let all = table.lines().count() - 1;
    // Without X, Y, Z from the second row on to the fourth.
    let cut = |(number, line): (usize, &str)| match number {
        2..=4 => line.split(',').take(4).collect::<Vec<_>>().join(",") + ",,,",
        _ => line.into(),
    };
    let cut: Vec<String> = table.lines().enumerate().map(cut).collect();
    let columns = table.lines().next().unwrap().split(',').count();
    let fill = |line: &String| line.clone() + &",".repeat(columns - line.split(',').count());
    let cut: String = cut.iter().map(|line| fill(line) + "\n").collect();
    std::fs::write(here.join("cut.csv"), cut).unwrap();
    for to in [&["--to", "myptv", "a"][..], &["--to", "proptv", "b"], &["c.ply"], &["d.pcd"]] {
        let (told, said) = done(here, &[&["convert", "cut.csv", "--json"][..], to].concat());
        let left_out = format!("note: left out 3 of {all} points, which have no X, Y, Z");
        assert!(said.contains(&left_out), "{said}");
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert_eq!((&told["left_out"], &told["points"]), (&3.into(), &(all - 3).into()));
    }
    let (_, said) = done(here, &["convert", "cut.csv", "e.npy"]);
    assert!(!said.contains("left out") && said.contains(&format!("Wrote {all} points")), "{said}");
    let none: String = table
        .lines()
        .map(|line| line.split(',').take(4).collect::<Vec<_>>().join(",") + "\n")
        .collect();
    std::fs::write(here.join("none.csv"), none).unwrap();
    let said = refused(here, &["convert", "none.csv", "--to", "myptv", "f"]);
    assert!(said.contains("locate") && !here.join("f").exists(), "{said}");
}

#[test]
fn cameras_for_openptv_and_myptv_come_back() {
    let folder = fitted("brown");
    let here = folder.path();
    let exam = ["evaluate", "model.json", "points.csv", "--unit", "cm", "--json"];
    let error = |model: &str| {
        let arguments: Vec<&str> =
            exam.iter().map(|word| if *word == "model.json" { model } else { word }).collect();
        let told: serde_json::Value = serde_json::from_str(&done(here, &arguments).0).unwrap();
        told["rms"].as_f64().unwrap()
    };
    let own = error("model.json");
    let export = ["export", "model.json", "--format", "openptv", "--size", "640x480", "-o", "cal"];
    let (told, said) = done(here, &[&export[..], &["--json"]].concat());
    assert!(said.contains("distortion about the middle of the picture was fitted"), "{said}");
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert!(told["loss"]["rms"].as_f64().unwrap() < 0.03, "{told}");
    done(here, &["convert", "--unit", "mm", "cal", "openptv.json"]);
    let told = done(here, &["convert", "openptv.json", "--to", "opencv", "a.yml", "--json"]).0;
    assert!(told.contains("\"loss\": null"), "{told}");
    let imported = serde_json::from_str::<serde_json::Value>(&told).unwrap();
    assert_eq!(imported["unit"], "mm");
    // OpenPTV's lengths are millimetres.
    let again = 0.1 * error("openptv.json");
    assert!((again / own - 1.0).abs() < 0.02, "{again} {own}");

    // No lens distortion goes into MyPTV's cameras: what is lost is told in pixels.
    let export =
        ["export", "model.json", "--format", "myptv-cameras", "--size", "640x480", "-o", "cams"];
    let (_, said) = done(here, &export);
    assert!(said.contains("pinhole without distortion was fitted"), "{said}");
    done(here, &["convert", "--unit", "cm", "cams", "myptv.json"]);
    let first = std::fs::read_to_string(here.join("cams/cam1")).unwrap();
    done(here, &["convert", "myptv.json", "--to", "myptv-cameras", "again"]);
    let again = std::fs::read_to_string(here.join("again/cam1")).unwrap();
    let numbers = |text: &str| -> Vec<f64> {
        text.lines().skip(2).flat_map(str::split_whitespace).map(|n| n.parse().unwrap()).collect()
    };
    for (a, b) in numbers(&first).into_iter().zip(numbers(&again)) {
        assert!((a - b).abs() <= 1e-9 * a.abs().max(1.0), "{a} {b}");
    }
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
        // A model names the table that it was fitted to, which its checksum covers.
        let content = |name: &str| read(name).split(",\"checksum\"").next().unwrap().to_owned();
        let again = content("again.json").replace("points.parquet", "points.csv");
        assert_eq!(content("model.json"), again, "{input}");
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
        // Text holds places to three digits beyond their standard deviation, Parquet all bits.
        let number = |cell: &str| cell.parse::<f64>().unwrap();
        let whole: Vec<f64> = first.split(',').skip(4).take(3).map(number).collect();
        for (axis, whole) in whole.into_iter().enumerate() {
            let (told, sigma) = (number(cells[9 + axis]), number(cells[12 + axis]));
            assert!((told - whole).abs() <= 0.001 * sigma, "{first} {line}");
            assert!(cells[9 + axis].len() < whole.to_string().len(), "{first} {line}");
        }
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

#[test]
fn a_lens_that_no_format_of_pinholes_holds_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let matrix = |name: &str, [rows, columns]: [usize; 2], data: &str| {
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"
        )
    };
    let lens = |camera: usize| {
        matrix(&format!("K{camera}"), [3, 3], "300, 0, 640, 0, 300, 512, 0, 0, 1")
            + &matrix(&format!("D{camera}"), [1, 4], "-0.03, 0.012, -0.006, 0.001")
    };
    let rig = "%YAML:1.0\n---\nimage_width: 1280\nimage_height: 1024\n".to_owned()
        + &lens(1)
        + &lens(2)
        + &matrix("R", [3, 3], "1, 0, 0, 0, 1, 0, 0, 0, 1")
        + &matrix("T", [3, 1], "-160, 0, 0");
    std::fs::write(here.join("rig.yml"), rig).unwrap();
    let told =
        refused(here, &["convert", "--from", "opencv-fisheye", "rig.yml", "--to", "mrcal", "out"]);
    assert!(told.contains("`mrcal` cannot hold cameras like these"), "{told}");
    assert!(told.contains("`opencv-fisheye`, `kalibr`, `colmap` and `anipose` hold"), "{told}");
}
