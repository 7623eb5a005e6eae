//! Reports of small synthetic worlds.

use super::browser::{EVIL, names_no_address, stays_whole};
use wheatstone_charts::{
    capture::Capture,
    chart::line_grid::LineGrid,
    detection::{DetectionSettings, detect},
};
use wheatstone_core::{
    Calibration,
    dataset::Dataset,
    evaluate::compare,
    method::AnyMethod,
    preparation::{Preparation, Prepared},
};
use wheatstone_numeric::progress::Silent;
use wheatstone_report::{
    FindingFigures, Material, OutlierFigures, PictureSource, Report, Validation, Wording,
    figures::{self, Panel},
    html::escape,
};
use wheatstone_synthetic::{Noise, Rig, Sensor, Stage, chart_correspondences, write_capture};

fn world() -> (Rig, Dataset) {
    let rig = Rig::named("paper", 2).unwrap();
    let chart = LineGrid::default().into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), Some(200));
    (rig, data)
}

fn model(data: &Dataset) -> Calibration {
    Calibration::fit(
        &AnyMethod::named("brown").unwrap(),
        &Prepared::as_given(data.clone()),
        3,
        false,
        &Silent,
    )
    .unwrap()
}

fn report(rig: &Rig, model: &Calibration, held_out: bool) -> Report {
    let material = Material {
        wording: Wording::default(),
        title: "model.json".into(),
        command: Some("wheatstone report model.json -o report.html".into()),
        model,
        comparison: None,
        truth: Some(&rig.cameras),
        seen: None,
        held_out,
    };
    Report::of(&material, &Silent).unwrap()
}

#[test]
fn a_sound_fit_is_called_sound_and_says_of_what() {
    let (rig, data) = world();
    let model = model(&data);
    let report = report(&rig, &model, true);
    assert_eq!(report.judgement, Validation::HeldOut);
    assert_eq!(report.verdict.grade, "sound", "{:?}", report.verdict);
    let accuracy = report.accuracy.as_ref().unwrap();
    // The figures are those of the comparison, fold by fold.
    let validation = wheatstone_core::evaluate::cross_validate(&model.method, &data, 3, &Silent)
        .unwrap()
        .unwrap();
    assert!((accuracy.rms - validation.all.rms).abs() < 1e-12 * accuracy.rms);
    assert_eq!(report.views.len(), validation.folds.len());
    for (view, fold) in report.views.iter().zip(&validation.folds) {
        assert_eq!((&view.name, view.kind, view.rms), (&fold.view, Some(fold.kind), fold.rms));
    }
    let floor = wheatstone_core::evaluate::floor(&rig.cameras, &data).unwrap();
    assert_eq!(accuracy.floor_rms, Some(floor.rms));
    assert!(report.verdict.sentence.contains("the floor set by pixel noise"));
    // 200 points: counting alone makes a standard deviation of 3.5 %.
    for bar in &report.error_bars {
        assert!((bar.nominal - bar.actual).abs() < 0.14, "{bar:?}");
    }
    // The pixels' noise shows in both cameras.
    for camera in &report.cameras {
        assert!((0.09..0.14).contains(&camera.miss_rms.unwrap()), "{:?}", camera.miss_rms);
        assert!(camera.area_is_picture && camera.coverage.counts.iter().sum::<usize>() == 200);
    }
}

#[test]
fn errors_on_fitted_points_prove_nothing() {
    let (rig, data) = world();
    let report = report(&rig, &model(&data), false);
    assert_eq!(report.judgement, Validation::Fitted);
    assert_eq!(report.verdict.grade, "unproven");
    assert!(report.verdict.sentence.contains("fitted points themselves"));
}

#[test]
fn the_same_again_byte_for_byte_and_back_from_json() {
    let (rig, data) = world();
    let (first, second) = (report(&rig, &model(&data), true), report(&rig, &model(&data), true));
    assert_eq!(first.html(), second.html());
    let text = serde_json::to_string(&first).unwrap();
    let back: Report = serde_json::from_str(&text).unwrap();
    assert_eq!(back, first);
}

/// A drawing as a part of the page: that of its own file, without its title, style and ground.
fn inline(panel: &Panel) -> String {
    let drawing = panel.standalone();
    let (head, body) = drawing.split_once("</rect>").unwrap();
    let body = body.trim_end().strip_suffix("</svg>").unwrap();
    let size = head.split_once("class=\"plot alone\" ").unwrap().1.split_once('>').unwrap().0;
    let label = escape(&panel.alternative).0;
    format!("<svg class=\"plot\" {size} role=\"img\" aria-label=\"{label}\">{body}</svg>")
}

#[test]
fn every_figure_says_its_units_and_how_to_read_it() {
    let (rig, data) = world();
    let report = report(&rig, &model(&data), true);
    let drawn = figures::all(&report);
    let names: Vec<&str> = drawn.iter().map(|figure| figure.name).collect();
    for expected in [
        "scene",
        "error-by-depth",
        "views",
        "distribution",
        "error-bars",
        "error-map",
        "misses",
        "coverage",
        "volume",
    ] {
        assert!(names.contains(&expected), "no figure {expected}");
    }
    let html = report.html();
    for figure in &drawn {
        assert!(figure.how.ends_with('.') && figure.good.ends_with('.'), "{}", figure.name);
        for panel in &figure.panels {
            assert!(!panel.alternative.is_empty(), "{}", figure.name);
            let drawing = panel.standalone();
            for wrong in ["NaN", "inf\"", "style=\""] {
                assert!(!drawing.contains(wrong), "{} holds {wrong}", figure.name);
            }
            assert!(html.contains(&inline(panel)));
        }
    }
}

#[test]
fn names_cannot_break_out_of_the_page() {
    let (rig, mut data) = world();
    let evil = EVIL;
    data.unit = format!("mm{evil}");
    for view in &mut data.views {
        *view += evil;
    }
    for row in &mut data.correspondences {
        row.id = row.id.as_ref().map(|id| format!("{id}{evil}"));
    }
    let mut report = report(&rig, &model(&data), true);
    report.title = evil.into();
    report.command = Some(evil.into());
    report.outliers.push(OutlierFigures {
        view: evil.into(),
        id: evil.into(),
        camera: Some(0),
        reason: evil.into(),
    });
    report.findings.push(FindingFigures {
        code: evil.into(),
        severity: evil.into(),
        views: vec![evil.into()],
        cameras: vec![evil.into()],
        explanation: evil.into(),
        hint: evil.into(),
        stays_in_fit: true,
    });
    stays_whole(&report.html());
}

#[test]
fn the_page_names_no_address() {
    let (rig, data) = world();
    names_no_address(&report(&rig, &model(&data), true).html());
}

#[test]
fn an_observation_set_aside_shows_its_piece_of_the_picture() {
    let (rig, chart) = (Rig::named("paper", 2).unwrap(), LineGrid::default().into());
    let folder = tempfile::tempdir().unwrap();
    let stage = Stage { near: 60.0, far: 120.0, step: 20.0 };
    write_capture(
        folder.path(),
        (&rig, &chart),
        (&stage.views().unwrap(), true),
        (Sensor::default(), 1),
        &Silent,
    )
    .unwrap();
    let capture = Capture::open(folder.path()).unwrap();
    let found = detect(&capture, DetectionSettings::default(), &Silent).unwrap();
    let mut data = found.dataset.clone();
    let wrong = &mut data.correspondences[100];
    wrong.pixels[1] = wrong.pixels[1].map(|pixel| pixel.map(|value| value + 9.0));
    let (view, id) = (data.views[data.correspondences[100].view].clone(), "37");
    data.correspondences[100].id.as_deref().inspect(|name| assert_eq!(*name, id));
    let prepared = Preparation::default().run(data, 0, &Silent).unwrap();
    let method = AnyMethod::named("brown").unwrap();
    let model = Calibration::fit(&method, &prepared, 0, false, &Silent).unwrap();
    let report = Report::of(
        &Material {
            wording: Wording::default(),
            title: "capture".into(),
            command: None,
            model: &model,
            comparison: None,
            truth: None,
            seen: Some(PictureSource { capture: &capture, found: &found }),
            held_out: true,
        },
        &Silent,
    )
    .unwrap();
    let [outlier] = &report.outliers[..] else { panic!("{:?}", report.outliers) };
    assert_eq!((&outlier.view, &*outlier.id, outlier.camera), (&view, id, Some(1)));
    assert_eq!(report.outlier_crops.as_ref().unwrap().of, [[0, 1]]);
    assert!(report.html().contains("<canvas data-outlier=\"0\""));
    // Every other point has one for each camera that saw it, and every picture is there.
    let seen = report.points.iter().flat_map(|point| &point.pixels).flatten().count();
    assert_eq!(report.crops.as_ref().unwrap().of.len(), seen);
    assert_eq!(report.pictures.len(), 8);
}

#[test]
fn the_budget_names_the_cause_and_what_helps() {
    let (rig, data) = world();
    let shares = |report: &Report| report.budget.iter().map(|part| part.share).collect::<Vec<_>>();
    let sound = report(&rig, &model(&data), true);
    let parts = shares(&sound);
    assert!((parts.iter().sum::<f64>() - 1.0).abs() < 1e-9 && parts[0] > 0.8, "{parts:?}");
    assert!(figures::all(&sound).iter().any(|figure| figure.name == "budget"));
    // A lens that bends, and a method that knows of none.
    let linear = AnyMethod::named("dlt").unwrap();
    let rig = Rig::named("water", 2).unwrap();
    let chart = LineGrid::default().into();
    let views = Stage::default().views().unwrap();
    let data = chart_correspondences(&rig, &chart, &views, (Noise::Normal(0.1), 1), Some(200));
    let prepared = Prepared::as_given(data);
    let wrong = Calibration::fit(&linear, &prepared, 3, false, &Silent).unwrap();
    let wrong = report(&rig, &wrong, true);
    assert!(shares(&wrong)[1] > 0.5, "{:?}", wrong.budget);
    assert!(wrong.verdict.advice.iter().any(|line| line.contains("the lens model's")));
    // A fit bends to the noise of its own points: nothing is said then.
    assert!(report(&rig, &model(&world().1), false).budget.is_empty());
}

#[test]
fn a_comparison_alone_makes_a_page() {
    let (rig, data) = world();
    let methods = ["dlt", "brown"].map(|name| AnyMethod::named(name).unwrap());
    let found = compare(&methods, &data, Some(&rig.cameras), 0, &Silent).unwrap();
    let report = Report::of_comparison(&found, "points.csv", None, Wording::default());
    assert_eq!(report.verdict.grade, "sound", "{:?}", report.verdict);
    assert!(report.verdict.sentence.starts_with("brown is recommended here"));
    assert_eq!((report.methods.len(), report.views.len()), (2, found.methods[1].folds.len()));
    assert_eq!(report.budget.len(), 4);
    assert!(report.html().contains("Methods compared"));
}
