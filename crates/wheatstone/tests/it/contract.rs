//! What every registered implementation must do; a new row is covered without a new test.

use serde::{Serialize, de::DeserializeOwned};
use std::{collections::BTreeSet, fmt::Debug};
use wheatstone::{
    camera::{AnyCamera, PosedCamera, pinhole::Pinhole},
    chart::{AnyChart, ChartSearch, Shape},
    dataset::Dataset,
    evaluate::evaluate,
    geometry::{Pixel, Point3, Pose, Vector3},
    imaging::GrayImage,
    method::{
        AnyMethod,
        network::{Network, Training},
    },
    numeric::{progress::Silent, random::Random},
    synthetic::{Noise, Rig, Sensor, Stage, chart_correspondences, random_correspondences, render},
};

fn survives_its_file<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let json = serde_json::to_string(value).unwrap();
    assert_eq!(&serde_json::from_str::<T>(&json).unwrap(), value);
    let typo = json.replacen('{', r#"{"no-such-field":1,"#, 1);
    assert!(serde_json::from_str::<T>(&typo).is_err(), "accepts unknown fields: {typo}");
}

#[test]
fn charts_have_distinct_points_and_survive_their_files() {
    for chart in AnyChart::all() {
        let points = chart.points();
        let distinct: BTreeSet<_> = points.iter().map(|p| format!("{p:?}")).collect();
        assert_eq!(distinct.len(), points.len(), "{chart:?}");
        chart.validate().unwrap();
        survives_its_file(&chart);
    }
}

#[test]
fn what_a_chart_reflects_is_what_it_prints() {
    for chart in AnyChart::all() {
        let mut random = Random::new(1);
        let [left, top, right, bottom] = chart.board();
        for _ in 0..2000 {
            let (x, y) = (random.uniform(left, right), random.uniform(top, bottom));
            let inked = chart.shapes().iter().any(|shape| match shape {
                Shape::Rectangle([l, t, r, b]) => x >= *l && x < *r && y >= *t && y < *b,
                Shape::Disc(centre, radius) => {
                    let (across, down) = (x - centre[0], y - centre[1]);
                    across * across + down * down < radius * radius
                }
            });
            let reflected = chart.reflectance([x, y], [0.0, 0.0]).unwrap();
            assert_eq!(reflected, if inked { 0.0 } else { 1.0 }, "{chart:?} at {x}, {y}");
        }
        assert_eq!(chart.reflectance([right + 1.0, top], [0.0, 0.0]), None);
    }
}

/// A camera square before the middle of a chart, a little turned so that no line follows the pixels.
fn camera_before(chart: &AnyChart) -> (PosedCamera, Pose) {
    let [left, top, right, bottom] = chart.board();
    let middle = Vector3::new((left + right) / 2.0, (top + bottom) / 2.0, 0.0);
    let size = (right - left).max((bottom - top) * 4.0 / 3.0);
    let camera_from_world =
        Pose::from_rotation_vector(Vector3::zeros(), Vector3::new(0.1, -0.15, 0.05));
    let camera = PosedCamera {
        camera_from_world,
        model: Pinhole::default().into(),
        width: 640,
        height: 480,
    };
    // At f = 700 px the board then takes up three quarters of the width.
    let distance = Vector3::new(0.0, 0.0, size * 700.0 / 480.0);
    let centre = camera_from_world.inverse().rotation * distance;
    (camera, Pose { translation: centre - middle, ..Pose::default() })
}

#[test]
fn charts_are_found_where_they_are_drawn_and_nowhere_else() {
    for chart in AnyChart::all() {
        let (camera, pose) = camera_before(&chart);
        let image = render(&camera, &chart, &pose, Sensor::default(), &mut Random::new(3));
        let ChartSearch::Found(readings) = chart.detect(&image) else {
            panic!("{chart:?} is not found: {:?}", chart.detect(&image));
        };
        let points = chart.points();
        assert_eq!(readings[0].points.len(), points.len(), "{chart:?}");
        let right_reading = readings.iter().any(|reading| {
            reading.points.iter().all(|(id, pixel)| {
                let truth = camera.project(pose.transform(points[*id])).unwrap();
                (truth - pixel).norm() < 0.3
            })
        });
        assert!(right_reading, "{chart:?}");
        let mut random = Random::new(9);
        let noise: Vec<f32> = (0..64 * 48).map(|_| random.uniform(0.0, 255.0) as f32).collect();
        let nothing = [
            GrayImage::from_values(64, 48, noise).unwrap(),
            GrayImage::from_fn(1, 1, |_, _| 0.0),
            GrayImage::from_fn(300, 200, |_, _| 128.0),
            GrayImage::from_fn(3, 200, |_, y| y as f32),
        ];
        for image in nothing {
            assert!(matches!(chart.detect(&image), ChartSearch::NotFound(_)), "{chart:?}");
        }
    }
}

#[test]
fn cameras_look_back_along_what_they_project() {
    for mut camera in AnyCamera::all() {
        // Before a mirror a camera sees what is behind it.
        let middle = camera.ray(Pixel::new(319.5, 239.5)).unwrap();
        let depth = 60.0 * middle.direction.z.signum();
        for (x, y) in [(0.0, 0.0), (12.0, -8.0), (-14.0, 9.0), (3.0, 12.0)] {
            let point = Point3::new(x, y, depth);
            let pixel = camera.project(point).unwrap();
            let ray = camera.ray(pixel).unwrap();
            let along = (point - ray.origin).dot(&ray.direction);
            assert!((ray.at(along) - point).norm() < 1e-7, "{camera:?} at {point}");
            let (same, jacobian) = camera.project_with_jacobian(point).unwrap();
            assert_eq!(same, pixel);
            for axis in 0..3 {
                let mut step = Vector3::zeros();
                step[axis] = 1e-3;
                let ahead = camera.project(point + step).unwrap();
                let behind = camera.project(point - step).unwrap();
                let difference = (ahead - behind) / 2e-3;
                let gap = (difference - jacobian.column(axis)).norm();
                assert!(gap < 1e-5, "{camera:?} axis {axis}: {gap}");
            }
        }
        let behind = Point3::new(0.0, 0.0, -depth);
        assert_eq!(camera.project(behind), None, "{camera:?}");
        survives_its_file(&camera);
        let before = camera.clone();
        camera.parameters_mut().into_iter().for_each(|parameter| *parameter += 1e-3);
        assert_ne!(camera, before, "parameters_mut reaches nothing");
    }
}

/// A method that does not take a test's patience: the networks learn for a moment only.
fn quick(mut method: AnyMethod) -> AnyMethod {
    if let AnyMethod::Network(Network { training: Training::Evidence(training), .. }) = &mut method
    {
        (training.starts, training.steps) = (1, 30);
    }
    method
}

fn training(cameras: usize) -> (Rig, Dataset) {
    let rig = Rig::named("pinhole", cameras).unwrap();
    let views = Stage::default().views().unwrap();
    let chart = &AnyChart::all()[0];
    let data = chart_correspondences(&rig, chart, &views, (Noise::Normal(0.1), 5), None);
    (rig, data)
}

#[test]
fn methods_fit_any_number_of_cameras_and_refuse_what_determines_nothing() {
    for cameras in 2..=4 {
        let (rig, data) = training(cameras);
        let chart = &AnyChart::all()[0];
        let exam = random_correspondences(&rig, chart, (55.0, 135.0), (Noise::Normal(0.1), 6), 200);
        for method in AnyMethod::all().into_iter().map(quick) {
            let fit = method.fit_checked(&data, 1, &Silent).unwrap();
            assert_eq!(fit.reconstructor.cameras(), cameras);
            let found = evaluate(&*fit.reconstructor, &exam, None).unwrap();
            assert_eq!(found.located, 200, "{}", method.name());
            // Even a network that has learned for a moment knows where the room is.
            assert!(found.mean_percent < 20.0, "{}: {found:?}", method.name());
            for row in &exam.correspondences[..20] {
                let located = fit.reconstructor.locate(&row.pixels).map(|located| located.point);
                assert_eq!(
                    fit.reconstructor.locate_point(&row.pixels),
                    located,
                    "{}",
                    method.name()
                );
            }
            let none = vec![None; cameras];
            assert!(fit.reconstructor.locate(&none).is_none());
            let mut one = none.clone();
            one[0] = Some(Pixel::new(300.0, 200.0));
            assert!(fit.reconstructor.locate(&one).is_none(), "{} needs no depth", method.name());
        }
    }
    let (_, data) = training(2);
    for method in AnyMethod::all().into_iter().map(quick) {
        method.fit_checked(&data.subset(|_, _| false), 0, &Silent).unwrap_err();
        method.fit_checked(&data.subset(|index, _| index < 5), 0, &Silent).unwrap_err();
        let one_plane = data.subset(|_, row| row.view == 2);
        let error = method.fit_checked(&one_plane, 0, &Silent).unwrap_err();
        assert!(error.to_string().contains("one plane"), "{error}");
    }
}

#[test]
fn fits_are_the_same_bits_again_and_survive_their_files() {
    let (_, data) = training(2);
    for method in AnyMethod::all().into_iter().map(quick) {
        survives_its_file(&method);
        let fit = || method.fit_checked(&data, 7, &Silent).unwrap().reconstructor;
        let (once, again) = (fit(), fit());
        assert_eq!(
            serde_json::to_string(&once).unwrap(),
            serde_json::to_string(&again).unwrap(),
            "{}",
            method.name()
        );
        survives_its_file(&once);
        assert!(once.is_consistent());
        assert_eq!(AnyMethod::named(method.name()).unwrap().name(), method.name());
        for preset in method.presets() {
            method.preset(preset).unwrap();
        }
        assert!(method.preset("no-such-preset").is_err());
    }
    assert!(AnyMethod::named("no-such-method").is_err());
}
