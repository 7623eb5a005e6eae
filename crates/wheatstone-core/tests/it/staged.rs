//! Planes of points before cameras of any lens.

use wheatstone_core::{
    camera::CameraModel,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3, Pose, Vector3},
    method::FittedCamera,
};
use wheatstone_numeric::random::Random;

/// Cameras beside each other that look at the middle of what lies 40 to 140 before them.
pub(crate) fn rig<L: CameraModel>(models: Vec<L>) -> Vec<FittedCamera<L>> {
    let placed = |(index, model): (usize, L)| {
        let x = 7.0 * index as f64 - 3.5;
        let turn = Vector3::new(0.02 * index as f64, libm::atan2(-x, 90.0), 0.05 - 0.03 * x);
        let rotation = Pose::from_rotation_vector(Vector3::zeros(), turn).inverse().rotation;
        let translation = rotation * Vector3::new(-x, index as f64, 0.0);
        let camera_from_world = Pose { rotation, translation };
        FittedCamera { model, camera_from_world, mirrored: false }
    };
    models.into_iter().enumerate().map(placed).collect()
}

/// Seven planes of points as the cameras see them, `spread` wide at unit distance, with normal
/// errors of `sigma` pixels; world coordinates are those of `world`.
pub(crate) fn staged<L: CameraModel>(
    cameras: &[FittedCamera<L>],
    spread: f64,
    (sigma, seed): (f64, u64),
    world: impl Fn(Point3) -> Point3,
) -> Dataset {
    let mut random = Random::new(seed);
    let mut place = |depth: f64| {
        let mut sideways = || depth * random.uniform(-spread, spread);
        Point3::new(sideways(), sideways(), depth)
    };
    let points: Vec<Point3> =
        (0..210).map(|index| place(50.0 + 15.0 * f64::from(index / 30))).collect();
    let mut random = Random::new(seed + 1);
    let mut noisy = |pixel: Pixel| {
        Pixel::new(pixel.x + sigma * random.normal(), pixel.y + sigma * random.normal())
    };
    let row = |point: Point3| Correspondence {
        view: 0,
        id: None,
        pixels: cameras.iter().map(|camera| camera.project(point).map(&mut noisy)).collect(),
        world: Some(world(point)),
        board: None,
    };
    let correspondences = points.into_iter().map(row).collect();
    Dataset { unit: "cm".into(), cameras: cameras.len(), views: Vec::new(), correspondences }
}
