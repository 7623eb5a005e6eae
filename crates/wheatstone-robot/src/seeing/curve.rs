//! Where the second camera may see what the first one observes at a pixel: from near to far along its line
//! of sight.

use crate::Ground;
use nalgebra::Vector2;
use wheatstone_core::geometry::{Pixel, Point3};

/// One place on a curve.
#[derive(Clone, Copy, Debug)]
pub struct Waypoint {
    /// Where the second camera observes it.
    pub other: Pixel,
    /// Where it is, in the robot's frame.
    pub point: Point3,
}

/// The places of one pixel, from near to far; as far as they are known.
#[derive(Clone, Debug)]
pub struct Curve(Vec<Waypoint>);

/// How far below the floor a point may seem, in centimetres and as a share of its distance: nothing is
/// there, but the paper's recipe errs by some percent.
const BELOW: f64 = 2.5;
const BELOW_SHARE: f64 = 0.03;

/// Whether a point may be there at all.
#[must_use]
pub(crate) fn above_floor(point: Point3) -> bool {
    point.y < BELOW + BELOW_SHARE * Ground::new(point.x, point.z).coords.norm()
}

impl Curve {
    /// Through these places.
    #[must_use]
    pub(super) fn new(waypoints: Vec<Waypoint>) -> Self {
        Self(waypoints)
    }

    /// The places.
    #[must_use]
    pub fn waypoints(&self) -> &[Waypoint] {
        &self.0
    }

    /// The pieces between them that are above the floor, in part at least.
    pub(super) fn pieces(&self) -> impl Iterator<Item = [Waypoint; 2]> {
        let pieces = self.0.windows(2).map(|pair| [pair[0], pair[1]]);
        pieces.take_while(|[near, _]| above_floor(near.point))
    }

    /// Unit vector in the second picture from its near to its far end.
    #[must_use]
    pub(super) fn direction(&self) -> Option<Vector2<f64>> {
        (self.0.last()?.other - self.0.first()?.other).try_normalize(1e-9)
    }

    /// How far aside of it a pixel of the second picture lies, positive to the right of someone who goes
    /// along it from near to far; `None` beyond its ends.
    #[must_use]
    pub(super) fn aside(&self, pixel: Pixel) -> Option<f64> {
        Some(self.nearest(pixel)?.0)
    }

    /// The point of the line of sight that the second camera observes nearest to a pixel; `None` beyond its
    /// ends.
    #[must_use]
    pub(super) fn point_near(&self, pixel: Pixel) -> Option<Point3> {
        Some(self.nearest(pixel)?.1)
    }

    /// How far aside a pixel of the second picture lies, and the point beside it.
    fn nearest(&self, pixel: Pixel) -> Option<(f64, Point3)> {
        // Where it bends, a pixel may face neither of two pieces.
        const GAP: f64 = 0.01;
        let off = |[near, far]: [Waypoint; 2]| {
            let by = far.other - near.other;
            let from = pixel - near.other;
            let share = from.dot(&by) / by.norm_squared();
            let faces = (-GAP..1.0 + GAP).contains(&share);
            let aside = (by.x * from.y - by.y * from.x) / by.norm();
            faces.then(|| (aside, near.point + (far.point - near.point) * share))
        };
        self.pieces().filter_map(off).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    }

    /// Where it meets the floor, and how many waypoints along it.
    #[must_use]
    pub(super) fn floor(&self) -> Option<(f64, Waypoint)> {
        let meets = |pair: &&[Waypoint]| pair[0].point.y < 0.0 && pair[1].point.y >= 0.0;
        let (level, pair) = self.0.windows(2).enumerate().find(|(_, pair)| meets(pair))?;
        let [near, far] = [pair[0], pair[1]];
        let share = near.point.y / (near.point.y - far.point.y);
        let other = near.other + (far.other - near.other) * share;
        let point = near.point + (far.point - near.point) * share;
        Some((level as f64 + share, Waypoint { other, point }))
    }
}
