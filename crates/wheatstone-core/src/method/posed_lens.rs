//! A lens at a pose, on its way to the best fit.

use crate::geometry::Vector3;
use nalgebra::Matrix3;

/// Three unknowns of rotation, three of translation: the first of every camera, before its model's.
pub(super) const POSE: usize = 6;

/// Room for the unknowns of the camera with most of them.
pub(super) const MOST_UNKNOWNS: usize = 32;

/// A camera on its way to the best fit; its rotation has determinant -1 if it is mirrored.
#[derive(Clone, Debug)]
pub(super) struct Placed<L> {
    pub(super) model: L,
    pub(super) rotation: Matrix3<f64>,
    pub(super) translation: Vector3,
}
