//! Cameras that have moved after the calibration, too little to be refused.

use crate::optics::{fitted, pictures};
use wheatstone_charts::imaging::{ColourImage, GrayImage};
use wheatstone_core::{
    Calibration,
    geometry::{Pixel, Pose, Vector3},
};
use wheatstone_numeric::progress::Silent;
use wheatstone_reconstruction::{
    Reconstruction, ReconstructionSettings, SceneReconstructor, TurnedCamera,
};
use wheatstone_synthetic::{Rig, Scene};

/// What a camera shows that has moved: pixels from elsewhere.
fn moved(picture: &ColourImage, from: fn(f64, f64) -> (f64, f64)) -> ColourImage {
    let gray = &picture.gray;
    let level = |x: usize, y: usize| {
        let (x, y) = from(x as f64, y as f64);
        let (x, y) =
            (x.clamp(1.0, gray.width() as f64 - 2.0), y.clamp(1.0, gray.height() as f64 - 2.0));
        gray.sample(Pixel::new(x, y))
    };
    ColourImage::from_gray(GrayImage::from_fn(gray.width(), gray.height(), level))
}

/// The rig after one of its cameras was turned about its own x, y and z, in degrees.
fn turned(rig: &Rig, camera: usize, degrees: [f64; 3]) -> Rig {
    let mut rig = rig.clone();
    let pose = &mut rig.cameras[camera].camera_from_world;
    let turn = Vector3::from(degrees.map(f64::to_radians));
    let turn = Pose::from_rotation_vector(Vector3::zeros(), turn).rotation;
    *pose = Pose { rotation: turn * pose.rotation, translation: turn * pose.translation };
    rig
}

/// What the cameras of a model make of a scene before them, as they stand now.
fn seen(model: &Calibration, rig: &Rig, sparse: bool) -> Reconstruction {
    let scene = Scene::before(rig, 1);
    let pictures = pictures(rig, &scene);
    let mut settings = ReconstructionSettings::new(vec![[640, 480]; rig.cameras.len()]);
    settings.sparse = sparse;
    let made = SceneReconstructor::new(model, settings, &Silent).unwrap();
    made.reconstruct(&pictures.iter().collect::<Vec<_>>(), &Silent).unwrap()
}

#[test]
fn of_three_cameras_the_one_that_was_turned_is_named() {
    let rig = Rig::named("paper", 3).unwrap();
    let model = fitted(&rig, "brown");
    let found = seen(&model, &rig, false);
    assert!(found.doubts(1).is_empty() && found.turned.is_none(), "{:?}", found.doubts(1));
    let cases =
        [(1, [0.0, 0.3, 0.0], false), (2, [0.3, 0.0, 0.0], true), (1, [0.0, 0.0, 0.3], true)];
    for (camera, degrees, sparse) in cases {
        let found = seen(&model, &turned(&rig, camera, degrees), sparse);
        let case = format!("camera {camera}, {degrees:?}, {sparse}: {:?}", found.turned);
        assert!(found.left_out == [camera] && found.fault.is_none(), "{case}");
        let cloud = &found.cloud;
        assert!(cloud.len() > 1000 && cloud.pixels[camera].iter().all(|at| at[0].is_nan()));
        // Rows that do not fit at all are reason enough.
        let told = found.turned.as_ref();
        let is_right =
            |told: &TurnedCamera| told.camera == camera && (told.degrees - 0.3).abs() < 0.1;
        assert!(told.is_none_or(is_right), "{case}");
        assert!(told.is_some() || found.checks.iter().any(|own| own.fault.is_some()), "{case}");
        let named = format!("camera {} is left out", camera + 1);
        assert!(found.doubts(1).iter().all(|doubt| doubt.starts_with(&named)), "{case}");
    }
    // The one that all others are matched with is blamed by nothing but itself, and never passed over.
    let found = seen(&model, &turned(&rig, 0, [0.0, 0.2, 0.0]), false);
    assert!(found.turned.as_ref().is_none_or(|told| told.camera == 0), "{:?}", found.turned);
    assert!(found.fault.is_some() || !found.doubts(1).is_empty(), "{:?}", found.left_out);
}

#[test]
fn a_single_pair_tells_of_a_camera_turned_sideways_by_its_corners() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = fitted(&rig, "brown");
    let found = seen(&model, &rig, false);
    assert!(found.sideways.is_none() && found.doubts(1).is_empty(), "{:?}", found.sideways);
    for (sparse, camera) in [(false, 1), (true, 0)] {
        let found = seen(&model, &turned(&rig, camera, [0.0, 0.3, 0.0]), sparse);
        let told = found.sideways.unwrap();
        assert!((told.degrees - 0.3).abs() < 4.0 * told.sigma && told.sigma < 0.05, "{told:?}");
        assert!((2.0..6.0).contains(&told.disparity), "{told:?}");
        let [doubt] = &found.doubts(1)[..] else { panic!("{:?}", found.doubts(1)) };
        assert!(doubt.starts_with("cameras 1 and 2: rows drift apart"), "{doubt}");
    }
}

#[test]
fn a_camera_turned_about_its_axis_is_doubted_in_dense_and_sparse_clouds() {
    let rig = Rig::named("paper", 2).unwrap();
    let model = fitted(&rig, "brown");
    let sound = pictures(&rig, &Scene::before(&rig, 1));
    // By 0.16 degrees.
    let turned = moved(&sound[1], |x, y| (x - 0.0028 * (y - 240.0), y + 0.0028 * (x - 320.0)));
    for sparse in [false, true] {
        let mut settings = ReconstructionSettings::new([[640, 480]; 2]);
        settings.sparse = sparse;
        let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
        let of = |right: &ColourImage| made.reconstruct(&[&sound[0], right], &Silent).unwrap();
        let found = of(&sound[1]);
        assert!(found.doubts(1).is_empty(), "{:?}", found.checks);
        let found = of(&turned);
        let [doubt] = &found.doubts(1)[..] else { panic!("{:?}", found.checks) };
        assert!(found.fault.is_none() && doubt.contains("higher or lower at its sides"), "{doubt}");
        assert!(doubt.starts_with("cameras 1 and 2: "), "{doubt}");
    }
}

#[test]
fn a_camera_turned_sideways_contradicts_the_others() {
    let rig = Rig::named("paper", 4).unwrap();
    let model = fitted(&rig, "brown");
    let sound = pictures(&rig, &Scene::before(&rig, 1));
    let turned = moved(&sound[1], |x, y| (x + 3.0, y));
    for sparse in [false, true] {
        let of = |cameras: &[usize], second: &ColourImage| -> Reconstruction {
            let mut settings = ReconstructionSettings::new(vec![[640, 480]; cameras.len()]);
            (settings.cameras, settings.sparse) = (cameras.to_vec(), sparse);
            let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
            let all = [&sound[0], second, &sound[2], &sound[3]];
            let given: Vec<_> = cameras.iter().map(|camera| all[*camera]).collect();
            made.reconstruct(&given, &Silent).unwrap()
        };
        let found = of(&[0, 1, 2, 3], &sound[1]);
        assert!(
            found.contradiction.is_none() && found.left_out.is_empty(),
            "{sparse}: {:?}",
            found.contradiction
        );
        let found = of(&[0, 1, 2, 3], &turned);
        let told = found.contradiction.as_ref().unwrap();
        assert!(told.left_out == Some(1) && found.left_out == [1] && told.sigmas > 5.0, "{told:?}");
        assert!(found.cloud.len() > 1000 && found.cloud.pixels[1].iter().all(|at| at[0].is_nan()));
        assert!(found.doubts(1)[0].starts_with("camera 2 is left out"), "{:?}", found.doubts(1));
        // Of three cameras nobody knows which.
        let found = of(&[0, 1, 2], &turned);
        let told = found.contradiction.as_ref().unwrap();
        assert!(told.left_out.is_none() && told.cameras == [1, 2], "{told:?}");
    }
}
