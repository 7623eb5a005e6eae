//! Where the second camera may see what the first one observes at a pixel: from near to far along its line
//! of sight.

use crate::Ground;
use wheatstone_core::geometry::{Pixel, Point3};
use wheatstone_reconstruction::features::{CurvePlace, EpipolarCurve};

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

    /// Its part above the floor, as the second picture shows it.
    #[must_use]
    pub(super) fn seen(&self) -> EpipolarCurve {
        let above = self.0.iter().take_while(|place| above_floor(place.point)).count();
        // A piece counts that is above the floor in part.
        EpipolarCurve::new(0, self.0.iter().map(|place| place.other).collect()).shortened(above + 1)
    }

    /// The point of the line of sight that the second camera observes nearest to a pixel; `None` beyond its
    /// ends.
    #[must_use]
    pub(super) fn point_near(&self, pixel: Pixel) -> Option<Point3> {
        let CurvePlace { piece, share, .. } = self.seen().nearest(pixel)?;
        let (near, far) = (self.0[piece].point, self.0[piece + 1].point);
        Some(near + (far - near) * share)
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
