//! Where a camera of a map stands and how it is turned, from where its pixels look.

use crate::{
    geometry::{Pixel, Pose, Ray, Vector3, triangulation},
    method::Reconstructor,
};
use nalgebra::{Matrix3, Vector2};

/// A camera's own frame: x right, y down, z forward, as its pictures show it.
pub(super) struct CameraFrame {
    pub(super) camera_from_world: Pose,
    /// The middle of its pixels: about it a change of the focal length moves nothing.
    pub(super) middle: Pixel,
}

impl CameraFrame {
    /// By the rays of some pixels; `None` where they do not come from one place.
    pub(super) fn of(map: &dyn Reconstructor, camera: usize, pixels: &[Pixel]) -> Option<Self> {
        /// As many rays tell the centre.
        const RAYS: usize = 60;
        let stride = pixels.len().div_ceil(RAYS).max(1);
        let some = || pixels.iter().step_by(stride);
        let rays: Vec<Ray> = some().filter_map(|pixel| map.unproject(camera, *pixel)).collect();
        let centre = triangulation::nearest(rays.into_iter(), 0.0)?;
        let sum: Vector2<f64> = some().map(|pixel| pixel.coords).sum();
        let middle = Pixel::from(sum / some().count() as f64);
        let towards = |x: f64| -> Option<Vector3> {
            Some(map.unproject(camera, middle + Vector2::new(x, 0.0))?.direction)
        };
        let forward = towards(0.0)?;
        let along = towards(1.0)? - towards(-1.0)?;
        let right = (along - forward * forward.dot(&along)).try_normalize(0.0)?;
        let down = forward.cross(&right);
        let rotation =
            Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let translation = -(rotation * centre.coords);
        let is_finite = rotation.iter().chain(&translation).all(|value| value.is_finite());
        is_finite.then_some(Self { camera_from_world: Pose { rotation, translation }, middle })
    }
}
