//! Cameras that learn what their lenses do, in worlds of many optics.

use crate::worlds::{chart, charts, world};
use serde_json::{Value, json};
use std::ops::Range;
use wheatstone_charts::chart::line_grid::LineGrid;
use wheatstone_core::{
    Error,
    camera::PosedCamera,
    dataset::{Correspondence, Dataset},
    evaluate::{evaluate, floor},
    geometry::{Pixel, Point3, Vector3},
    method::{
        AnyReconstructor, Method, Reconstructor,
        neural_camera::{NeuralCamera, NeuralCameraReconstructor},
    },
};
use wheatstone_numeric::{progress::Silent, random::Random};
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences};

fn fitted(data: &Dataset) -> NeuralCameraReconstructor {
    match (NeuralCamera::default()).fit(data, 0, &Silent).unwrap().reconstructor {
        AnyReconstructor::NeuralCamera(fitted) => fitted,
        other => panic!("{other:?}"),
    }
}

fn test_points(rig: &Rig, range: (f64, f64), noise: Noise) -> Dataset {
    random_correspondences(rig, &chart(rig), range, (noise, 5), 1000)
}

/// Error over that of the true cameras.
fn ratio(fitted: &NeuralCameraReconstructor, cameras: &[PosedCamera], test: &Dataset) -> f64 {
    evaluate(fitted, test, None).unwrap().rms / floor(cameras, test).unwrap().rms
}

/// Share of the points that lie in their ellipsoids of 95 %.
fn coverage(fitted: &NeuralCameraReconstructor, test: &Dataset) -> f64 {
    // The chi-square distribution's 95 % for three degrees of freedom.
    const BOUND: f64 = 7.814_728;
    let inside = test.known().filter(|(world, row)| {
        let located = fitted.locate(&row.pixels).unwrap();
        let error = located.point - world;
        error.dot(&(located.covariance.try_inverse().unwrap() * error)) < BOUND
    });
    inside.count() as f64 / test.correspondences.len() as f64
}

#[test]
fn exact_points_of_a_brown_lens_come_back() {
    let rig = Rig::named("paper", 2).unwrap();
    let fitted = fitted(&charts(&rig, Stage::default(), Noise::None, 400));
    let test = test_points(&rig, (50.0, 200.0), Noise::None);
    let rms = evaluate(&fitted, &test, None).unwrap().rms;
    assert!(rms < 2e-3, "{rms} cm");
}

#[test]
fn every_optics_reaches_the_floor_in_range_and_beyond() {
    for (name, bars) in [("fisheye", [1.05, 1.12]), ("glass", [1.05, 1.12]), ("bump", [1.10, 1.20])]
    {
        let rig = Rig::named(name, 2).unwrap();
        let noise = Noise::Normal(0.1);
        let fitted = fitted(&charts(&rig, Stage::default(), noise, 400));
        for (range, bar) in [(50.0, 140.0), (150.0, 200.0)].into_iter().zip(bars) {
            let test = test_points(&rig, range, noise);
            let ratio = ratio(&fitted, &rig.cameras, &test);
            assert!(ratio < bar, "{name} at {range:?}: {ratio}");
            let coverage = coverage(&fitted, &test);
            assert!((0.925..0.975).contains(&coverage), "{name} at {range:?}: {coverage}");
        }
        for noise in fitted.pixel_noise() {
            assert!((noise - 0.1).abs() < 0.01, "{name}: {noise} px");
        }
    }
}

/// The shares of a camera's predictions within one and two standard deviations where its charts have not been: beyond the
/// box about their pixels.
fn covered_beyond(name: &str, seeds: Range<u64>) -> [f64; 2] {
    let rig = Rig::named(name, 2).unwrap();
    let (mut within, mut all) = ([0.0; 2], 0.0);
    for seed in seeds {
        let views = Stage::default().views().unwrap();
        let noise = (Noise::Normal(0.1), seed);
        let data = chart_correspondences(&rig, &chart(&rig), &views, noise, None);
        let fitted = fitted(&data);
        for (camera, truth) in rig.cameras.iter().enumerate() {
            let noise = fitted.pixel_noise()[camera].powi(2);
            let seen: Vec<Pixel> =
                data.seen_by_camera(camera).into_iter().map(|(_, pixel)| pixel).collect();
            let ends = |of: fn(&Pixel) -> f64| {
                let places = || seen.iter().map(of);
                places().fold(f64::INFINITY, f64::min)..places().fold(f64::NEG_INFINITY, f64::max)
            };
            let (across, down) = (ends(|pixel| pixel.x), ends(|pixel| pixel.y));
            for index in 0..300 {
                let pixel = Pixel::new(
                    f64::from(index % 20) * 32.0 + 16.0,
                    f64::from(index / 20) * 32.0 + 16.0,
                );
                if across.contains(&pixel.x) && down.contains(&pixel.y) {
                    continue;
                }
                for distance in [60.0, 90.0, 120.0] {
                    let Some(ray) = truth.ray(pixel) else { continue };
                    let Some((found, covariance)) = fitted.predict(camera, ray.at(distance)) else {
                        continue;
                    };
                    for axis in 0..2 {
                        let sigma = (covariance[(axis, axis)] - noise).sqrt();
                        let off = (found[axis] - pixel[axis]).abs() / sigma;
                        all += 1.0;
                        within[0] += f64::from(u8::from(off < 1.0));
                        within[1] += f64::from(u8::from(off < 2.0));
                    }
                }
            }
        }
    }
    within.map(|count| count / all)
}

#[test]
fn error_bars_hold_where_no_chart_was() {
    // A port bends rays there more than what is seen of it lets expect.
    for (name, least, most) in [
        ("water", [0.5, 0.75], [0.8, 1.0]),
        ("bump", [0.65, 0.94], [0.85, 1.0]),
        ("mirror", [0.65, 0.94], [0.88, 1.0]),
        ("paper", [0.65, 0.94], [0.88, 1.0]),
    ] {
        let held = covered_beyond(name, 0..4);
        for (held, (least, most)) in held.into_iter().zip(least.into_iter().zip(most)) {
            assert!((least..=most).contains(&held), "{name}: {held}");
        }
    }
}

#[test]
fn three_planes_make_no_staircase() {
    let rig = Rig::named("water", 2).unwrap();
    let stage = Stage { step: 45.0, ..Stage::default() };
    let noise = Noise::Normal(0.1);
    let fitted = fitted(&charts(&rig, stage, noise, usize::MAX));
    for (near, far) in [(60.0, 85.0), (105.0, 130.0)] {
        let ratio = ratio(&fitted, &rig.cameras, &test_points(&rig, (near, far), noise));
        assert!(ratio < 1.15, "{near} to {far}: {ratio}");
    }
}

#[test]
fn the_evidence_asks_for_correction_only_where_there_is_something_to_correct() {
    let effective = |name: &str| {
        let rig = Rig::named(name, 2).unwrap();
        fitted(&charts(&rig, Stage::default(), Noise::Normal(0.1), 400)).effective_parameters()[0]
    };
    let (plain, bump) = (effective("pinhole"), effective("bump"));
    assert!((11.0..25.0).contains(&plain), "{plain}");
    assert!((60.0..200.0).contains(&bump), "{bump}");
}

#[test]
fn few_points_and_missing_cameras() {
    let rig = Rig::named("paper", 3).unwrap();
    let noise = Noise::Normal(0.1);
    let mut data = charts(&rig, Stage::default(), noise, 90);
    for (index, row) in data.correspondences.iter_mut().enumerate() {
        row.pixels[index % 3] = None;
    }
    let fitted = fitted(&data);
    let test = test_points(&rig, (60.0, 130.0), noise);
    let ratio = ratio(&fitted, &rig.cameras, &test);
    assert!(ratio < 1.3, "{ratio}");
    let mut pixels = test.correspondences[0].pixels.clone();
    pixels[1] = None;
    assert!(fitted.locate(&pixels).is_some());
    pixels[0] = None;
    assert!(fitted.locate(&pixels).is_none());
    let few = data.subset(|index, _| index < 10);
    assert!(matches!(NeuralCamera::default().fit(&few, 0, &Silent), Err(Error::TooFew { .. })));
    let flat = |_: usize, row: &Correspondence| row.view == 3;
    let flat = charts(&rig, Stage::default(), noise, 400).subset(flat);
    assert!(matches!(
        NeuralCamera::default().fit(&flat, 0, &Silent),
        Err(Error::Degenerate { .. })
    ));
}

#[test]
fn slopes_agree_with_differences() {
    let mut random = Random::new(3);
    for name in ["fisheye", "bump", "water"] {
        let rig = Rig::named(name, 2).unwrap();
        let fitted = fitted(&charts(&rig, Stage::default(), Noise::Normal(0.1), 200));
        for _ in 0..20 {
            let world = Point3::new(
                random.uniform(-15.0, 15.0),
                random.uniform(-10.0, 10.0),
                random.uniform(60.0, 130.0),
            );
            let step = 1e-4;
            let (_, slopes) = fitted.project(0, world).unwrap();
            for axis in 0..3 {
                let mut by = Vector3::zeros();
                by[axis] = step;
                let ahead = fitted.project(0, world + by).unwrap().0;
                let behind = fitted.project(0, world - by).unwrap().0;
                let gap = (ahead - behind) / (2.0 * step) - slopes.column(axis);
                assert!(gap.norm() < 1e-5 * slopes.norm(), "{name} at {world}: {gap}");
            }
        }
    }
}

#[test]
fn same_input_same_bits_and_a_file_brings_all_back() {
    let rig = Rig::named("glass", 2).unwrap();
    let data = charts(&rig, Stage::default(), Noise::Quantised, 150);
    let first = fitted(&data);
    let text = serde_json::to_string(&first).unwrap();
    assert_eq!(text, serde_json::to_string(&fitted(&data)).unwrap());
    assert_eq!(serde_json::from_str::<NeuralCameraReconstructor>(&text).unwrap(), first);
    assert!(first.is_consistent());
    for (from, to) in [
        ("{\"cameras\"", "{\"other\":1,\"cameras\""),
        ("{\"layout\"", "{\"other\":1,\"layout\""),
        ("{\"centre\"", "{\"other\":1,\"centre\""),
    ] {
        let odd = text.replacen(from, to, 1);
        assert!(odd != text && serde_json::from_str::<NeuralCameraReconstructor>(&odd).is_err());
    }
    for (from, to) in [("\"reach\":", "\"reach\":-"), ("\"weights\":[", "\"weights\":[[0.0,0.0],")]
    {
        let broken: NeuralCameraReconstructor =
            serde_json::from_str(&text.replacen(from, to, 1)).unwrap();
        assert!(!broken.is_consistent(), "{to}");
    }
    let none: NeuralCameraReconstructor = serde_json::from_str("{\"cameras\":[]}").unwrap();
    assert!(!none.is_consistent());
}

/// A camera without functions, as programs wrote it that knew fewer settings.
#[test]
fn files_of_earlier_programs_are_read() {
    let rig = Rig::named("paper", 2).unwrap();
    let new = fitted(&charts(&rig, Stage::default(), Noise::Normal(0.1), 100));
    let mut text = serde_json::to_value(&new).unwrap();
    for camera in text["cameras"].as_array_mut().unwrap() {
        camera.as_object_mut().unwrap().remove("uncertain_functions").unwrap();
        camera["settings"]["logs"].as_array_mut().unwrap().truncate(9);
        camera["weight_covariance"] = json!([]);
        camera["follow"] = json!([[], []]);
        camera["optics"]["weights"] = json!([]);
        let field = camera["optics"]["field"].as_object_mut().unwrap();
        field.remove("distortion");
        (field["waves"], field["parallax"]) = (json!([]), json!([]));
    }
    // Waves of one pixel and of length 1, of which nothing is known beyond the charts.
    let mut with_settings = text.clone();
    for camera in with_settings["cameras"].as_array_mut().unwrap() {
        camera["error_bar_settings"] = json!({ "logs": vec![0.0; 9] });
    }
    let far = Point3::new(80.0, 0.0, 90.0);
    let [without, with] = [&text, &with_settings].map(|text| {
        let old: NeuralCameraReconstructor = serde_json::from_value(text.clone()).unwrap();
        old.predict(1, far).unwrap().1
    });
    assert!(with[(0, 0)] > without[(0, 0)] + 1.0, "{with} for {without}");
    for text in [text, with_settings] {
        let old: NeuralCameraReconstructor = serde_json::from_value(text).unwrap();
        assert!(old.is_consistent());
        let world = Point3::new(3.0, -2.0, 90.0);
        let [(old, bars), (new, wanted)] = [old, new.clone()].map(|c| c.predict(1, world).unwrap());
        // The rig has lenses without anything to correct.
        assert!((old - new).norm() < 0.1, "{old} for {new}");
        assert!(bars[(0, 0)] > 0.8 * wanted[(0, 0)], "{bars} for {wanted}");
    }
    let mut short = serde_json::to_value(&new).unwrap();
    short["cameras"][0]["settings"]["logs"].as_array_mut().unwrap().truncate(8);
    assert!(serde_json::from_value::<NeuralCameraReconstructor>(short).is_err());
}

/// A camera as it was written before pupils moved: without the pupil's number, and without its row and column.
fn before_pupils(camera: &mut Value) {
    const NUMBERS: usize = 17;
    let lens = camera["optics"]["lens"].as_object_mut().unwrap();
    for name in ["pupil", "middle_nearness"] {
        lens.remove(name).unwrap();
    }
    camera["settings"]["logs"].as_array_mut().unwrap().truncate(10);
    let without_last = |values: &Value, rows: usize| -> Value {
        let rows = values.as_array().unwrap().chunks(NUMBERS).take(rows);
        rows.flat_map(|row| row[..NUMBERS - 1].to_vec()).collect()
    };
    camera["lens_covariance"] = without_last(&camera["lens_covariance"], NUMBERS - 1);
    for axis in 0..2 {
        camera["follow"][axis] = without_last(&camera["follow"][axis], usize::MAX);
    }
}

#[test]
fn files_of_cameras_whose_pupils_did_not_move_mean_the_same() {
    let rig = Rig::named("glass", 2).unwrap();
    let new = fitted(&charts(&rig, Stage::default(), Noise::Normal(0.1), 200));
    let mut text = serde_json::to_value(&new).unwrap();
    text["cameras"].as_array_mut().unwrap().iter_mut().for_each(before_pupils);
    let old: NeuralCameraReconstructor = serde_json::from_value(text).unwrap();
    assert!(old.is_consistent());
    for world in [Point3::new(3.0, -2.0, 60.0), Point3::new(-20.0, 9.0, 130.0)] {
        let [(old, bars), (new, wanted)] = [&old, &new].map(|c| c.predict(1, world).unwrap());
        assert!((old - new).norm() < 1e-6, "{old} for {new}");
        assert!((bars - wanted).norm() < 1e-6 * wanted.norm(), "{bars} for {wanted}");
    }
}

/// A convex mirror shows things from farther behind it the farther from its middle they are seen.
#[test]
fn pupils_move_before_a_mirror_and_stay_in_plain_lenses() {
    for (name, moves) in [("mirror", true), ("paper", false), ("fisheye", false)] {
        let rig = Rig::named(name, 2).unwrap();
        let (columns, rows) = (13, 10);
        let chart = LineGrid { columns, rows, pitch: rig.chart_pitch(), ..LineGrid::default() };
        let views = Stage::default().views().unwrap();
        let noise = (Noise::Normal(0.1), 1);
        let fitted = fitted(&chart_correspondences(&rig, &chart.into(), &views, noise, Some(900)));
        let file = serde_json::to_value(&fitted).unwrap();
        for (index, camera) in rig.cameras.iter().enumerate() {
            let pupil = file["cameras"][index]["optics"]["lens"]["pupil"].as_f64().unwrap();
            assert_eq!(pupil.abs() > 1e-4, moves, "{name}: {pupil}");
            // At the border of the picture charts were near only.
            let at = |x: f64, y: f64| {
                let pixel = Pixel::new(x, y);
                let found = fitted.predict(index, camera.ray(pixel).unwrap().at(150.0)).unwrap().0;
                (found - pixel).norm_squared()
            };
            let squares = [at(40.0, 40.0), at(600.0, 40.0), at(40.0, 440.0), at(600.0, 440.0)];
            let rms = (squares.iter().sum::<f64>() / 4.0).sqrt();
            assert!(rms < 0.25, "{name}: {rms} px");
        }
    }
}

/// The wall of a round tank bends rays along one axis, which radial terms do not have.
#[test]
fn cameras_before_a_round_tank_have_distortion_and_plain_ones_do_not() {
    for (name, is_curved) in [("tube", true), ("paper", false), ("fisheye", false)] {
        let file = serde_json::to_value(fitted(&world(name, 2).2)).unwrap();
        let mut cameras = file["cameras"].as_array().unwrap().iter();
        let is_distorted = |camera: &Value| !camera["optics"]["field"]["distortion"].is_null();
        assert_eq!(cameras.any(is_distorted), is_curved, "{name}");
    }
}

#[test]
fn a_few_more_points_are_taken_in_as_by_a_fit_from_nothing() {
    for name in ["paper", "fisheye", "glass", "bump"] {
        let rig = Rig::named(name, 2).unwrap();
        let all = charts(&rig, Stage::default(), Noise::Normal(0.1), 400);
        let most = all.subset(|row, _| row % 15 != 0);
        let (earlier, wanted) = (fitted(&most), fitted(&all));
        let refitted = earlier.refit(&all, &Silent).unwrap();
        let apart = |one: &NeuralCameraReconstructor| {
            let squares = all.known().flat_map(|(world, _)| {
                [0, 1].map(|camera| {
                    let [a, b] = [one, &wanted].map(|c| c.project(camera, world).unwrap().0);
                    (a - b).norm_squared()
                })
            });
            (squares.sum::<f64>() / (4 * all.correspondences.len()) as f64).sqrt()
        };
        // In pixels: the noise is a tenth of one, and settings are sought no longer than they convince.
        let (before, after) = (apart(&earlier), apart(&refitted));
        assert!(after < 0.003 && after < 0.4 * before, "{name}: {after} px, {before} before");
        for (found, wanted) in refitted.pixel_noise().iter().zip(wanted.pixel_noise()) {
            assert!((found / wanted - 1.0).abs() < 0.005, "{name}: {found} px for {wanted}");
        }
    }
}
