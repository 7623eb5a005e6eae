//! What a fit leaves uncertain of where a camera stands and looks.

use crate::geometry::Vector3;

/// What one independent error of a fit (mean 0, standard deviation 1) does to a camera.
#[derive(Clone, Copy)]
pub(super) struct PoseError {
    /// To its projection centre, in the world.
    pub(super) centre: Vector3,
    /// To its optical axis, a unit vector in the world.
    pub(super) axis: Vector3,
}
