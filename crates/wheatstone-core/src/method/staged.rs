//! Points before cameras, for tests of what is private here.

use super::FittedCamera;
use crate::{
    camera::{kannala_brandt::KannalaBrandt, pinhole::Pinhole, posed_lens::PosedLens},
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Pose, Vector3},
};
use wheatstone_numeric::random::Random;

/// Seven planes of points as two fisheyes see them, with normal errors of `sigma` pixels.
pub(super) fn staged(sigma: f64) -> Dataset {
    let cameras = [0.0, 1.0].map(|index| {
        let pinhole = Pinhole { focal: [260.0; 2], principal: [320.0, 240.0] };
        let model = KannalaBrandt { pinhole, coefficients: [-0.02, 0.005, -0.003, 0.0006] };
        let x = 7.0 * index - 3.5;
        let turn = Vector3::new(0.02 * index, libm::atan2(-x, 90.0), 0.05 - 0.03 * x);
        let rotation = Pose::from_rotation_vector(Vector3::zeros(), turn).inverse().rotation;
        let translation = rotation * Vector3::new(-x, index, 0.0);
        let camera_from_world = Pose { rotation, translation };
        FittedCamera::from(PosedLens { lens: model, camera_from_world })
    });
    let (mut places, mut errors) = (Random::new(1), Random::new(2));
    let row = |index: usize| {
        let depth = 50.0 + 15.0 * (index / 30) as f64;
        let [x, y] = [(); 2].map(|()| depth * places.uniform(-0.7, 0.7));
        let world = Point3::new(x, y, depth);
        let mut seen = |pixel: Pixel| pixel.map(|value| value + sigma * errors.normal());
        let pixels = cameras.each_ref().map(|camera| camera.project(world).map(&mut seen)).into();
        Correspondence { view: 0, id: None, pixels, world: Some(world), board: None }
    };
    let correspondences = (0..210).map(row).collect();
    Dataset { unit: "cm".into(), cameras: 2, views: Vec::new(), correspondences }
}
