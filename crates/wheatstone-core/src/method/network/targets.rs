//! What the network's three outputs mean.

use crate::{
    dataset::Dataset,
    geometry::{Point3, Pose, ProjectionMatrix, Vector3},
};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Three numbers for a point, and back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "are", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Targets {
    /// X, Y and Z, as in the paper.
    World {},
    /// `x / z`, `y / z` and `1 / z` in a frame that sits at the cameras and looks where they look. Of older files.
    InverseDepth {
        /// World to that frame.
        frame_from_world: Pose,
    },
    /// The direction in stereographic projection, `2 x / (r + z)` and `2 y / (r + z)`, and `1 / r`, where `r` is the
    /// distance, in that frame. Pixel noise makes these uncertain alike wherever the point is, out to directions
    /// aside, and they are nearly linear in the pixels of any optics.
    InverseDistance {
        /// World to that frame.
        frame_from_world: Pose,
    },
}

/// The nearest point's depth in the frame as a share of the median depth, at least: nearer than that
/// inverse distances grow out of proportion, and the frame is moved back.
const NEAREST: f64 = 0.2;

impl Targets {
    /// The frame in which the cameras stand, from what each saw: centres and axes follow in closed
    /// form by the direct linear transformation, wherever the world's origin is. Where the points do
    /// not determine the cameras, the frame stands off the points along their shortest axis.
    pub(super) fn from_cameras(train: &Dataset) -> Self {
        let matched = train.known().filter(|(_, row)| row.seen_by() >= 2);
        let points: Vec<Point3> = matched.map(|(world, _)| world).collect();
        let cameras: Vec<ProjectionMatrix> = (0..train.cameras)
            .filter_map(|camera| ProjectionMatrix::fit(&train.seen_by_camera(camera)))
            .collect();
        let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len().max(1) as f64;
        let centres: Vec<Vector3> =
            cameras.iter().filter_map(|camera| Some(camera.centre()?.coords)).collect();
        let mut centre = centres.iter().sum::<Vector3>() / centres.len().max(1) as f64;
        let size = (points.iter().map(|p| (p.coords - middle).norm_squared()).sum::<f64>()
            / points.len().max(1) as f64)
            .sqrt();
        if centres.is_empty() || (middle - centre).norm() < 1e-3 * size {
            centre = middle - Vector3::z() * (5.0 * size);
        }
        let forward = (middle - centre).normalize();
        let aside = if forward.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let down = forward.cross(&aside).normalize();
        let right = down.cross(&forward);
        let rotation =
            Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let depths: Vec<f64> = points.iter().map(|p| (p.coords - centre).dot(&forward)).collect();
        let median = wheatstone_numeric::statistics::median(&depths);
        let nearest = depths.iter().copied().fold(f64::INFINITY, f64::min);
        // Depths grow by as much as the frame is moved back.
        let back = ((NEAREST * median - nearest) / (1.0 - NEAREST)).max(0.0);
        let centre = centre - forward * back;
        let translation = -(rotation * centre);
        Self::InverseDistance { frame_from_world: Pose { rotation, translation } }
    }

    /// The targets of a point.
    pub(super) fn of(&self, point: Point3) -> [f64; 3] {
        match self {
            Self::World {} => [point.x, point.y, point.z],
            Self::InverseDepth { frame_from_world } => {
                let p = frame_from_world.transform(point);
                [p.x / p.z, p.y / p.z, 1.0 / p.z]
            }
            Self::InverseDistance { frame_from_world } => {
                let p = frame_from_world.transform(point);
                let distance = p.coords.norm();
                let by = 2.0 / (distance + p.z);
                [p.x * by, p.y * by, 1.0 / distance]
            }
        }
    }

    /// The point that has these targets, and its derivatives by them; `None` for a point at
    /// infinity or behind the cameras.
    pub(super) fn point(&self, [a, b, c]: [f64; 3]) -> Option<(Point3, Matrix3<f64>)> {
        match self {
            Self::World {} => Some((Point3::new(a, b, c), Matrix3::identity())),
            Self::InverseDepth { frame_from_world } => {
                if !(c > 0.0 && c.is_finite()) {
                    return None;
                }
                let depth = 1.0 / c;
                let world_from_frame = frame_from_world.inverse();
                let point = Point3::new(a * depth, b * depth, depth);
                let by_inverse = -point.coords * depth;
                let mut jacobian = Matrix3::from_diagonal_element(depth);
                jacobian.set_column(2, &by_inverse);
                Some((world_from_frame.transform(point), world_from_frame.rotation * jacobian))
            }
            Self::InverseDistance { frame_from_world } => {
                if !(c > 0.0 && c.is_finite()) {
                    return None;
                }
                let (distance, square) = (1.0 / c, 0.25 * (a * a + b * b));
                let direction = Vector3::new(a, b, 1.0 - square) / (1.0 + square);
                let across = distance / (1.0 + square);
                let by = |axis: usize, value: f64| {
                    (Vector3::ith(axis, 1.0) - (direction + Vector3::z()) * (0.5 * value)) * across
                };
                let along = -direction * (distance * distance);
                let jacobian = Matrix3::from_columns(&[by(0, a), by(1, b), along]);
                let world_from_frame = frame_from_world.inverse();
                let point = Point3::from(direction * distance);
                Some((world_from_frame.transform(point), world_from_frame.rotation * jacobian))
            }
        }
    }

    pub(super) fn is_consistent(&self) -> bool {
        match self {
            Self::World {} => true,
            Self::InverseDepth { frame_from_world: pose }
            | Self::InverseDistance { frame_from_world: pose } => {
                let gap = pose.rotation * pose.rotation.transpose() - Matrix3::identity();
                gap.norm() < 1e-6 && pose.translation.iter().all(|value| value.is_finite())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_with_their_derivatives() {
        let frame_from_world =
            Pose::from_rotation_vector(Vector3::new(3.0, -2.0, 80.0), Vector3::new(0.1, 0.2, -0.3));
        let world = Point3::new(5.0, -7.0, 30.0);
        for targets in [
            Targets::InverseDepth { frame_from_world },
            Targets::InverseDistance { frame_from_world },
        ] {
            let of = targets.of(world);
            let (back, jacobian) = targets.point(of).unwrap();
            assert!((back - world).norm() < 1e-12);
            for axis in 0..3 {
                let step = 1e-6 * of[axis].abs();
                let at = |by: f64| {
                    let mut moved = of;
                    moved[axis] += by;
                    targets.point(moved).unwrap().0
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                let gap = (difference - jacobian.column(axis)).norm();
                assert!(gap < 1e-5 * jacobian.column(axis).norm(), "{axis}: {gap}");
            }
            assert!(targets.point([0.1, 0.1, -1.0]).is_none());
        }
    }

    /// A fisheye sees more than half a sphere.
    #[test]
    fn directions_beside_the_frame_have_targets() {
        let targets = Targets::InverseDistance {
            frame_from_world: Pose::from_rotation_vector(Vector3::zeros(), Vector3::zeros()),
        };
        let world = Point3::new(40.0, -10.0, -15.0);
        assert!((targets.point(targets.of(world)).unwrap().0 - world).norm() < 1e-12);
    }
}
