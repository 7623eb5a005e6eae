//! What a fit leaves uncertain of cameras, as errors that have nothing to do with each other.

use crate::geometry::Point3;
use nalgebra::Vector2;

/// Errors of a fit that move the pixels of all its cameras: independent of each other, each with mean 0 and standard
/// deviation 1. So pixels of two points, of one camera or of two, have the covariance that is the sum of the products
/// of their displacements.
pub struct FitErrors<'a> {
    /// How many there are.
    pub count: usize,
    /// By how much each of them displaces a camera's pixel of a world point, in pixels; `None` where the camera does
    /// not see the point.
    pub displacements: Displacements<'a>,
}

/// Of a camera, counted from 0, and a world point.
pub(super) type Displacements<'a> =
    Box<dyn Fn(usize, Point3) -> Option<Vec<Vector2<f64>>> + Sync + 'a>;
