//! Cameras that have moved after the calibration, too little to be refused.

use crate::optics::{fitted, pictures};
use wheatstone_charts::imaging::{ColourImage, GrayImage};
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::progress::Silent;
use wheatstone_reconstruction::{Reconstruction, ReconstructionSettings, SceneReconstructor};
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
