//! One model has one held-out error, whoever tells it.

use crate::data::folder;
use std::path::PathBuf;
use wheatstone::{
    Calibration,
    evaluate::compare,
    method::AnyMethod,
    numeric::progress::Silent,
    preparation::Preparation,
    report::{Material, Report, Wording},
    tables::{self, Duplicates},
};

/// A table on which `auto` takes a method whose lens is not the simplest, and one on which it is.
const SETS: [&str; 2] = ["myptv-vee", "myptv-plate"];

fn table(set: &str) -> Option<PathBuf> {
    Some(folder(set)?.join("points.csv"))
}

#[test]
fn fit_comparison_and_report_tell_the_same_error() {
    for set in SETS {
        let Some(path) = table(set) else { continue };
        let data = tables::read(&path, "mm", Duplicates::Refuse).unwrap();
        let prepared = Preparation::default().run(data, 0, &Silent).unwrap();
        let auto = AnyMethod::named("auto").unwrap();
        let model = Calibration::fit(&auto, &prepared, 0, true, &Silent).unwrap();
        let choice = model.choice.as_ref().unwrap();
        let held_out = model.validation.as_ref().unwrap().all.rms;
        let told = choice.held_out_rms.iter().find(|row| row.0 == choice.chosen).unwrap().1;
        assert!((told / held_out - 1.0).abs() < 1e-12, "{set}: {told}, {held_out}");

        let methods: Vec<AnyMethod> = ["dlt", "brown", "soloff", "neural-camera", "auto"]
            .iter()
            .map(|name| AnyMethod::named(name).unwrap())
            .collect();
        let found = compare(&methods, &prepared.data, None, 0, &Silent).unwrap();
        for name in [choice.chosen.as_str(), "auto"] {
            let row = found.methods.iter().find(|row| row.method == name).unwrap();
            let off = (row.rms.unwrap() / held_out - 1.0).abs();
            assert!(off < 1e-12, "{set}, {name}: {:?}, {held_out}", row.rms);
        }

        let material = Material {
            title: set.into(),
            command: None,
            model: &Calibration::from_bytes(&model.to_bytes().unwrap()).unwrap(),
            comparison: None,
            truth: None,
            wording: Wording::default(),
            seen: None,
            held_out: true,
        };
        let report = Report::of(&material, &Silent).unwrap();
        let accuracy = report.accuracy.unwrap();
        assert!(
            (accuracy.rms / held_out - 1.0).abs() < 1e-9,
            "{set}: {}, {held_out}",
            accuracy.rms
        );
        let ratio = accuracy.rms / accuracy.floor_rms.unwrap();
        let budget = found.budget.unwrap().ratio_to_floor;
        assert!((ratio / budget - 1.0).abs() < 1e-9, "{set}: {ratio}, {budget}");
        // Ellipsoids that are too small are no sound model's.
        let held = report.error_bars.iter().find(|bar| (bar.nominal - 0.7).abs() < 0.01).unwrap();
        assert!(held.actual >= 0.64 || report.verdict.grade != "sound", "{set}: {held:?}");
    }
}
