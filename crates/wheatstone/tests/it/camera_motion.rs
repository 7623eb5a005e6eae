//! Whether cameras moved since their calibration: which one, by how much, how sure, and what cannot be seen.

use crate::hand_held::{chart, waved};
use wheatstone::{
    Calibration, Error,
    dataset::Dataset,
    evaluate::camera_motion::{CameraMotion, Change, Known},
    geometry::{Pose, Vector3},
    method::{AnyMethod, AnyReconstructor, Reconstructor},
    numeric::{progress::Silent, random::Random, statistics::percentile},
    preparation::Prepared,
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

const NOISE: Noise = Noise::Normal(0.1);

fn staged(rig: &Rig, stage: Stage, seed: u64) -> Dataset {
    chart_correspondences(rig, &chart(rig), &stage.views().unwrap(), (NOISE, seed), None)
}

/// Three placements of the chart, another day.
fn again(rig: &Rig, seed: u64) -> Dataset {
    staged(rig, Stage { near: 60.0, far: 120.0, step: 30.0 }, seed)
}

/// Matched pixels of which nothing else is known.
fn matches(rig: &Rig, count: usize, seed: u64) -> Dataset {
    let mut data = random_correspondences(rig, &chart(rig), (60.0, 130.0), (NOISE, seed), count);
    data.correspondences.iter_mut().for_each(|row| row.world = None);
    data
}

fn calibrated(data: &Dataset, method: &str) -> Calibration {
    let ready = Prepared::as_given(data.clone());
    Calibration::fit(&AnyMethod::named(method).unwrap(), &ready, 0, false, &Silent).unwrap()
}

/// The rig after a camera turned by degrees about its own axes and was shifted by centimetres along them.
fn knocked(rig: &Rig, camera: usize, turn: [f64; 3], shift: [f64; 3]) -> Rig {
    let mut rig = rig.clone();
    let turn = Vector3::from(turn.map(f64::to_radians));
    let moved = Pose::from_rotation_vector(shift.into(), turn).inverse();
    let pose = &mut rig.cameras[camera].camera_from_world;
    *pose = moved.after(pose);
    rig
}

fn found(model: &Calibration, data: &Dataset) -> CameraMotion {
    model.camera_motion(data, &Silent).unwrap()
}

/// A hundredth of all cameras that did not move have a chance below one hundredth, and so on.
#[test]
fn chance_is_what_it_says_where_nothing_moved() {
    for (name, method) in [("paper", "brown"), ("bump", "neural-camera")] {
        let rig = Rig::named(name, 2).unwrap();
        let mut chances = Vec::new();
        for calibration in 0..5 {
            let model = calibrated(&staged(&rig, Stage::default(), calibration), method);
            for session in 0..10 {
                let seed = 100 + 10 * calibration + session;
                chances.push(found(&model, &again(&rig, seed)).chance);
                chances.push(found(&model, &matches(&rig, 100, 1000 + seed)).chance);
            }
        }
        let share = |below: f64| chances.iter().filter(|chance| **chance < below).count();
        assert!((35..65).contains(&share(0.5)), "{name}: {}", share(0.5));
        assert!((4..18).contains(&share(0.1)), "{name}: {}", share(0.1));
        assert_eq!(share(5e-4), 0, "{name}");
    }
}

/// Half a millimetre, or a twentieth of a degree, about any axis, of any camera, is told from noise and from the other
/// cameras, with error bars that hold.
#[test]
fn a_small_knock_is_named_and_measured() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let mut random = Random::new(7);
    let (mut squares, mut count) = (0.0, 0);
    for draw in 0..40 {
        let axis = Vector3::new(random.normal(), random.normal(), random.normal()).normalize();
        let camera = draw % 2;
        let is_turn = draw % 4 < 2;
        let knock = axis * 0.05;
        let (turn, shift) =
            if is_turn { (knock, Vector3::zeros()) } else { (Vector3::zeros(), knock) };
        let moved = knocked(&rig, camera, turn.into(), shift.into());
        let found = found(&model, &again(&moved, 500 + draw as u64));
        assert_eq!(found.known, Known::Places);
        assert!(found.chance < 1e-6 && found.chance_of_rest > 1e-4, "{draw}: {found:#?}");
        let [change] = &found.changes[..] else { panic!("{draw}: {found:#?}") };
        assert_eq!(change.cameras, [camera], "{draw}: {change:#?}");
        if change.change == (if is_turn { Change::Turn } else { Change::Shift }) {
            let (of, sigma) = if is_turn {
                (change.turn, change.turn_sigma)
            } else {
                (change.shift, change.shift_sigma)
            };
            for axis in 0..3 {
                squares += ((of[axis] - knock[axis]) / sigma[axis]).powi(2);
                count += 1;
            }
        }
    }
    assert!(count >= 3 * 36, "{count}");
    let mean = squares / f64::from(count);
    assert!((0.6..1.6).contains(&mean), "{mean}");
}

/// A roll is about the optical axis wherever in the pictures the points are.
#[test]
fn turns_are_about_the_cameras_own_axes_where_points_fill_a_corner() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let all = again(&knocked(&rig, 1, [0.0, 0.0, 0.3], [0.0; 3]), 2);
    let middle = |axis: usize| {
        let pixels = all.correspondences.iter().filter_map(|row| row.pixels[1]);
        percentile(&pixels.map(|pixel| pixel[axis]).collect::<Vec<_>>(), 0.5)
    };
    let (x, y) = (middle(0), middle(1));
    let corner = all.subset(|_, row| row.pixels[1].is_some_and(|pixel| pixel.x > x && pixel.y > y));
    let found = found(&model, &corner);
    let [change] = &found.changes[..] else { panic!("{found:#?}") };
    assert_eq!((&change.cameras[..], change.change), (&[1][..], Change::Turn));
    for (axis, truth) in [0.0, 0.0, 0.3].into_iter().enumerate() {
        let off = (change.turn[axis] - truth).abs();
        assert!(off < 4.0 * change.turn_sigma[axis] && off < 0.02, "{change:#?}");
    }
}

/// A large knock, and two cameras at once.
#[test]
fn a_large_knock_and_two_knocks_are_named() {
    let rig = Rig::named("paper", 3).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let once = knocked(&rig, 1, [1.0, -1.5, 0.5], [0.2, 0.1, -0.3]);
    let large = found(&model, &again(&once, 2));
    let [change] = &large.changes[..] else { panic!("{large:#?}") };
    assert_eq!((&change.cameras[..], change.change), (&[1][..], Change::TurnAndShift));
    for (of, truth) in change.turn.iter().zip([1.0, -1.5, 0.5]) {
        // A rotation vector is not the three turns one after the other, but here as good as.
        assert!((of - truth).abs() < 0.02, "{change:#?}");
    }
    let twice = knocked(&once, 2, [0.0, 0.1, 0.0], [0.0; 3]);
    let two = found(&model, &again(&twice, 3));
    let mut cameras: Vec<usize> = two.changes.iter().map(|change| change.cameras[0]).collect();
    cameras.sort_unstable();
    assert_eq!(cameras, [1, 2], "{two:#?}");
}

/// Places in another frame are no motion of one camera.
#[test]
fn a_chart_at_another_place_is_told_from_a_moved_camera() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let mut data = again(&rig, 2);
    let elsewhere =
        Pose::from_rotation_vector(Vector3::new(0.3, -0.2, 0.1), Vector3::new(0.0, 0.002, 0.0));
    for row in &mut data.correspondences {
        row.world = row.world.map(|world| elsewhere.transform(world));
    }
    let told = found(&model, &data);
    let [change] = &told.changes[..] else { panic!("{told:#?}") };
    assert!(change.together, "{told:#?}");
    assert_eq!(change.cameras, [0, 1]);
}

/// A lens that was refocused is not a camera that moved.
#[test]
fn another_focal_length_is_named() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let mut data = again(&rig, 2);
    for row in &mut data.correspondences {
        for pixel in row.pixels[1].iter_mut() {
            let middle = wheatstone::Pixel::new(320.0, 240.0);
            *pixel = middle + (*pixel - middle) * 1.002;
        }
    }
    let told = found(&model, &data);
    let [change] = &told.changes[..] else { panic!("{told:#?}") };
    assert_eq!((&change.cameras[..], change.change), (&[1][..], Change::FocalLength), "{told:#?}");
    assert!((change.focal_length - 0.002).abs() < 2e-4, "{told:#?}");
}

/// Three hundred matches show pitch and roll of a twentieth of a degree, of two cameras against each other, and say that yaw
/// cannot be seen so. Gross mismatches change nothing.
#[test]
fn matches_show_pitch_and_roll_but_not_yaw() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    for turn in [[0.05, 0.0, 0.0], [0.0, 0.0, 0.05]] {
        let mut data = matches(&knocked(&rig, 1, turn, [0.0; 3]), 300, 2);
        for row in data.correspondences.iter_mut().step_by(20) {
            row.pixels[0] = row.pixels[0].map(|pixel| pixel + nalgebra::Vector2::new(4.0, 9.0));
        }
        let told = found(&model, &data);
        assert_eq!((told.known, told.left_out), (Known::Matches, 30));
        assert!(told.chance < 1e-4, "{told:#?}");
        assert!(told.changes[0].cameras.contains(&1), "{told:#?}");
    }
    let still = found(&model, &matches(&rig, 300, 3));
    assert!(still.changes.is_empty(), "{still:#?}");
    for least in still.noticeable {
        let [pitch, yaw, roll] = least.turn;
        assert!(pitch < 0.05 && roll < 0.05 && yaw > 10.0 * pitch, "{pitch} {yaw} {roll}");
    }
}

/// Of three cameras matches tell which one moved, and so does a board in the hand.
#[test]
fn of_three_cameras_the_one_that_moved_is_named_without_known_places() {
    let rig = Rig::named("paper", 3).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let moved = knocked(&rig, 2, [0.04, 0.03, 0.0], [0.0; 3]);
    for (data, known) in
        [(matches(&moved, 300, 2), Known::Matches), (waved(&moved, 6, NOISE, 2).0, Known::Boards)]
    {
        let told = found(&model, &data);
        let [change] = &told.changes[..] else { panic!("{told:#?}") };
        assert_eq!((told.known, &change.cameras[..]), (known, &[2][..]), "{told:#?}");
    }
}

/// The covariance that a map says of a pixel is that of the errors of its fit.
#[test]
fn errors_of_a_fit_have_the_covariance_of_its_pixels() {
    let rig = Rig::named("bump", 2).unwrap();
    let data = staged(&rig, Stage::default(), 1);
    let model = calibrated(&data, "neural-camera");
    let AnyReconstructor::NeuralCamera(cameras) = &model.reconstructor else { panic!() };
    let errors = cameras.fit_errors().unwrap();
    for (world, _) in data.known().step_by(37) {
        for camera in 0..2 {
            let (_, covariance) = cameras.predict(camera, world).unwrap();
            let displaced = (errors.displacements)(camera, world).unwrap();
            assert_eq!(displaced.len(), errors.count);
            let own: nalgebra::Matrix2<f64> = displaced.iter().map(|by| by * by.transpose()).sum();
            let noise = nalgebra::Matrix2::identity() * cameras.pixel_sigma()[camera].powi(2);
            assert!((own + noise - covariance).norm() < 1e-9 * covariance.norm());
        }
    }
}

/// Networks are no cameras; neural cameras fitted to the same points stand in.
#[test]
fn models_that_are_no_cameras_are_stood_in_for() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "dlt");
    let moved = knocked(&rig, 0, [0.0, 0.0, 0.1], [0.0; 3]);
    assert!(found(&model, &again(&rig, 2)).changes.is_empty());
    assert_eq!(found(&model, &again(&moved, 2)).changes[0].cameras, [0]);
}

#[test]
fn too_little_is_refused() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = calibrated(&staged(&rig, Stage::default(), 1), "brown");
    let few = model.camera_motion(&matches(&rig, 10, 2), &Silent);
    assert!(matches!(few, Err(Error::Degenerate { .. })), "{few:?}");
    // Rows that pair one point's pixel with another's.
    let mut paired = matches(&rig, 300, 2);
    let first = paired.correspondences[0].pixels[1];
    for row in 1..300 {
        paired.correspondences[row - 1].pixels[1] = paired.correspondences[row].pixels[1];
    }
    paired.correspondences[299].pixels[1] = first;
    let told = model.camera_motion(&paired, &Silent).unwrap_err().to_string();
    assert!(told.contains("reprojection errors of"), "{told}");
    let three = Rig::named("paper", 3).unwrap();
    let other = model.camera_motion(&again(&three, 2), &Silent);
    assert!(matches!(other, Err(Error::Mismatch { .. })), "{other:?}");
}
