//! One camera and a board held by hand, as a user meets it: calibrated, judged in pixels, exported.
#![allow(clippy::disallowed_methods, reason = "the last bits of these places do not matter")]

use crate::program::{done, refused};
use std::fmt::Write;

const FOCAL: f64 = 800.0;

/// Errors of each coordinate, even within this of nothing: rms a root of three less.
const ERROR: f64 = 0.2;

/// Corners of a board 25 mm apart, tilted another way in every view, before a pinhole at (320, 240).
pub(crate) fn corners(views: std::ops::Range<u32>) -> String {
    let mut text = String::from("view,id,board_x,board_y,x1,y1\n");
    // Numerical Recipes' quick generator: any error that knows nothing of the place will do.
    let mut state = 1_u32;
    let mut error = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ERROR * (2.0 * f64::from(state) / f64::from(u32::MAX) - 1.0)
    };
    for view in views {
        let turn = f64::from(view);
        let (tilt, pan) = (0.5 * (1.7 * turn).sin(), 0.5 * (1.1 * turn).cos());
        for row in 0..7 {
            for column in 0..9 {
                let (x, y) = (25.0 * f64::from(column), 25.0 * f64::from(row));
                let place = rotated(x - 100.0, y - 75.0, tilt, pan);
                let z = 420.0 + 60.0 * (0.7 * turn).sin() + place[2];
                let px = FOCAL * (place[0] + 30.0 * (2.3 * turn).sin()) / z + 320.0 + error();
                let py = FOCAL * (place[1] + 20.0 * turn.cos()) / z + 240.0 + error();
                writeln!(text, "{view},{column} {row},{x},{y},{px},{py}").unwrap();
            }
        }
    }
    text
}

/// A place on the board after a turn about x by `tilt` and one about y by `pan`.
fn rotated(u: f64, v: f64, tilt: f64, pan: f64) -> [f64; 3] {
    let (y, z) = (tilt.cos() * v, tilt.sin() * v);
    [pan.cos() * u + pan.sin() * z, y, -pan.sin() * u + pan.cos() * z]
}

#[test]
fn one_camera_is_calibrated_judged_in_pixels_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("corners.csv"), corners(0..15)).unwrap();
    std::fs::write(here.join("exam.csv"), corners(40..44)).unwrap();
    let rms = ERROR * (2.0_f64 / 3.0).sqrt();
    for method in ["brown", "kannala-brandt", "neural-camera"] {
        let (_, told) = done(here, &["fit", "corners.csv", "--method", method, "-o", "model.json"]);
        assert!(
            told.contains("one camera")
                && told.contains("Held-out error (leave-one-group-out, 15 views in 12 groups): "),
            "{told}"
        );
        let told = refused(here, &["check", "exam.csv", "--against", "model.json"]);
        assert!(told.contains("only against points at known places"), "{told}");
        let (json, _) = done(here, &["evaluate", "model.json", "exam.csv", "--json"]);
        let judged: serde_json::Value = serde_json::from_str(&json).unwrap();
        let found = judged["rms"].as_f64().unwrap();
        // A place by half of the points adds a tenth; an equidistant lens is none of this pinhole's.
        let most = if method == "kannala-brandt" { 1.6 } else { 1.3 };
        assert!(judged["unit"] == "px" && judged["located"] == 252, "{json}");
        assert!((0.9..most).contains(&(found / rms)), "{method}: {found} px for {rms}");
        done(here, &["export", "model.json", "--format", "opencv", "-o", "camera.yml"]);
        done(here, &["export", "model.json", "--format", "mrcal", "--size", "640x480", "-o", "m"]);
        if method == "brown" {
            let yaml = std::fs::read_to_string(here.join("camera.yml")).unwrap();
            let matrix = yaml.split("data: [").nth(1).unwrap();
            let focal: f64 = matrix.split(',').next().unwrap().trim().parse().unwrap();
            assert!((focal / FOCAL - 1.0).abs() < 0.005, "{focal}");
        }
    }
}

#[test]
fn what_one_camera_cannot_do_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("corners.csv"), corners(0..8)).unwrap();
    for method in ["auto", "network", "dlt"] {
        let told = refused(here, &["fit", "corners.csv", "--method", method, "-o", "model.json"]);
        assert!(told.contains("one camera") && told.contains("neural-camera"), "{told}");
    }
    assert!(refused(here, &["compare", "corners.csv"]).contains("one camera"));
    let fit = ["fit", "corners.csv", "--method", "brown", "--no-validation", "-o", "model.json"];
    done(here, &fit);
    for arguments in [
        &["locate", "model.json", "corners.csv"][..],
        &["report", "model.json", "-o", "report.html"],
        &["rectify", "model.json", "-o", "pair"],
    ] {
        let told = refused(here, arguments);
        assert!(told.contains("two cameras") && told.contains("second camera"), "{told}");
    }
}
