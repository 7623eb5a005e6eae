//! Charts held by hand that one camera sees the other way round from the other.

use crate::hand_held::{NOISE, solve, waved, worst_place};
use std::f64::consts::PI;
use wheatstone::{
    dataset::Dataset,
    fit::bundle::BundleSettings,
    geometry::{Pixel, Pose, Vector3},
    numeric::progress::Silent,
    preparation,
    synthetic::Rig,
};

/// As a mirror before the camera would, but for the place that it shows. Pictures have 480 rows.
fn turn_up_y(data: &mut Dataset, camera: usize) {
    for row in &mut data.correspondences {
        row.pixels[camera] = row.pixels[camera].map(|p| Pixel::new(p.x, 479.0 - p.y));
    }
}

#[test]
fn a_camera_before_a_mirror_or_with_y_up_places_charts_as_well() {
    let rig = Rig::named("paper", 2).unwrap();
    let (sound, places) = waved(&rig, 12, NOISE, 6);
    let direct = worst_place(&solve(&sound), places.iter().copied());
    for camera in 0..2 {
        let mut mirrored = sound.clone();
        turn_up_y(&mut mirrored, camera);
        let worst = worst_place(&solve(&mirrored), places.iter().copied());
        assert!((worst / direct - 1.0).abs() < 0.01, "{worst:.4} cm, direct {direct:.4} cm");
    }
}

#[test]
fn cameras_on_both_sides_of_a_transparent_chart_are_no_mirrors() {
    let mut rig = Rig::named("paper", 2).unwrap();
    // About the upright axis 95 cm away, where charts are held.
    let turn =
        Pose::from_rotation_vector(Vector3::new(0.0, PI, 0.0), Vector3::new(0.0, 0.0, 190.0));
    let opposite = &mut rig.cameras[1].camera_from_world;
    *opposite = opposite.after(&turn);
    let (data, places) = waved(&rig, 12, NOISE, 7);
    let worst = worst_place(&solve(&data), places);
    assert!(worst < 0.3, "a point is {worst:.3} cm off");
}

#[test]
fn a_camera_with_y_up_in_all_pictures_of_boards_in_the_hand_is_named() {
    let rig = Rig::named("paper", 2).unwrap();
    for camera in 0..2 {
        let mut data = waved(&rig, 10, NOISE, 3).0;
        turn_up_y(&mut data, camera);
        let found = preparation::examine(&data, BundleSettings::default(), &Silent).unwrap();
        let [finding] = &*found.findings else { panic!("{:?}", found.findings) };
        assert_eq!((finding.code, &*finding.cameras), ("v-axis-up", &[camera][..]));
    }
}
