//! Rectified pairs against worlds whose truth is known.

use wheatstone::{
    Calibration,
    chart::{AnyChart, ChartSearch, line_grid::LineGrid},
    dataset::Dataset,
    error::Remedy,
    formats::{Imported, calibration, exact},
    geometry::{Pixel, Point3, Pose, Vector3},
    method::AnyMethod,
    numeric::{progress::Silent, random::Random},
    preparation::Preparation,
    rectification::{PairSettings, Rectification, Table, VerticalErrors},
    rectified_pictures::remapped,
    synthetic::{Noise, Rig, Sensor, Stage, chart_correspondences, random_correspondences, render},
};

fn chart(rig: &Rig) -> AnyChart {
    LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into()
}

fn data(rig: &Rig, sigma: f64) -> Dataset {
    let views = Stage::default().views().unwrap();
    chart_correspondences(rig, &chart(rig), &views, (Noise::Normal(sigma), 5), Some(900))
}

fn model_of(method: &str, data: Dataset) -> Calibration {
    let prepared = Preparation::default().run(data, 0, &Silent).unwrap();
    let method = AnyMethod::named(method).unwrap();
    let mut model = Calibration::fit(&method, &prepared, 1, false, &Silent).unwrap();
    model.sizes = vec![Some([640, 480]); model.volume.cameras()];
    model
}

fn model(method: &str, rig: &Rig, sigma: f64) -> Calibration {
    model_of(method, data(rig, sigma))
}

/// Exact pixels of places that no fit saw.
fn exam(rig: &Rig) -> Dataset {
    random_correspondences(rig, &chart(rig), (55.0, 135.0), (Noise::None, 77), 600)
}

fn judged(model: &Calibration, wanted: &PairSettings, exam: &Dataset) -> VerticalErrors {
    Rectification::of(model, wanted, &Silent).unwrap().judge(exam).unwrap()
}

#[test]
fn without_noise_rows_agree_and_disparity_tells_the_true_place() {
    for (rig, method) in [("paper", "brown"), ("fisheye", "kannala-brandt"), ("pinhole", "dlt")] {
        let rig = Rig::named(rig, 2).unwrap();
        let model = model(method, &rig, 0.0);
        let made = Rectification::of(&model, &PairSettings::default(), &Silent).unwrap();
        let exam = exam(&rig);
        let found = made.judge(&exam).unwrap();
        assert_eq!(found.vertical.n, 600, "{method}");
        assert!(found.vertical.max < 1e-4, "{method}: {found:?}");
        assert!(found.place.unwrap().max < 1e-3, "{method}: {found:?}");
        // The virtual centres are the true ones, and the tables say where the true pixels are.
        for (centre, camera) in made.pair.centres().iter().zip(&rig.cameras) {
            assert!((centre - camera.centre()).norm() < 1e-4, "{method}");
        }
        for side in 0..2 {
            let table = made.table(side);
            assert!(table.filled > 0.85 && table.shown > 0.6, "{method}: {}", table.filled);
            follows(&made, &table, side, &exam, &rig);
        }
    }
}

/// The table at the rectified pixel of a place, interpolated as `remap` would, is its true pixel.
fn follows(made: &Rectification, table: &Table, side: usize, exam: &Dataset, rig: &Rig) {
    let camera = made.pair.cameras[side];
    let mut looked = 0;
    for (world, _) in exam.known() {
        let truth = rig.cameras[camera].project(world).unwrap();
        let at = made.rectified(side, truth).unwrap();
        let (x, y) = (at.x.floor(), at.y.floor());
        let inside =
            x >= 0.0 && y >= 0.0 && x + 1.0 < table.width as f64 && y + 1.0 < table.height as f64;
        if !inside {
            continue;
        }
        let index = y as usize * table.width + x as usize;
        let blend = |values: &[f32]| {
            let (across, down) = (at.x - x, at.y - y);
            let v = |offset: usize| f64::from(values[index + offset]);
            let upper = v(0) * (1.0 - across) + v(1) * across;
            let lower = v(table.width) * (1.0 - across) + v(table.width + 1) * across;
            upper * (1.0 - down) + lower * down
        };
        let told = Pixel::new(blend(&table.x), blend(&table.y));
        assert!((told - truth).norm() < 2e-3, "{told} {truth}");
        looked += 1;
    }
    assert!(looked > 500, "{looked}");
}

#[test]
fn every_method_gives_a_pair() {
    let rig = Rig::named("paper", 2).unwrap();
    let exam = exam(&rig);
    let data = data(&rig, 0.05);
    // Twice to three times what was measured; most of it is what the method has wrong of this lens.
    let most = |name: &str| match name {
        "soloff" => 2.0,
        "dlt" => 0.4,
        "interpolation" => 0.3,
        "tsai" | "kannala-brandt" => 0.12,
        _ => 0.05,
    };
    for name in AnyMethod::NAMES {
        let model = model_of(name, data.clone());
        let made = Rectification::of(&model, &PairSettings::default(), &Silent).unwrap();
        let found = made.judge(&exam).unwrap();
        assert_eq!(found.vertical.n, 600, "{name}");
        assert!(found.vertical.rms < most(name), "{name}: {:?}", found.vertical);
        let measured = made.leftover.measured.as_ref().unwrap();
        assert!(measured.vertical.rms > 0.5 * found.vertical.rms, "{name}: told too little");
        assert!(made.table(0).filled > 0.85, "{name}");
        assert_eq!(made.leftover.followed.is_some(), !model.reconstructor.has_projection());
    }
}

#[test]
fn what_water_and_glass_leave_is_told_as_it_is() {
    for (name, most) in [("water", 0.15), ("glass", 0.12)] {
        let rig = Rig::named(name, 2).unwrap();
        let model = model("neural-camera", &rig, 0.02);
        let made = Rectification::of(&model, &PairSettings::default(), &Silent).unwrap();
        let found = made.judge(&exam(&rig)).unwrap();
        let told = made.leftover.model.as_ref().unwrap();
        assert!(found.vertical.rms < most, "{name}: {:?}", found.vertical);
        let honest = |told: f64, found: f64| found < 1.5 * told + 0.02 && told < 2.0 * found + 0.02;
        assert!(honest(told.vertical.rms, found.vertical.rms), "{name}: {told:?} {found:?}");
        assert!(honest(told.vertical.p95, found.vertical.p95), "{name}: {told:?} {found:?}");
        let (told, found) = (told.place.unwrap(), found.place.unwrap());
        assert!(honest(told.rms, found.rms), "{name}: {told:?} {found:?}");
        // At the depth at which the tables are exact hardly anything is left.
        let slices = &made.leftover.model.as_ref().unwrap().by_depth;
        let off = |depth: f64| (depth - made.pair.depth).abs();
        let near = slices.iter().min_by(|a, b| off(a.depth).total_cmp(&off(b.depth))).unwrap();
        assert!(near.vertical.rms < 0.02, "{name}: {near:?}");
    }
}

#[test]
fn the_left_one_is_left_in_whatever_order_and_any_two_of_several_do() {
    let rig = Rig::named("paper", 4).unwrap();
    let model = model("brown", &rig, 0.0);
    let exam = exam(&rig);
    let of = |cameras| PairSettings { cameras, ..PairSettings::default() };
    let pair = |cameras| Rectification::of(&model, &of(cameras), &Silent).unwrap().pair;
    assert_eq!(pair([0, 1]), pair([1, 0]));
    assert_eq!(pair([1, 0]).cameras, [0, 1]);
    for cameras in [[0, 1], [0, 2], [3, 1], [2, 3]] {
        let found = judged(&model, &of(cameras), &exam);
        assert!(found.vertical.max < 1e-4 && found.place.unwrap().max < 1e-3, "{cameras:?}");
        assert!(found.disparity[0] < found.disparity[1]);
    }
    for cameras in [[0, 0], [0, 4]] {
        Rectification::of(&model, &of(cameras), &Silent).map(|_| ()).unwrap_err();
    }
    let small =
        PairSettings { size: Some([320, 200]), focal: Some(300.0), ..PairSettings::default() };
    let made = Rectification::of(&model, &small, &Silent).unwrap();
    let table = made.table(1);
    assert_eq!((table.width, table.height, made.pair.focal), (320, 200, 300.0));
    assert!(made.judge(&exam).unwrap().vertical.max < 1e-4);
}

#[test]
fn of_cameras_one_behind_the_other_a_pair_shows_what_flat_pictures_hold() {
    let turned = |degrees: f64| {
        let mut rig = Rig::named("pinhole", 2).unwrap();
        let [first, second] = &mut rig.cameras[..] else { panic!("two cameras") };
        // Behind the first camera, and beside it by this angle.
        let turn = Pose::from_rotation_vector(
            Vector3::zeros(),
            Vector3::new(0.0, -f64::to_radians(degrees), 0.0),
        );
        let behind = turn.rotation * Vector3::new(0.0, 0.0, -12.0);
        let centre = first.centre() + first.camera_from_world.rotation.transpose() * behind;
        let rotation = second.camera_from_world.rotation;
        second.camera_from_world.translation = -(rotation * centre.coords);
        rig
    };
    for degrees in [40.0, 25.0] {
        let rig = turned(degrees);
        let model = model("dlt", &rig, 0.0);
        let made = Rectification::of(&model, &PairSettings::default(), &Silent).unwrap();
        let found = made.judge(&exam(&rig)).unwrap();
        assert!(found.vertical.max < 1e-4 && found.place.unwrap().max < 1e-3, "{found:?}");
        // Of the 694 pixels of the cameras' own focal length; of the 600 points.
        assert!(made.pair.focal > 200.0 && found.vertical.n > 450, "{:?}, {found:?}", made.pair);
        let [least, most] = made.leftover.model.as_ref().unwrap().disparity;
        assert!(most - least < f64::from(made.pair.size[0]), "{least}, {most}");
        assert!(made.table(0).filled > 0.5 && made.table(1).filled > 0.5);
    }
    let model = model("dlt", &turned(8.0), 0.0);
    let refused = Rectification::of(&model, &PairSettings::default(), &Silent).map(|_| ());
    assert!(refused.unwrap_err().to_string().contains("behind the other"));
}

#[test]
fn a_left_handed_world_keeps_its_hand() {
    let rig = Rig::named("paper", 2).unwrap();
    let turned = |mut data: Dataset| {
        for row in &mut data.correspondences {
            row.world = row.world.map(|p| Point3::new(p.x, p.y, 200.0 - p.z));
        }
        data
    };
    for method in ["brown", "neural-camera", "dlt"] {
        let model = model_of(method, turned(data(&rig, 0.0)));
        let made = Rectification::of(&model, &PairSettings::default(), &Silent).unwrap();
        let found = made.judge(&turned(exam(&rig))).unwrap();
        assert!(
            (made.pair.rectified_from_world.rotation.determinant() + 1.0).abs() < 1e-9,
            "{method}"
        );
        let loose = if method == "dlt" { 2.0 } else { 1e-3 };
        assert!(found.vertical.max < loose, "{method}: {found:?}");
        assert!(found.place.unwrap().max < loose, "{method}: {found:?}");
    }
}

#[test]
fn cameras_from_a_file_need_the_size_of_their_pictures_alone() {
    let rig = Rig::named("paper", 2).unwrap();
    let own = exact(&model("brown", &rig, 0.0)).unwrap();
    let imported = |sizes| Imported {
        format: "opencv".into(),
        files: Vec::new(),
        cameras: Vec::new(),
        sizes,
        pixel_sigma: 0.5,
    };
    let unsized_model = calibration(&own, imported(Vec::new())).unwrap();
    let error = Rectification::of(&unsized_model, &PairSettings::default(), &Silent).map(|_| ());
    let hint = error.unwrap_err().hint().unwrap();
    assert_eq!(hint.remedy(), Some(Remedy::ImageSize));
    let model = calibration(&own, imported(vec![Some([640, 480]); 2])).unwrap();
    let found = judged(&model, &PairSettings::default(), &exam(&rig));
    assert!(found.vertical.max < 1e-4 && found.place.unwrap().max < 1e-3, "{found:?}");
}

#[test]
fn a_chart_in_rectified_pictures_has_its_points_in_the_same_rows() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = model("auto", &rig, 0.05);
    let made = Rectification::of(&model, &PairSettings::default(), &Silent).unwrap();
    let chart = chart(&rig);
    let (_, pose) = &Stage { near: 90.0, far: 90.0, step: 10.0 }.views().unwrap()[0];
    let mut seen = Vec::new();
    for side in 0..2 {
        let camera = &rig.cameras[made.pair.cameras[side]];
        let picture = render(camera, &chart, pose, Sensor::default(), &mut Random::new(4));
        let rectified = remapped(&made.table(side), &picture);
        assert_eq!([rectified.width() as u32, rectified.height() as u32], made.pair.size);
        let ChartSearch::Found(readings) = chart.detect(&rectified) else { panic!("not found") };
        seen.push(readings[0].points.clone());
    }
    let mut worst: f64 = 0.0;
    let mut both = 0;
    for (id, left) in &seen[0] {
        let Some((_, right)) = seen[1].iter().find(|(other, _)| other == id) else { continue };
        worst = worst.max((left.y - right.y).abs());
        let told = made.meet(*left, *right).unwrap();
        let truth = made.pair.rectified_from_world.transform(pose.transform(chart.points()[*id]));
        assert!((told - truth).norm() < 0.6, "{told} {truth}");
        both += 1;
    }
    assert!(both > 50 && worst < 0.2, "{both} points, {worst} px");
}
