//! Files that are not what their names or their readers take them for: refused by name, with the way out.

use crate::program::{done, refused};
use std::{fs, path::Path};
use wheatstone::{
    formats::{FORMATS, Layout},
    synthetic::Truth,
};

fn fitted(at: &Path) {
    done(at, &["synth", "--points", "--rig", "pinhole", "--noise", "0.05", "-o", "points.csv"]);
    let fit = ["fit", "points.csv", "--method", "dlt", "--no-validation", "--size", "640x480"];
    done(at, &[&fit[..], &["-o", "model.json"]].concat());
}

#[test]
fn a_name_that_promises_another_kind_of_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    fitted(at);
    for (format, output, words) in [
        ("opencv", "x.json", ["written as YAML", "promises JSON", ".yml"]),
        ("opencv", "x.XML", ["written as YAML", "promises XML", ".yml"]),
        ("opencv-fisheye", "x.json", ["written as YAML", "promises JSON", ".yml"]),
        ("anipose", "x.yaml", ["written as TOML", "promises YAML", ".toml"]),
        ("dlt", "x.npy", ["written as CSV", "promises NumPy", ".csv"]),
    ] {
        let said = refused(at, &["export", "model.json", "--format", format, "-o", output]);
        assert!(words.iter().all(|words| said.contains(words)) && said.contains(output), "{said}");
        assert!(!at.join(output).exists());
    }
    let said = refused(at, &["convert", "points.csv", "--to", "csv", "points.json"]);
    assert!(said.contains("promises JSON") && !at.join("points.json").exists(), "{said}");
    // The kind by another ending, or an ending that promises nothing.
    for output in ["x.yml", "x.yaml", "stereo", "x.cal"] {
        done(at, &["export", "model.json", "--format", "opencv", "-o", output]);
        assert!(fs::read_to_string(at.join(output)).unwrap().starts_with("%YAML"));
    }
}

#[test]
fn convert_recognises_what_export_writes_or_says_why_not() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    fitted(at);
    let mut named = Vec::new();
    for format in FORMATS.iter().filter(|format| format.is_calibration() && format.writes()) {
        let name = match format.layout {
            Layout::File(end) => format!("{}.{end}", format.name),
            _ => format!("{}-folder", format.name),
        };
        let export =
            ["export", "model.json", "--format", format.name, "--size", "640x480", "-o", &name];
        done(at, &export);
        let convert = ["convert", &name, "again.json", "--size", "640x480", "--json"];
        if ["dlt", "dltdv", "dltdv8", "remap"].contains(&format.name) {
            let said = refused(at, &convert);
            assert!(said.contains(&format!("`{}`", format.name)) && said.contains(&name), "{said}");
            named.push(format.name);
            if format.name != "remap" {
                assert!(said.contains("--from"), "{said}");
                done(at, &[&convert[..], &["--from", format.name]].concat());
            }
        } else {
            let (told, _) = done(at, &convert);
            let told: serde_json::Value = serde_json::from_str(&told).unwrap();
            assert_eq!(told["cameras"], 2, "{name}");
            let model = fs::read_to_string(at.join("again.json")).unwrap();
            let own = format.name.trim_end_matches("-fisheye");
            assert!(model.contains(&format!("\"{own}\"")), "{name}");
        }
    }
    assert_eq!(named, ["dlt", "dltdv", "dltdv8", "remap"]);
}

#[test]
fn a_table_of_caliscope_is_named_with_what_reads_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    for header in [
        "sync_index,port,frame_index,frame_time,point_id,img_loc_x,img_loc_y,obj_loc_x,obj_loc_y",
        "sync_index,cam_id,object_id,keypoint_id,img_loc_x,img_loc_y,board_loc_x,board_loc_y,frame",
    ] {
        fs::write(at.join("xy.csv"), format!("{header}\n0,1,0,0.5,3,210.5,99.25,0.1,0.2\n"))
            .unwrap();
        for arguments in [&["fit", "xy.csv", "-o", "m.json"][..], &["check", "xy.csv"]] {
            let said = refused(at, arguments);
            assert!(said.contains("xy.csv") && said.contains("caliscope"), "{said}");
            assert!(said.contains("read_caliscope"), "{said}");
        }
    }
}

#[test]
fn an_asymmetric_grid_has_its_default_width_and_truth_its_rotations_by_columns() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let points = |more: &[&str]| {
        let synth = ["synth", "--points", "--chart", "dot-grid", "--noise", "none", "-o", "p.csv"];
        done(at, &[&synth[..], more].concat());
        fs::read_to_string(at.join("p.csv")).unwrap()
    };
    // All of the dots in all of the pictures, as of the symmetric grid.
    for (more, dots) in
        [(&[][..], 70), (&["--asymmetric"], 35), (&["--asymmetric", "--columns", "4"], 28)]
    {
        let table = points(&[&["--near", "100"][..], more].concat());
        let rows: Vec<&str> = table.lines().skip(1).collect();
        let views: std::collections::BTreeSet<&str> =
            rows.iter().map(|row| row.split(',').nth(7).unwrap()).collect();
        assert_eq!(rows.len(), dots * views.len(), "{more:?}");
        let seen = |row: &&str| row.split(',').take(4).all(|cell| !cell.is_empty());
        assert!(rows.iter().all(|row| seen(row)), "{more:?}");
    }
    let path = at.join("p.truth.json");
    let truth = Truth::load(&path).unwrap();
    let told: serde_json::Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let rotation = &told["rig"]["cameras"][1]["camera_from_world"]["rotation"];
    let known = truth.rig.cameras[1].camera_from_world.rotation;
    assert!((known[(0, 2)] - known[(2, 0)]).abs() > 0.01);
    for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
        assert_eq!(rotation[3 * column + row].as_f64(), Some(known[(row, column)]));
    }
}
