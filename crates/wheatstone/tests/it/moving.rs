//! Recordings of a marker in motion: each camera has noise of its own, and the noise differs from point to point.

use rayon::prelude::*;
use wheatstone::{
    Calibration,
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::{Coverage, Ellipsoids, coverage, evaluate},
    geometry::{Pixel, PixelColumns},
    method::{AnyMethod, CalibratedMap, PointNoise},
    numeric::{progress::Silent, random::Random},
    preparation::Prepared,
    synthetic::{Noise, Rig, random_correspondences},
};

const CAMERAS: usize = 5;
const VIEWS: usize = 10;

/// Student's t of so many degrees of freedom.
const FREEDOM: usize = 4;

/// Points in blocks of time; camera 1 has the least noise, the last one three times as much. A third of the pixels
/// is hidden.
fn recording(points: usize, moving: bool, seed: u64) -> Dataset {
    let rig = Rig::named("paper", CAMERAS).unwrap();
    let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let exact = Noise::Normal(0.0);
    let mut data = random_correspondences(&rig, &chart, (50.0, 140.0), (exact, seed), points);
    let mut random = Random::new(seed + 1000);
    data.views = (0..VIEWS).map(|view| view.to_string()).collect();
    for (index, row) in data.correspondences.iter_mut().enumerate() {
        row.view = index * VIEWS / points;
        let square: f64 = (0..FREEDOM).map(|_| random.normal().powi(2)).sum();
        let scale = if moving { (FREEDOM as f64 - 2.0) / square } else { 1.0 };
        for (camera, pixel) in row.pixels.iter_mut().enumerate() {
            let sigma = 0.1 * (1.0 + 0.5 * camera as f64) * scale.sqrt();
            let hidden = camera > 1 && random.uniform(0.0, 1.0) < 1.0 / 3.0;
            *pixel = pixel
                .filter(|_| !hidden)
                .map(|p| p + sigma * nalgebra::Vector2::new(random.normal(), random.normal()));
        }
    }
    data
}

fn fitted(method: &str, moving: bool, seed: u64) -> Calibration {
    let prepared = Prepared::as_given(recording(500, moving, seed));
    Calibration::fit(&AnyMethod::named(method).unwrap(), &prepared, 0, true, &Silent).unwrap()
}

/// The mean of some coverages.
fn mean(of: &[Coverage]) -> Coverage {
    let mean = |figure: fn(&Coverage) -> f64| of.iter().map(figure).sum::<f64>() / of.len() as f64;
    Coverage { p68: mean(|held| held.p68), p95: mean(|held| held.p95) }
}

#[test]
fn regions_hold_what_they_say_of_moving_markers() {
    let judged = |seed: u64| {
        let model = fitted("brown", true, seed);
        let exam = recording(1500, true, 50 + seed);
        let plain = CalibratedMap::new(&*model.reconstructor);
        let normal = Ellipsoids::NORMAL;
        let freedom = model.point_noise.map(PointNoise::freedom).unwrap();
        assert!((3.0..6.0).contains(&freedom), "{freedom}");
        (
            coverage(&model.map(), &exam, &model.ellipsoids).unwrap(),
            coverage(&model.map(), &exam, &normal).unwrap(),
            coverage(&plain, &exam, &normal).unwrap(),
        )
    };
    let all: Vec<_> = (0..6).into_par_iter().map(judged).collect();
    let [mut own, mut normal, mut plain] = [(); 3].map(|()| Vec::new());
    for (a, b, c) in all {
        own.push(a);
        normal.push(b);
        plain.push(c);
    }
    assert!(own.iter().all(|held| (0.93..=0.98).contains(&held.p95)), "{own:?}");
    let [own, normal, plain] = [own, normal, plain].map(|of| mean(&of));
    assert!((0.65..=0.71).contains(&own.p68), "{own:?}");
    assert!((0.94..=0.965).contains(&own.p95), "{own:?}");
    // Nearer to what normal errors would be than with the same noise for every point.
    assert!((normal.p68 - 0.68).abs() < 0.5 * (plain.p68 - 0.68), "{normal:?} {plain:?}");
}

#[test]
fn still_points_have_the_same_noise_and_cameras_count_by_theirs() {
    let models: Vec<Calibration> =
        (0..4).into_par_iter().map(|seed| fitted("brown", false, seed)).collect();
    for model in &models {
        // Of cameras that differ, a residual over all of them is not quite a chi-square.
        let freedom = model.point_noise.map_or(f64::INFINITY, PointNoise::freedom);
        assert!(freedom > 15.0, "{freedom}");
    }
    let exam = recording(1500, false, 60);
    let error = |model: &Calibration| evaluate(&*model.reconstructor, &exam, None).unwrap().rms;
    let mut alike = serde_json::to_value(&models[0]).unwrap();
    for camera in alike["reconstructor"]["uncertainty"].as_array_mut().unwrap() {
        camera.as_object_mut().unwrap().remove("weight").unwrap();
    }
    let alike: Calibration = serde_json::from_value(alike).unwrap();
    assert!(error(&models[0]) < 0.93 * error(&alike), "{} {}", error(&models[0]), error(&alike));
}

#[test]
fn many_points_have_the_error_bars_of_each() {
    let model = fitted("dlt", true, 1);
    assert!(model.point_noise.is_some());
    let exam = recording(300, true, 70);
    let column = |camera: usize, axis: usize| -> Vec<f64> {
        let value = |p: &Option<Pixel>| p.map_or(f64::NAN, |p| p[axis]);
        exam.correspondences.iter().map(|row| value(&row.pixels[camera])).collect()
    };
    let columns: Vec<[Vec<f64>; 2]> =
        (0..CAMERAS).map(|camera| [0, 1].map(|axis| column(camera, axis))).collect();
    let columns = columns.iter().map(|[x, y]| [&x[..], &y[..]]).collect();
    let batch = model.locator().locate(&PixelColumns::new(columns));
    for (index, row) in exam.correspondences.iter().enumerate() {
        let (one, many) = (model.locate(&row.pixels).unwrap(), batch.get(index).unwrap());
        let off = (one.covariance - many.covariance).norm();
        assert!(off < 0.03 * one.covariance.norm(), "{index}: {one:?} {many:?}");
    }
}
