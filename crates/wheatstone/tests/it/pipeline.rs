//! From pictures on disk to a model and back.

use std::path::Path;
use wheatstone::{
    Calibration, Error,
    capture::Capture,
    chart::{AnyChart, line_grid::LineGrid},
    detection::{DetectionSettings, detect},
    evaluate::evaluate,
    method::AnyMethod,
    numeric::{progress::Silent, random::Random},
    preparation::Preparation,
    synthetic::{Noise, Rig, Sensor, Stage, Truth, random_correspondences, write_capture},
};

fn rendered(folder: &Path, chart: &AnyChart, stage: Stage) -> Capture {
    let rig = Rig::named("paper", 2).unwrap();
    let sensor = Sensor::default();
    write_capture(folder, (&rig, chart), (&stage.views().unwrap(), true), (sensor, 1), &Silent)
        .unwrap();
    Capture::open(folder).unwrap()
}

#[test]
fn a_rendered_capture_becomes_a_model_that_reads_back_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let stage = Stage { near: 60.0, far: 120.0, step: 30.0 };
    let capture = rendered(dir.path(), &LineGrid::default().into(), stage);
    assert!(Truth::path_beside(dir.path()).is_file());
    let found = detect(&capture, DetectionSettings::default(), &Silent).unwrap();
    let matched = found.dataset.correspondences.iter().filter(|c| c.seen_by() == 2).count();
    assert!(matched >= 180, "{matched} of 189 crossings were matched");
    let dlt = AnyMethod::named("dlt").unwrap();
    let prepared = Preparation::default().run(found.dataset.clone(), 0, &Silent).unwrap();
    let model = Calibration::fit(&dlt, &prepared, 0, true, &Silent).unwrap();
    assert!(model.validation.as_ref().unwrap().all.mean_percent < 2.0);
    let path = dir.path().join("model.json");
    model.save(&path).unwrap();
    let loaded = Calibration::load(&path).unwrap();
    assert_eq!(loaded, model);
    let before = std::fs::read(&path).unwrap();
    loaded.save(&path).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), before);
    let again = evaluate(&*loaded.reconstructor, &found.dataset, loaded.viewpoint).unwrap();
    assert_eq!(again, model.training);
    damaged_models_are_refused(&path);
}

fn damaged_models_are_refused(path: &Path) {
    let text = std::fs::read_to_string(path).unwrap();
    for (from, to, words) in [
        ("\"version\":3", "\"version\":4", "version 4"),
        ("\"format\":\"wheatstone-calibration\"", "\"format\":\"other\"", "not a model file"),
        ("\"seed\":0", "\"seed\":0,\"sede\":1", "unknown field"),
        ("\"pixel_sigma\":", "\"pixel_sigma\":-", "numbers are inconsistent"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(path, text.replacen(from, to, 1)).unwrap();
        let error = Calibration::load_damaged(path).unwrap_err();
        assert!(error.to_string().contains(words), "{to}: {error}");
        assert!(error.hint().is_some());
        assert!(Calibration::load(path).is_err());
    }
    for length in (0..text.len()).step_by(997) {
        std::fs::write(path, &text[..length]).unwrap();
        assert!(matches!(Calibration::load(path), Err(Error::Malformed { .. })), "cut at {length}");
    }
    no_flipped_bit_goes_unnoticed(text.as_bytes());
}

fn no_flipped_bit_goes_unnoticed(bytes: &[u8]) {
    let model = Calibration::from_bytes(bytes).unwrap();
    let mut random = Random::new(36);
    for _ in 0..1000 {
        let mut damaged = bytes.to_vec();
        let (place, bit) = (random.below(bytes.len()), random.below(8));
        damaged[place] ^= 1 << bit;
        // `1e5` may have become `1E5`.
        if let Ok(found) = Calibration::from_bytes(&damaged) {
            assert_eq!(found, model, "bit {bit} of byte {place}");
        }
    }
}

#[test]
fn a_file_in_another_layout_is_the_same_model_and_an_edited_one_is_not() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("model.json");
    let (rig, chart) = (Rig::named("paper", 2).unwrap(), AnyChart::from(LineGrid::default()));
    let data = random_correspondences(&rig, &chart, (50.0, 140.0), (Noise::Normal(0.1), 1), 200);
    let prepared = Preparation::default().run(data, 0, &Silent).unwrap();
    let dlt = AnyMethod::named("dlt").unwrap();
    let model = Calibration::fit(&dlt, &prepared, 0, false, &Silent).unwrap();
    let mut value: serde_json::Value = serde_json::from_slice(&model.to_bytes().unwrap()).unwrap();
    std::fs::write(&path, serde_json::to_string_pretty(&value).unwrap()).unwrap();
    assert_eq!(Calibration::load(&path).unwrap(), model);
    value["unit"] = "mm".into();
    std::fs::write(&path, value.to_string()).unwrap();
    let error = Calibration::load(&path).unwrap_err();
    assert!(error.to_string().contains("checksum"), "{error}");
    assert_eq!(Calibration::load_damaged(&path).unwrap().unit, "mm");
    value.as_object_mut().unwrap().remove("checksum");
    std::fs::write(&path, value.to_string()).unwrap();
    assert!(Calibration::load(&path).unwrap_err().to_string().contains("checksum"));

    let mut endless = model;
    endless.training.rms = f64::INFINITY;
    endless.save(&path).unwrap_err();
    // What was there before is there still.
    assert_eq!(Calibration::load_damaged(&path).unwrap().unit, "mm");
}

#[test]
fn charts_larger_than_the_picture_are_read_by_the_rest_of_the_stage() {
    let dir = tempfile::tempdir().unwrap();
    // At 60 cm the cameras see a part of it only, with grid beyond every edge.
    let grid = LineGrid { columns: 17, rows: 13, ..LineGrid::default() };
    let stage = Stage { near: 60.0, far: 140.0, step: 40.0 };
    let stage = Stage { near: stage.near, far: 160.0, ..stage };
    let chart: AnyChart = grid.into();
    let capture = rendered(dir.path(), &chart, stage);
    let found = detect(&capture, DetectionSettings::default(), &Silent).unwrap();
    let rig = Rig::named("paper", 2).unwrap();
    let (points, mut nearest) = (chart.points(), 0);
    for row in &found.dataset.correspondences {
        let id: usize = row.id.as_ref().unwrap().parse().unwrap();
        let pose = capture.views[row.view].world_from_chart.unwrap();
        for (camera, pixel) in rig.cameras.iter().zip(&row.pixels) {
            let Some(pixel) = pixel else { continue };
            let truth = camera.project(pose.transform(points[id])).unwrap();
            assert!((truth - pixel).norm() < 1.0, "{} in view {}", id, row.view);
            nearest += usize::from(row.view == 0);
        }
    }
    assert!(nearest > 80, "{nearest} crossings were identified at 60 cm");
}

#[test]
fn squares_counted_for_crossings_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let stage = Stage { near: 80.0, far: 95.0, step: 15.0 };
    rendered(dir.path(), &LineGrid::default().into(), stage);
    let path = dir.path().join("capture.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(
        &path,
        text.replace("columns = 9", "columns = 10").replace("rows = 7", "rows = 8"),
    )
    .unwrap();
    let capture = Capture::open(dir.path()).unwrap();
    let error = detect(&capture, DetectionSettings::default(), &Silent).unwrap_err();
    let hint = error.hint().unwrap();
    assert!(
        hint.contains("`columns = 9`, `rows = 7` it is found in 4 of the first 4"),
        "{error}: {hint}"
    );
}

#[test]
fn a_capture_without_the_chart_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let stage = Stage { near: 100.0, far: 100.0, step: 15.0 };
    rendered(dir.path(), &LineGrid::default().into(), stage);
    let path = dir.path().join("capture.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("columns = 9", "columns = 8")).unwrap();
    let capture = Capture::open(dir.path()).unwrap();
    let error = detect(&capture, DetectionSettings::default(), &Silent).unwrap_err();
    assert!(error.to_string().contains("none of 2 pictures"), "{error}");
    assert!(error.hint().unwrap().contains("columns = 9"), "{:?}", error.hint());
}
