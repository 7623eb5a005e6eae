//! Camera models: where a point in front of the lens falls on the picture, and back.
//!
//! To add one: write `camera/<name>.rs` with a type that implements [`CameraModel`] and `Default`,
//! then add its `mod` line and its row below. Only `parameters_mut` and `project` are needed: the
//! rest has numerical defaults, which the contract tests also hold overrides against. A model that is
//! fitted to pixels also says its slopes, for one point and for registers of them (`trace`).

pub mod brown_conrady;
pub mod bumped_lens;
pub(crate) mod composed;
pub mod convex_mirror;
pub mod cylindrical_port;
mod distortion;
pub mod flat_port;
pub mod kannala_brandt;
pub mod pinhole;
pub(crate) mod posed_lens;
mod monotonic;
pub mod picture_domain;
pub(crate) mod normal_equations;
pub(crate) mod batch_projection;
pub(crate) mod projection;
mod sensor;
mod traced;
pub mod tsai;

use crate::{
    geometry::{Pixel, Point3, Pose, Ray, Vector3},
    registry,
};
use nalgebra::{Matrix2, Matrix2x3, Vector2};
use serde::{Deserialize, Serialize};

/// Maps the camera's own frame (x right, y down, z forward, the user's unit) to its picture and
/// back.
pub trait CameraModel: Sync + Send {
    /// The numbers a fit may change, always in the same order.
    fn parameters_mut(&mut self) -> Vec<&mut f64>;

    /// Where `point` falls; `None` where the camera cannot see it.
    fn project(&self, point: Point3) -> Option<Pixel>;

    /// Where `pixel` looks; `None` where no light reaches it.
    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        ray_by_newton(|point| self.project(point), pixel)
    }

    /// [`CameraModel::project`] with its derivatives by the point.
    fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        jacobian_by_differences(|point| self.project(point), point)
    }
}

/// A camera model that a fit may adjust: it also knows how its picture changes with its own numbers.
pub trait AdjustableCamera: CameraModel + Clone {
    /// [`CameraModel::project_with_jacobian`]; fills `slopes` with the derivatives of the pixel's x
    /// and y by the first of [`CameraModel::parameters_mut`], in their order, as many as there is room for.
    ///
    /// Unlike the projection it may go on where the lens folds the picture over, as smoothly as its
    /// formula does: a search gets past such lenses to a better one, but would stop at a wall.
    fn project_with_slopes(
        &self,
        point: Point3,
        slopes: &mut [[f64; 2]],
    ) -> Option<(Pixel, Matrix2x3<f64>)> {
        for (index, slope) in slopes.iter_mut().enumerate() {
            let moved = |by: f64| {
                let mut camera = self.clone();
                let step = camera.parameters_mut().get_mut(index).map(|value| {
                    let step = 1e-6 * (1.0 + value.abs());
                    **value += by * step;
                    step
                })?;
                Some((camera.project(point)?, step))
            };
            let ((ahead, step), (behind, _)) = (moved(1.0)?, moved(-1.0)?);
            *slope = ((ahead - behind) / (2.0 * step)).into();
        }
        self.project_with_jacobian(point)
    }
}

impl AdjustableCamera for pinhole::Pinhole {}

registry! {
    /// Every camera model the toolkit knows.
    pub enum AnyCamera: CameraModel, all {
        "pinhole" => Pinhole(pinhole::Pinhole),
        "brown-conrady" => BrownConrady(brown_conrady::BrownConrady),
        "kannala-brandt" => KannalaBrandt(kannala_brandt::KannalaBrandt),
        "tsai" => Tsai(tsai::Tsai),
        "flat-port" => FlatPort(flat_port::FlatPort),
        "cylindrical-port" => CylindricalPort(cylindrical_port::CylindricalPort),
        "convex-mirror" => ConvexMirror(convex_mirror::ConvexMirror),
        "bumped-lens" => BumpedLens(bumped_lens::BumpedLens),
    }
}

/// A camera somewhere in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PosedCamera {
    /// World to camera frame.
    pub camera_from_world: Pose,
    /// Camera frame to picture.
    pub model: AnyCamera,
    /// Picture width in pixels.
    pub width: usize,
    /// Picture height in pixels.
    pub height: usize,
}

impl PosedCamera {
    /// Where a world point falls, inside the picture or not.
    #[must_use]
    pub fn project(&self, world: Point3) -> Option<Pixel> {
        self.model.project(self.camera_from_world.transform(world))
    }

    /// [`PosedCamera::project`] with its derivatives by the world coordinates.
    #[must_use]
    pub fn project_with_jacobian(&self, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let point = self.camera_from_world.transform(world);
        let (pixel, jacobian) = self.model.project_with_jacobian(point)?;
        Some((pixel, jacobian * self.camera_from_world.rotation))
    }

    /// Where a pixel looks, in the world.
    #[must_use]
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        Some(self.model.ray(pixel)?.transformed(&self.camera_from_world.inverse()))
    }

    /// The pixel at which a world point is seen; `None` outside the picture (beyond its outermost
    /// pixel centres).
    #[must_use]
    pub fn project_visible(&self, world: Point3) -> Option<Pixel> {
        let (right, bottom) = (self.width as f64 - 1.0, self.height as f64 - 1.0);
        self.project(world).filter(|p| p.x >= 0.0 && p.y >= 0.0 && p.x <= right && p.y <= bottom)
    }

    /// The camera's centre in the world.
    #[must_use]
    pub fn centre(&self) -> Point3 {
        Point3::from(self.camera_from_world.inverse().translation)
    }
}

/// Newton's method for the point of the plane z = 1 that projects to `pixel`, by differences: the ray
/// through it from the origin.
pub(crate) fn ray_by_newton(
    project: impl Fn(Point3) -> Option<Pixel>,
    pixel: Pixel,
) -> Option<Ray> {
    const STEP: f64 = 1e-6;
    let slopes = |place: Vector2<f64>| {
        let at = |x: f64, y: f64| project(Point3::new(place.x + x, place.y + y, 1.0));
        let by = |x: f64, y: f64| Some((at(x, y)? - at(-x, -y)?) / (2.0 * STEP));
        Some(Matrix2::from_columns(&[by(STEP, 0.0)?, by(0.0, STEP)?]))
    };
    let at = |place: Vector2<f64>| project(Point3::new(place.x, place.y, 1.0));
    let place = newton(at, slopes, (Vector2::zeros(), pixel))?;
    let direction = Vector3::new(place.x, place.y, 1.0).normalize();
    Some(Ray { origin: Point3::origin(), direction })
}

/// Newton's method for the place on a plane that goes to `pixel`, from a place to begin with: where places
/// go, and the derivatives by the place.
fn newton(
    at: impl Fn(Vector2<f64>) -> Option<Pixel>,
    slopes: impl Fn(Vector2<f64>) -> Option<Matrix2<f64>>,
    (start, pixel): (Vector2<f64>, Pixel),
) -> Option<Vector2<f64>> {
    let mut place = start;
    let mut error = pixel - at(place)?;
    for _ in 0..50 {
        if error.norm() < 1e-10 {
            break;
        }
        let mut step = slopes(place)?.try_inverse()? * error;
        // Halve the step until it helps: far from the solution the lens is not linear.
        let (moved, left) = (0..30).find_map(|_| {
            let moved = place + step;
            step /= 2.0;
            let left = pixel - at(moved)?;
            (left.norm() < error.norm()).then_some((moved, left))
        })?;
        (place, error) = (moved, left);
    }
    (error.norm() < 1e-8).then_some(place)
}

/// Central differences, with steps of a millionth of the point's distance.
pub(crate) fn jacobian_by_differences(
    project: impl Fn(Point3) -> Option<Pixel>,
    point: Point3,
) -> Option<(Pixel, Matrix2x3<f64>)> {
    let step = 1e-6 * point.coords.norm().max(f64::MIN_POSITIVE);
    let mut columns = [Vector2::zeros(); 3];
    for (axis, column) in columns.iter_mut().enumerate() {
        let mut by = Vector3::zeros();
        by[axis] = step;
        *column = (project(point + by)? - project(point - by)?) / (2.0 * step);
    }
    Some((project(point)?, Matrix2x3::from_columns(&columns)))
}
