//! Methods against the floor, on rigs whose truth is known. Bars are those of the project's aims, of the median of five
//! seeds for the network, which is quick to fit and whose starts are drawn; one seed for others.

use rayon::prelude::*;
use wheatstone::{
    camera::{brown_conrady::BrownConrady, pinhole::Pinhole},
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::{evaluate, floor},
    geometry::Point3,
    method::AnyMethod,
    numeric::{progress::Silent, statistics::median},
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

/// Rms error over the floor, between 50 and 140 cm and between 150 and 200 cm, of a method fitted to
/// 400 pairs of charts `step` apart.
fn ratios(method: &str, rig: &str, noise: Noise, step: f64) -> (f64, f64) {
    ratios_of(method, rig, noise, (step, 21))
}

fn ratios_of(method: &str, rig: &str, noise: Noise, (step, seed): (f64, u64)) -> (f64, f64) {
    let rig = Rig::named(rig, 2).unwrap();
    let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage { step, ..Stage::default() }.views().unwrap();
    let train = chart_correspondences(&rig, &chart, &views, (noise, seed), Some(400));
    let fit = AnyMethod::named(method).unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let ratio = |near: f64, far: f64| {
        let exam = random_correspondences(&rig, &chart, (near, far), (noise, seed + 1), 2000);
        let found = evaluate(&*fit.reconstructor, &exam, None).unwrap();
        assert_eq!(found.located, found.n, "{method}");
        found.rms / floor(&rig.cameras, &exam).unwrap().rms
    };
    (ratio(50.0, 140.0), ratio(150.0, 200.0))
}

const RIGS: [&str; 5] = ["paper", "fisheye", "water", "glass", "bump"];
const NOISES: [Noise; 2] = [Noise::Quantised, Noise::Normal(0.1)];

/// Holds a method to its bars on every rig: in range and beyond, and the same for the bumped lens.
fn holds(method: &str, bars: (f64, f64), bump: (f64, f64)) {
    let tasks: Vec<(&str, Noise)> =
        RIGS.iter().flat_map(|rig| NOISES.map(|noise| (*rig, noise))).collect();
    tasks.into_par_iter().for_each(|(rig, noise)| {
        let seeds = if method == "network" { 21..26 } else { 21..22 };
        let each: Vec<(f64, f64)> =
            seeds.map(|seed| ratios_of(method, rig, noise, (15.0, seed))).collect();
        let of = |part: fn(&(f64, f64)) -> f64| median(&each.iter().map(part).collect::<Vec<_>>());
        let (inside, beyond) = (of(|ratio| ratio.0), of(|ratio| ratio.1));
        let (most_inside, most_beyond) = if rig == "bump" { bump } else { bars };
        assert!(inside <= most_inside, "{method}, {rig}, {noise}: {inside} in range");
        assert!(beyond <= most_beyond, "{method}, {rig}, {noise}: {beyond} beyond");
        // Nothing beats the floor by more than chance.
        assert!(inside > 0.97, "{method}, {rig}, {noise}: {inside}");
    });
}

#[test]
fn auto_reaches_the_floor_on_every_optics() {
    holds("auto", (1.05, 1.12), (1.10, 1.20));
}

#[test]
fn the_neural_camera_reaches_the_floor_on_every_optics() {
    holds("neural-camera", (1.05, 1.12), (1.10, 1.20));
}

#[test]
fn the_network_reaches_the_floor_on_every_optics() {
    holds("network", (1.08, 1.20), (1.10, 1.30));
}

#[test]
fn three_planes_are_enough_for_what_lies_between_them() {
    for rig in RIGS {
        let (inside, _) = ratios("auto", rig, Noise::Normal(0.1), 45.0);
        assert!(inside <= 1.15, "{rig}: {inside}");
    }
    // No staircase in depth either.
    for rig in ["paper", "water"] {
        let (inside, _) = ratios("network", rig, Noise::Normal(0.1), 45.0);
        assert!(inside <= 1.30, "network, {rig}: {inside}");
    }
}

#[test]
fn tilted_sensors_are_told_from_three_planes() {
    let (inside, beyond) = ratios("auto", "scheimpflug", Noise::Normal(0.1), 45.0);
    assert!(inside <= 1.10, "{inside} in range, {beyond} beyond");
}

#[test]
fn camera_models_hold_where_they_are_true_and_show_where_they_are_not() {
    assert!(ratios("brown", "paper", Noise::Normal(0.1), 15.0).0 <= 1.01);
    assert!(ratios("kannala-brandt", "fisheye", Noise::Normal(0.1), 15.0).0 <= 1.01);
    for method in ["brown", "kannala-brandt"] {
        assert!(ratios(method, "water", Noise::Normal(0.1), 15.0).0 > 1.2);
        assert!(ratios(method, "bump", Noise::Normal(0.1), 15.0).0 > 3.0);
    }
}

/// A lens whose polynomial turns back between the corners of the picture and a tenth beyond.
#[test]
fn a_lens_that_folds_beside_the_picture_is_kept_where_no_other_fits() {
    let mut rig = Rig::named("paper", 2).unwrap();
    for camera in &mut rig.cameras {
        let pinhole = Pinhole { focal: [512.0; 2], principal: [319.5, 239.5] };
        let lens = BrownConrady { radial: [-0.2, 0.0, 0.0], ..BrownConrady::ideal(pinhole) };
        camera.model = lens.into();
    }
    let chart: AnyChart = LineGrid::default().into();
    let noise = Noise::Normal(0.1);
    let train = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 41), 1500);
    let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
    let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 42), 1500);
    let found = evaluate(&*fit.reconstructor, &exam, None).unwrap();
    let ratio = found.rms / floor(&rig.cameras, &exam).unwrap().rms;
    assert!(found.located == found.n && ratio < 1.03, "{ratio}");
}

/// The same points in a frame whose X axis points the other way: a left-handed one.
fn mirrored(data: &Dataset) -> Dataset {
    let mut data = data.clone();
    for row in &mut data.correspondences {
        row.world = row.world.map(|p| Point3::new(-p.x, p.y, p.z));
    }
    data
}

#[test]
fn left_handed_worlds_are_as_good_as_right_handed_ones() {
    let rig = Rig::named("paper", 2).unwrap();
    let chart: AnyChart = LineGrid::default().into();
    let views = Stage::default().views().unwrap();
    let noise = Noise::Normal(0.1);
    let train = chart_correspondences(&rig, &chart, &views, (noise, 31), Some(400));
    let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 32), 1000);
    for method in AnyMethod::all() {
        let rms = |train: &Dataset, exam: &Dataset| {
            let fit = method.fit_checked(train, 0, &Silent).unwrap();
            evaluate(&*fit.reconstructor, exam, None).unwrap().rms
        };
        let (right, left) = (rms(&train, &exam), rms(&mirrored(&train), &mirrored(&exam)));
        // The network's starts are others there, and so is what it ends with, a little.
        assert!((left / right - 1.0).abs() < 0.05, "{}: {left} against {right}", method.name());
    }
}

/// Standard deviations of intrinsic parameters, and their correlation, against fits to the same points with other
/// noise.
#[test]
fn sigmas_of_intrinsics_are_those_of_repeated_fits() {
    const TIMES: u64 = 60;
    let rig = Rig::named("brown", 2).unwrap();
    let chart: AnyChart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
    let views = Stage::default().views().unwrap();
    let brown = AnyMethod::named("brown").unwrap().preset("fixed").unwrap();
    let (mut values, mut told, mut correlation) = (Vec::new(), Vec::new(), 0.0);
    for seed in 0..TIMES {
        let noise = (Noise::Normal(0.1), seed);
        let train = chart_correspondences(&rig, &chart, &views, noise, None);
        let fit = brown.fit_checked(&train, 0, &Silent).unwrap();
        let camera = fit.reconstructor.intrinsics().unwrap().swap_remove(0);
        let names: Vec<&str> = camera.parameters.iter().map(|parameter| parameter.name).collect();
        assert_eq!(names, ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2"]);
        values.push(camera.parameters.iter().map(|own| own.value).collect::<Vec<f64>>());
        told.push(camera.parameters.iter().map(|own| own.sigma.unwrap()).collect::<Vec<f64>>());
        correlation += camera.correlation[4][5] / TIMES as f64;
    }
    let mean = |rows: &[Vec<f64>], of: usize| {
        rows.iter().map(|row| row[of]).sum::<f64>() / rows.len() as f64
    };
    let product = |a: usize, b: usize| {
        let (first, second) = (mean(&values, a), mean(&values, b));
        values.iter().map(|row| (row[a] - first) * (row[b] - second)).sum::<f64>()
            / (values.len() - 1) as f64
    };
    // Sixty fits know a standard deviation to nine percent.
    for of in 0..9 {
        let ratio = mean(&told, of) / product(of, of).sqrt();
        assert!((0.75..1.35).contains(&ratio), "parameter {of}: {ratio:.2}");
    }
    let seen = product(4, 5) / (product(4, 4) * product(5, 5)).sqrt();
    assert!((correlation - seen).abs() < 0.1, "k1 and k2: {correlation:.2}, {seen:.2}");
}
