//! A lens at a pose, on its way to the best fit.

use crate::geometry::Pose;

/// Three unknowns of rotation, three of translation: the first of every camera, before its lens's.
pub(crate) const POSE: usize = 6;

/// Room for the unknowns of the camera with most of them.
pub(crate) const MOST_UNKNOWNS: usize = 32;

/// A lens somewhere in the world. The rotation has determinant -1 where the camera sees in a mirror, or the
/// world's axes are left-handed.
#[derive(Clone, Debug)]
pub(crate) struct PosedLens<L> {
    pub(crate) lens: L,
    pub(crate) camera_from_world: Pose,
}
