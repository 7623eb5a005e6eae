//! Intrinsic numbers of cameras whose lens is not one of the camera models.

use crate::geometry::{Point3, Vector3};

/// Intrinsic numbers of such a camera, and where it stands.
pub(super) struct LensNumbers<const N: usize> {
    pub(super) names: [&'static str; N],
    /// Focal lengths, principal point, then what else there is.
    pub(super) values: [f64; N],
    pub(super) covariance: [[f64; N]; N],
    /// The projection centre and the optical axis in the world.
    pub(super) centre: Point3,
    pub(super) axis: Vector3,
}
