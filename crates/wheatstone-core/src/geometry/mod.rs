//! Points, pixels, rays and poses; projection matrices, homographies and triangulation. No images,
//! no charts: pure geometry.

mod homography;
pub(crate) mod batch_triangulation;
mod pixel_columns;
mod planar_pose;
mod pose;
mod projection;
mod principal_axes;
pub(crate) mod stage_covariance;
pub mod triangulation;
mod two_fold_pose;

pub use homography::Homography;
pub use pixel_columns::{PixelColumns, columns_of};
pub(crate) use planar_pose::{LEAST_ON_PLANE, planar_pose};
pub use pose::Pose;
pub(crate) use principal_axes::{axes_of, principal_axes};
pub use projection::ProjectionMatrix;
pub use stage_covariance::StageCovariance;
pub use two_fold_pose::other_tilt;

/// A place in an image, `[x, y]` in pixels: x to the right, y down, `(0, 0)` the **centre** of the
/// top-left pixel.
pub type Pixel = nalgebra::Point2<f64>;

/// A point in world or camera coordinates, in the user's own unit. A camera's own frame has x
/// right, y down, z forward.
pub type Point3 = nalgebra::Point3<f64>;

/// A direction or a difference of points, in the user's own unit.
pub type Vector3 = nalgebra::Vector3<f64>;

/// Where a pixel looks: a half line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Point3,
    /// Unit vector along which it goes.
    pub direction: Vector3,
}

impl Ray {
    /// The same ray in another frame.
    #[must_use]
    pub fn transformed(self, to_from_own: &Pose) -> Self {
        Self {
            origin: to_from_own.transform(self.origin),
            direction: to_from_own.rotation * self.direction,
        }
    }

    /// The point at `distance` along the ray.
    #[must_use]
    pub fn at(self, distance: f64) -> Point3 {
        self.origin + self.direction * distance
    }
}
