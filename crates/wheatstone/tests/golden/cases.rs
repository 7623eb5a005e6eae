//! What is computed: every method, the stage, the board in the hand, detection of every chart.

use super::figures::Figures;
use std::sync::OnceLock;
use wheatstone::{
    Calibration, GrayImage, Locator, Pixel, Reconstructor, Silent,
    chart::{AnyChart, ChartSearch, line_grid::LineGrid},
    dataset::{Dataset, volume::Volume},
    fit::{
        bundle::{self, BundleSettings, Lenses},
        stage::{self, StagePrior},
    },
    geometry::{Pose, Vector3, columns_of},
    locate_all,
    method::{
        AnyMethod,
        network::{Network, Training},
    },
    numeric::random::Random,
    preparation::{Preparation, Prepared},
    synthetic::{
        HandHeld, Noise, Rig, Sensor, Stage, StageError, chart_correspondences,
        hand_held_correspondences, misplaced_correspondences, random_correspondences, render,
    },
    tables,
};

const NOISE: Noise = Noise::Normal(0.1);

fn rig() -> Rig {
    Rig::named("paper", 2).unwrap()
}

fn chart() -> AnyChart {
    LineGrid::default().into()
}

fn table() -> Dataset {
    chart_correspondences(
        &rig(),
        &chart(),
        &Stage::default().views().unwrap(),
        (NOISE, 1),
        Some(160),
    )
}

fn exam() -> Vec<Vec<Option<Pixel>>> {
    let exam = random_correspondences(&rig(), &chart(), (45.0, 150.0), (NOISE, 2), 600);
    exam.correspondences.into_iter().map(|row| row.pixels).collect()
}

/// What the other cases are fitted to.
pub(crate) fn data(figures: &mut Figures) {
    let text = tables::write(&table());
    figures.bytes("table", text.as_bytes());
    for (index, line) in text.lines().take(4).enumerate() {
        figures.word(&format!("table line {index}"), line);
    }
    let exam = columns_of(&exam(), 2);
    figures.numbers("pixels", exam.as_flattened().concat().as_slice());
}

/// A method as the tests' patience allows: the network learns for a moment.
fn named(name: &str) -> AnyMethod {
    let mut method = AnyMethod::named(name).unwrap();
    if let AnyMethod::Network(Network { training: Training::Evidence(training), .. }) = &mut method
    {
        (training.starts, training.steps) = (1, 60);
    }
    method
}

pub(crate) fn method(figures: &mut Figures, name: &str) {
    let data = table();
    let fit = named(name).fit_checked(&data, 7, &Silent).unwrap();
    if let Some(choice) = &fit.choice {
        figures.value("choice", choice);
    }
    figures.value("model", &fit.reconstructor);
    locate(figures, &*fit.reconstructor, &Volume::of(&data));
}

/// Points of pixels, by columns and one by one.
fn locate(figures: &mut Figures, model: &dyn Reconstructor, volume: &Volume) {
    let pixels = exam();
    let columns = columns_of(&pixels, 2);
    let columns: Vec<&[f64]> = columns.as_flattened().iter().map(|column| &column[..]).collect();
    let batch = Locator::new(model, Some(volume)).locate_columns(&columns, &Silent).unwrap();
    let all = batch.point.iter().chain(&batch.covariance);
    for (name, column) in
        ["X", "Y", "Z", "cXX", "cXY", "cXZ", "cYY", "cYZ", "cZZ"].into_iter().zip(all)
    {
        figures.numbers(name, column);
        for (index, value) in column.iter().enumerate().take(10) {
            figures.number(&format!("{name}[{index}]"), *value);
        }
    }
    figures.numbers("residual", &batch.residual);
    figures.numbers("residual sigma", &batch.residual_sigma);
    let trust: String = batch.trust.iter().map(|trust| format!("{trust} ")).collect();
    figures.bytes("trust", trust.as_bytes());
    let each: Vec<f64> = locate_all(model, &pixels)
        .into_iter()
        .flat_map(|found| {
            let found = found.unwrap();
            [found.point.coords.as_slice(), found.covariance.as_slice()].concat()
        })
        .collect();
    figures.numbers("one by one", &each);
    each.iter().enumerate().take(12).for_each(|(index, value)| {
        figures.number(&format!("one by one[{index}]"), *value);
    });
}

/// So many points that the locator makes its tables: it does from 65536 on.
pub(crate) fn many(figures: &mut Figures) {
    const POINTS: usize = 70_000;
    let exam = random_correspondences(&rig(), &chart(), (45.0, 150.0), (NOISE, 5), POINTS);
    let pixels: Vec<_> = exam.correspondences.into_iter().map(|row| row.pixels).collect();
    let columns = columns_of(&pixels, 2);
    let columns: Vec<&[f64]> = columns.as_flattened().iter().map(|column| &column[..]).collect();
    for name in ["brown", "kannala-brandt", "neural-camera"] {
        let fit = named(name).fit_checked(&table(), 7, &Silent).unwrap();
        let model = &*fit.reconstructor;
        let batch = Locator::new(model, None).locate_columns(&columns, &Silent).unwrap();
        for (axis, column) in batch.point.iter().chain(&batch.covariance).enumerate() {
            let figure = format!("{name} figure {axis}");
            figures.numbers(&figure, column);
            figures.number(&format!("{figure}, first"), column[0]);
            figures.number(&format!("{figure}, last"), column[POINTS - 1]);
        }
    }
}

/// A whole model file, with its judgement on views left out.
pub(crate) fn model(figures: &mut Figures) {
    let prepared = Preparation::default().run(table(), 0, &Silent).unwrap();
    let model = Calibration::fit(&named("brown"), &prepared, 0, true, &Silent).unwrap();
    figures.value("training", &model.training);
    figures.value("validation", &model.validation);
    figures.value("ellipsoids", &model.ellipsoids);
    figures.value("volume", &model.volume);
    figures.bytes("file", &model.to_bytes().unwrap());
}

/// Charts that did not stand where they were said to.
pub(crate) fn stage_errors(figures: &mut Figures) {
    let nominal = Stage { near: 20.0, far: 50.0, step: 5.0 }.views().unwrap();
    let chart = LineGrid { pitch: 1.8, ..LineGrid::default() }.into();
    let actual = StageError { offset: 0.04, rotation: 0.002 }.apply(&nominal, 3);
    let noise = (Noise::Normal(0.05), 3);
    let data = misplaced_correspondences(&rig(), &chart, (&actual, &nominal), noise, Some(140));
    let solved = stage::solve(&data, &StagePrior::of(0.05), &Silent).unwrap();
    figures.value("offsets", &solved.offsets);
    figures.numbers("pixel noise", &solved.pixel_noise);
    figures.number("disagreement", solved.disagreement);
    for name in ["brown", "neural-camera"] {
        let fit = named(name).fit_checked(&solved.data, 0, &Silent).unwrap();
        figures.value(name, &fit.reconstructor);
    }
}

/// A board in the hand: bundle adjustment, and a model on its places.
pub(crate) fn hand_held(figures: &mut Figures) {
    let chart = LineGrid { pitch: 5.0, columns: 7, rows: 5, ..LineGrid::default() }.into();
    let waved = HandHeld { views: 8, ..HandHeld::default() };
    let placements = waved.placements(&chart, 4).unwrap();
    let (data, _) = hand_held_correspondences(&rig(), &chart, &placements, (NOISE, 4));
    let bundle_settings = BundleSettings { lenses: Lenses::Brown, ..BundleSettings::default() };
    let solved = bundle::solve(&data, bundle_settings, &Silent).unwrap();
    figures.number("rms", solved.rms);
    figures.numbers("baselines", &solved.baselines);
    figures.value("cameras", &solved.cameras);
    figures.value("views", &solved.views);
    let preparation = Preparation { bundle_settings, ..Preparation::default() };
    let prepared: Prepared = preparation.run(data, 0, &Silent).unwrap();
    for name in ["neural-camera", "network", "brown"] {
        let fit = named(name).fit_checked(&prepared.data, 0, &Silent).unwrap();
        figures.value(name, &fit.reconstructor);
        if name == "brown" {
            locate(figures, &*fit.reconstructor, &Volume::of(&prepared.data));
        }
    }
}

/// The charts, and a picture of each; rendered once, as that takes longer than all else here.
fn pictures() -> &'static [(AnyChart, GrayImage)] {
    static PICTURES: OnceLock<Vec<(AnyChart, GrayImage)>> = OnceLock::new();
    PICTURES.get_or_init(|| {
        // A chart of two levels is sought as a list of points is, and is slow to render.
        let charts = AnyChart::all().into_iter().filter(|c| !matches!(c, AnyChart::TwoLevel(_)));
        charts.map(|chart| picture(sized(chart))).collect()
    })
}

/// A list of points says how large they are, so that a renderer need not work it out.
fn sized(mut chart: AnyChart) -> AnyChart {
    if let AnyChart::PointList(list) = &mut chart {
        list.diameter = Some(8.0);
    }
    chart
}

fn picture(chart: AnyChart) -> (AnyChart, GrayImage) {
    let [left, top, right, bottom] = chart.board();
    let size = (right - left).max((bottom - top) * 4.0 / 3.0);
    let middle = Vector3::new((left + right) / 2.0, (top + bottom) / 2.0, 0.0);
    let away = Vector3::new(0.0, 0.0, 1.5 * size);
    let mut pose = Pose::from_rotation_vector(away, Vector3::new(0.2, -0.25, 0.05));
    pose.translation -= pose.rotation * middle;
    let mut random = Random::new(3);
    let image = render(&rig().cameras[0], &chart, &pose, Sensor::default(), &mut random);
    (chart, image)
}

/// Charts in rendered pictures.
pub(crate) fn detection(figures: &mut Figures) {
    for ((chart, image), name) in pictures().iter().zip(AnyChart::NAMES) {
        figures.bytes(&format!("{name} picture"), image.to_8_bit().as_raw());
        let ChartSearch::Found(readings) = chart.detect(image) else {
            panic!("{name} is not found")
        };
        let points = &readings[0].points;
        figures.word(&format!("{name} points"), points.len());
        let all: Vec<f64> = points.iter().flat_map(|(_, at)| [at.x, at.y]).collect();
        figures.numbers(&format!("{name} pixels"), &all);
        for (id, at) in points.iter().take(5) {
            figures.number(&format!("{name} point {id} x"), at.x);
            figures.number(&format!("{name} point {id} y"), at.y);
        }
        figures.numbers(&format!("{name} sigmas"), &readings[0].sigmas);
    }
}
