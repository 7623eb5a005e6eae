//! The other of the two poses in which a camera sees a flat chart nearly alike.

use super::{camera_evidence::CameraEvidence, evidence::Evidence};
use crate::geometry::{Point3, Pose, Vector3, other_tilt, principal_axes};

/// Where a view's chart was said to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct GivenChart {
    /// The middle of its points.
    pub(super) middle: Point3,
    /// The directions of its sides.
    pub(super) along: [Vector3; 2],
    /// Standard deviations of its points along them.
    pub(super) spread: [f64; 2],
}

impl GivenChart {
    /// Of its points; `along` is what is known of its sides.
    pub(super) fn of(points: &[Point3], along: Option<[Vector3; 2]>) -> Self {
        let (middle, axes, spread) = principal_axes(points);
        let along = along.unwrap_or([axes[0], axes[1]]);
        let own = along.map(|side| [0, 1].map(|k| side.dot(&axes[k]) * spread[k]));
        Self { middle, along, spread: own.map(|[a, b]| (a * a + b * b).sqrt()) }
    }

    /// The turns, about a point of it, that take it to the other pose in which each of these cameras sees it nearly
    /// alike.
    pub(super) fn other_tilts(
        &self,
        evidence: &Evidence,
        cameras: &[usize],
        about: Point3,
    ) -> Vec<Vector3> {
        let normal = self.along[0].cross(&self.along[1]);
        let seen = cameras.iter().filter_map(|camera| evidence.seen[*camera].as_ref());
        let turn = |seen: &CameraEvidence| {
            let rotation = other_tilt(about - seen.camera.centre(), normal);
            Pose { rotation, ..Pose::default() }.rotation_vector()
        };
        seen.map(turn).collect()
    }

    /// Whether a chart that is turned by so much about its middle, and moved, stands in that other pose, tilted about
    /// any of its points: a pose may have been found from a part of them.
    pub(super) fn is_in_other_pose(
        &self,
        evidence: &Evidence,
        cameras: &[usize],
        (turn, by): (Vector3, Vector3),
    ) -> bool {
        /// Of the turn, and of the scene's size.
        const NEAR: f64 = 0.3;
        const IN_PLACE: f64 = 0.08;
        /// How far from the chart's middle it may be tilted, in standard deviations of its points, and the steps to there.
        const REACH: f64 = 2.0;
        const STEPS: i32 = 32;
        let (angle, normal) = (turn.norm(), self.along[0].cross(&self.along[1]));
        let axis = turn / angle.max(f64::MIN_POSITIVE);
        let across = by - axis * by.dot(&axis);
        // Turn and shift together are a turn about a line parallel to the axis (and a slide along it), so far from the middle.
        let foot = 0.5 * (across + axis.cross(&across) / libm::tan(0.5 * angle));
        let reach = REACH * self.spread[0].max(self.spread[1]);
        let is_about_chart = (by - across).norm() < IN_PLACE
            && foot.dot(&normal).abs() * angle < IN_PLACE
            && foot.norm() < reach;
        let is_tilted = |step: i32| {
            let about = self.middle + foot + axis * (reach * f64::from(step) / f64::from(STEPS));
            let tilts = self.other_tilts(evidence, cameras, about);
            tilts.iter().any(|tilt| (turn - tilt).norm() < NEAR * tilt.norm())
        };
        is_about_chart && (-STEPS..=STEPS).any(is_tilted)
    }
}
