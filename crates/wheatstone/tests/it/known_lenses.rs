//! Cameras whose lenses are known from before: poses from one view or a few, and what is uncertain of them.

use wheatstone::{
    camera::brown_conrady::BrownConrady,
    chart::{AnyChart, line_grid::LineGrid},
    dataset::Dataset,
    evaluate::evaluate,
    geometry::{Pose, Vector3},
    method::{AnyMethod, AnyReconstructor, FittedCameras, KnownLens, brown::Brown},
    numeric::{progress::Silent, random::Random},
    preparation::Preparation,
    synthetic::{HandHeld, Noise, Rig, hand_held_correspondences, random_correspondences},
};

const NOISE: Noise = Noise::Normal(0.1);

fn chart(rig: &Rig) -> AnyChart {
    LineGrid { pitch: 0.75 * rig.chart_pitch(), columns: 11, rows: 9, ..LineGrid::default() }.into()
}

/// A chart at so many places, which are given unless it was held by hand.
fn recorded(rig: &Rig, views: usize, given: bool, seed: u64) -> Dataset {
    let chart = chart(rig);
    let how = HandHeld { views, near: 80.0, far: 110.0, ..HandHeld::default() };
    let placements = how.placements(&chart, seed).unwrap();
    let (mut data, places) = hand_held_correspondences(rig, &chart, &placements, (NOISE, seed));
    if given {
        for (row, place) in data.correspondences.iter_mut().zip(places) {
            (row.world, row.board) = (Some(place), None);
        }
    }
    data
}

/// The rig after its cameras were knocked: turned by degrees, moved by centimetres.
fn knocked(rig: &Rig, seed: u64) -> Rig {
    let mut rig = rig.clone();
    let mut random = Random::stream(seed, 7);
    for camera in &mut rig.cameras {
        let mut up_to = |most: f64| random.uniform(-most, most);
        let turn = Vector3::new(up_to(0.05), up_to(0.05), up_to(0.05));
        let by = Vector3::new(up_to(2.0), up_to(2.0), up_to(2.0));
        camera.camera_from_world =
            Pose::from_rotation_vector(by, turn).after(&camera.camera_from_world);
    }
    rig
}

fn brown(fit: AnyReconstructor) -> FittedCameras<BrownConrady> {
    match fit {
        AnyReconstructor::Brown(cameras) => cameras,
        other => panic!("{other:?}"),
    }
}

fn calibrated(data: &Dataset) -> FittedCameras<BrownConrady> {
    brown(AnyMethod::named("brown").unwrap().fit_checked(data, 0, &Silent).unwrap().reconstructor)
}

fn keeping(lenses: Vec<KnownLens<BrownConrady>>) -> AnyMethod {
    Brown { lenses, ..Brown::default() }.into()
}

/// The squared Mahalanobis distance of each camera's pose from the true one, seen from `frame`, the world of the fit.
fn distances(fit: &FittedCameras<BrownConrady>, rig: &Rig, frame: &Pose) -> Vec<f64> {
    let each = fit.cameras.iter().zip(&fit.uncertainty).zip(&rig.cameras);
    each.map(|((camera, open), truth)| {
        let truth = truth.camera_from_world.after(frame);
        let found = camera.camera_from_world;
        let turn = Pose { rotation: truth.rotation * found.rotation.transpose(), ..found };
        let turn = turn.rotation_vector();
        let by = truth.transform(open.middle()) - found.transform(open.middle());
        let off = nalgebra::Vector6::new(turn.x, turn.y, turn.z, by.x, by.y, by.z);
        let covariance = open.pose_covariance().unwrap();
        off.dot(&covariance.cholesky().unwrap().solve(&off))
    })
    .collect()
}

/// The 95 % quantile of chi-square with six degrees of freedom.
const CHI_SQUARE: f64 = 12.592;

#[test]
fn one_view_tells_poses_and_their_error_bars() {
    let rig = Rig::named("paper", 2).unwrap();
    // Which terms a lens has is a choice: what was left out is not known to be 0.
    let numbers = AnyMethod::named("brown").unwrap().lens_numbers();
    let mut all = Vec::new();
    for seed in 0..100 {
        let session = recorded(&rig, 8, true, 1000 + seed);
        let lenses = calibrated(&session).lenses_among(&numbers, &session);
        let moved = knocked(&rig, seed);
        let view = recorded(&moved, 1, true, seed);
        let found = keeping(lenses).fit_checked(&view, 0, &Silent).unwrap();
        all.extend(distances(&brown(found.reconstructor), &moved, &Pose::default()));
    }
    let inside = all.iter().filter(|distance| **distance < CHI_SQUARE).count();
    let share = inside as f64 / all.len() as f64;
    assert!((0.93..=0.98).contains(&share), "{share}");
}

#[test]
fn one_view_of_a_board_in_the_hand_is_the_frame_of_the_world() {
    let rig = Rig::named("paper", 2).unwrap();
    let mut all = Vec::new();
    for seed in 0..50 {
        let lenses = calibrated(&recorded(&rig, 8, true, 2000 + seed)).lenses();
        let moved = knocked(&rig, seed);
        let method = keeping(lenses);
        let preparation = Preparation { lenses: method.known_lenses(), ..Preparation::default() };
        let view = recorded(&moved, 1, false, seed);
        let ready = preparation.run(view, 0, &Silent).unwrap();
        let found = method.fit_checked(&ready.data, 0, &Silent).unwrap();
        let how = HandHeld { views: 1, near: 80.0, far: 110.0, ..HandHeld::default() };
        let frame = how.placements(&chart(&rig), seed).unwrap()[0].1;
        let found = brown(found.reconstructor);
        let [left, right] = [0, 1].map(|camera: usize| found.cameras[camera].camera_from_world);
        let relative = right.after(&left.inverse());
        let truth =
            [0, 1].map(|camera: usize| moved.cameras[camera].camera_from_world.after(&frame));
        let truth = truth[1].after(&truth[0].inverse());
        all.push((relative.translation - truth.translation).norm());
    }
    all.sort_by(f64::total_cmp);
    assert!(all[25] < 0.5 && all[49] < 3.0, "{all:?}");
}

#[test]
fn three_views_locate_as_well_as_a_full_calibration() {
    let rig = Rig::named("paper", 2).unwrap();
    let (mut kept, mut whole) = (Vec::new(), Vec::new());
    for seed in 0..12 {
        let lenses = calibrated(&recorded(&rig, 12, true, 3000 + seed)).lenses();
        let moved = knocked(&rig, seed);
        let exam = random_correspondences(&moved, &chart(&rig), (80.0, 110.0), (NOISE, seed), 500);
        let known = keeping(lenses).fit_checked(&recorded(&moved, 3, true, seed), 0, &Silent);
        let error =
            |cameras: &FittedCameras<BrownConrady>| evaluate(cameras, &exam, None).unwrap().rms;
        kept.push(error(&brown(known.unwrap().reconstructor)));
        whole.push(error(&calibrated(&recorded(&moved, 12, true, 500 + seed))));
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let ratio = mean(&kept) / mean(&whole);
    assert!(ratio < 1.1, "{ratio}");
}
