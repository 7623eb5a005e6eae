//! Model files of version 1, written by the program that had no later version, are read and locate to
//! the last bit as that program did.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use wheatstone::{Calibration, Locator, Silent, calibration};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The columns of a CSV file of numbers, by name; empty cells are NaN.
fn column(text: &str, name: &str) -> Vec<f64> {
    let mut lines = text.lines();
    let place = lines.next().unwrap().split(',').position(|own| own == name).unwrap();
    lines.map(|line| line.split(',').nth(place).unwrap().parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn models_of_version_1_locate_bit_for_bit() {
    for method in ["brown", "dlt"] {
        let file = data(&format!("version-1-{method}.json"));
        assert!(std::fs::read_to_string(&file).unwrap().contains("\"version\":1,"));
        let model = Calibration::load(&file).unwrap();
        assert_eq!(model.method.name(), method);
        let text = std::fs::read_to_string(data(&format!("version-1-{method}.csv"))).unwrap();
        let pixels = ["x1", "y1", "x2", "y2"].map(|name| column(&text, name));
        let batch = Locator::new(&*model.reconstructor, Some(&model.volume))
            .locate_columns(&pixels.each_ref().map(|column| &column[..]), &Silent)
            .unwrap();
        let same = |name: &str, found: &[f64]| {
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&column(&text, name)), bits(found), "{method}: {name}");
        };
        assert_eq!((batch.len(), batch.located()), (12, 12));
        for (name, found) in ["X", "Y", "Z"].iter().zip(&batch.point) {
            same(name, found);
        }
        for (name, found) in ["sX", "sY", "sZ"].iter().zip(&batch.sigma()) {
            same(name, found);
        }
        same("residual", &batch.residual);
        for (name, found) in
            ["cXX", "cXY", "cXZ", "cYY", "cYZ", "cZZ"].iter().zip(&batch.covariance)
        {
            same(name, found);
        }
    }
}

#[test]
fn a_model_of_version_1_is_written_as_the_present_version() {
    let old = Calibration::load(&data("version-1-dlt.json")).unwrap();
    let bytes = old.to_bytes().unwrap();
    let heading: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(heading["version"], calibration::VERSION);
    assert_eq!(Calibration::from_bytes(&bytes).unwrap(), old);
}

#[test]
fn a_version_that_is_not_known_is_refused_by_number() {
    let text = std::fs::read_to_string(data("version-1-dlt.json")).unwrap();
    let later = text.replacen("\"version\":1,", "\"version\":4,", 1);
    let problem = Calibration::from_bytes(later.as_bytes()).unwrap_err().to_string();
    assert!(problem.contains("model version 4; this program reads versions 1 to 3"), "{problem}");
    assert!(Calibration::from_bytes(&[0xff]).is_err());
}
