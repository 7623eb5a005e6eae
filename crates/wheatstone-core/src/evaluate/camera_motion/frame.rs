//! Where a camera of a map stands and how it is turned, from where its pixels look.

use crate::{
    geometry::{Pixel, Pose, Ray, Vector3, triangulation},
    method::Reconstructor,
};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// A camera's own frame: x right, y down, z forward, as its pictures show it.
pub(super) struct CameraFrame {
    pub(super) camera_from_world: Pose,
    /// The middle of its pixels: about it a change of the focal length moves nothing.
    pub(super) middle: Pixel,
}

impl CameraFrame {
    /// By the rays of some pixels, and the optical axis in the world, instead of which the middle of the pixels serves where
    /// it is not known; `None` where they do not come from one place.
    pub(super) fn of(
        map: &dyn Reconstructor,
        (camera, axis): (usize, Option<Vector3>),
        pixels: &[Pixel],
    ) -> Option<Self> {
        /// As many rays tell the centre.
        const RAYS: usize = 60;
        let stride = pixels.len().div_ceil(RAYS).max(1);
        let some = || pixels.iter().step_by(stride);
        let rays: Vec<Ray> = some().filter_map(|pixel| map.unproject(camera, *pixel)).collect();
        let centre = triangulation::nearest(rays.into_iter(), 0.0)?;
        let sum: Vector2<f64> = some().map(|pixel| pixel.coords).sum();
        let middle = Pixel::from(sum / some().count() as f64);
        let look = |pixel: Pixel| Some(map.unproject(camera, pixel)?.direction);
        let principal = axis.and_then(|axis| pixel_along(&look, axis, middle)).unwrap_or(middle);
        let towards = |x: f64| look(principal + Vector2::new(x, 0.0));
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

/// The pixel that looks along an axis, a unit vector in the world: Newton's method on the plane at unit depth.
fn pixel_along(
    look: &impl Fn(Pixel) -> Option<Vector3>,
    axis: Vector3,
    start: Pixel,
) -> Option<Pixel> {
    /// A few are enough for lenses that bend little; others leave it at that.
    const STEPS: usize = 30;
    /// Pixels: no camera's axis is known so well.
    const NEAR: f64 = 1e-3;
    let across = axis.cross(&if axis.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() });
    let (first, second) = (across.normalize(), axis.cross(&across).normalize());
    let place = |pixel: Pixel| -> Option<Vector2<f64>> {
        let direction = look(pixel)?;
        let depth = direction.dot(&axis);
        (depth > 0.0).then(|| Vector2::new(first.dot(&direction), second.dot(&direction)) / depth)
    };
    let mut pixel = start;
    for _ in 0..STEPS {
        let slope = |by: Vector2<f64>| Some((place(pixel + by)? - place(pixel - by)?) / 2.0);
        let slopes = Matrix2::from_columns(&[slope(Vector2::x())?, slope(Vector2::y())?]);
        let step = slopes.try_inverse()? * place(pixel)?;
        pixel -= step;
        if step.norm() < NEAR {
            return Some(pixel);
        }
    }
    None
}
