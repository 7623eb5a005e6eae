//! Cameras before curved glass, or that look into a curved mirror: their rays are followed surface by surface.
//!
//! No formula leads from a point to its pixel, so the direction in air is sought whose ray passes through the point.

use crate::geometry::{Point3, Ray, Vector3};
use nalgebra::{Matrix3x2, Vector2};

/// The direction in air, from the origin, whose ray beyond a surface passes through `point`; `start` is where to begin.
/// `None` where there is none.
pub(super) fn direction_towards(
    trace: impl Fn(Vector3) -> Option<Ray>,
    (point, start): (Point3, Vector3),
) -> Option<Vector3> {
    const STEP: f64 = 1e-6;
    // Two directions across the first one: there the search goes on in a plane.
    let forward = start.normalize();
    let across = forward.cross(&Vector3::ith(forward.iamin(), 1.0)).normalize();
    let down = forward.cross(&across);
    let direction = |at: Vector2<f64>| (forward + across * at.x + down * at.y).normalize();
    // By how much a ray misses the point, as a share of the way to it.
    let missed = |at: Vector2<f64>| {
        let ray = trace(direction(at))?;
        let to_point = point - ray.origin;
        let along = to_point.dot(&ray.direction);
        (along > 0.0).then(|| (to_point - ray.direction * along) / to_point.norm())
    };
    let mut at = Vector2::zeros();
    let mut error = missed(at)?;
    for _ in 0..50 {
        if error.norm() < 1e-15 {
            break;
        }
        let slope = |by: Vector2<f64>| Some((missed(at + by)? - missed(at - by)?) / (2.0 * STEP));
        let columns = [slope(Vector2::new(STEP, 0.0))?, slope(Vector2::new(0.0, STEP))?];
        let slopes = Matrix3x2::from_columns(&columns);
        let normal = slopes.transpose() * slopes;
        let mut step = -(normal.try_inverse()? * (slopes.transpose() * error));
        let better = (0..30).find_map(|_| {
            let moved = at + step;
            step /= 2.0;
            let left = missed(moved)?;
            (left.norm() < error.norm()).then_some((moved, left))
        });
        // As near as rounding lets it be.
        let Some(better) = better else { break };
        (at, error) = better;
    }
    (error.norm() < 1e-10).then(|| direction(at))
}
