//! The two poses in which a camera sees a flat chart alike, if it is small or far or nearly fronto-parallel: the tilt and
//! its mirror image about the line of sight.
//!
//! Sources: Schweighofer & Pinz 2006 (doi:10.1109/TPAMI.2006.252); Collins & Bartoli 2014
//! (doi:10.1007/s11263-014-0725-5).

use super::Vector3;
use nalgebra::Matrix3;

/// The rotation about a chart's middle, in the frame of `normal`, that takes its tilt to the other one. It turns the
/// chart by twice the angle between the normal and the `sight`, both of any length.
#[must_use]
pub fn other_tilt(sight: Vector3, normal: Vector3) -> Matrix3<f64> {
    // Depths along the line of sight change their sign. That mirrors the chart; mirrored at its own plane once more,
    // it is as it was.
    let mirror = |about: Vector3| {
        let about = about.normalize();
        Matrix3::identity() - about * about.transpose() * 2.0
    };
    mirror(sight) * mirror(normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point3, Pose};

    #[test]
    fn a_small_chart_looks_nearly_the_same_in_both() {
        let pose = Pose::from_rotation_vector(
            Vector3::new(20.0, -10.0, 400.0),
            Vector3::new(0.2, -0.15, 0.4),
        );
        let turn = other_tilt(pose.translation, pose.rotation.column(2).into());
        assert!((turn.determinant() - 1.0).abs() < 1e-12);
        let other = Pose { rotation: turn * pose.rotation, ..pose };
        let seen = |pose: &Pose, place: Point3| {
            let at = pose.transform(place);
            [at.x / at.z, at.y / at.z]
        };
        for [x, y] in [[5.0, 3.0], [-5.0, 3.0], [5.0, -3.0]] {
            let place = Point3::new(x, y, 0.0);
            let (a, b) = (seen(&pose, place), seen(&other, place));
            let apart = (pose.transform(place) - other.transform(place)).norm() / 400.0;
            let gap = ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt();
            assert!(gap < 0.1 * apart, "{gap} of {apart}");
        }
    }
}
