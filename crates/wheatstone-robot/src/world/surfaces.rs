//! What a ray meets: frames on the ground, and the outlines that stand on it.

use super::{Footprint, Obstacle};
use crate::PlanarPose;
use wheatstone_core::geometry::{Point3, Pose, Ray, Vector3};

/// What a ray meets first.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Hit {
    pub(super) distance: f64,
    /// Which plain face it is.
    pub(super) face: u32,
    pub(super) shade: f64,
}

/// A frame on the ground, turned and moved from another: made once a picture, used by every ray.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    sine: f64,
    cosine: f64,
    x: f64,
    z: f64,
}

impl Frame {
    pub(super) fn new(own_in_frame: PlanarPose) -> Self {
        let PlanarPose { x, z, heading } = own_in_frame;
        Self { sine: libm::sin(heading), cosine: libm::cos(heading), x, z }
    }

    pub(super) fn turn(&self, own: Vector3) -> Vector3 {
        Vector3::new(
            own.x * self.cosine + own.z * self.sine,
            own.y,
            own.z * self.cosine - own.x * self.sine,
        )
    }

    pub(super) fn ray(&self, own: &Ray) -> Ray {
        let origin = self.turn(own.origin.coords) + Vector3::new(self.x, 0.0, self.z);
        Ray { origin: Point3::from(origin), direction: self.turn(own.direction) }
    }
}

/// An obstacle, and the pixels that may show it.
pub(super) struct Placed<'a> {
    pub(super) obstacle: &'a Obstacle,
    pub(super) number: u32,
    pub(super) own_from_robot: Frame,
    /// Left, top, right, bottom.
    pub(super) bounds: [f64; 4],
}

impl Placed<'_> {
    pub(super) fn hit(&self, ray: &Ray) -> Option<Hit> {
        let Ray { origin, direction: ahead } = self.own_from_robot.ray(ray);
        let (sides, outline) = match self.obstacle.footprint {
            Footprint::Box(half) => slab(origin, ahead, half)?,
            Footprint::Cylinder(radius) => round(origin, ahead, radius)?,
        };
        let number = 100 + 8 * self.number;
        let top = -self.obstacle.height;
        let height = origin.y + sides[0] * ahead.y;
        if sides[0] > 0.0 && height >= top && height <= 0.0 {
            let (face, shade) = outline;
            return Some(Hit {
                distance: sides[0],
                face: number + face,
                shade: self.obstacle.shades[shade],
            });
        }
        let distance = (top - origin.y) / ahead.y;
        let over = distance > sides[0].max(0.0) && distance < sides[1] && ahead.y > 0.0;
        over.then(|| Hit { distance, face: number + 7, shade: self.obstacle.shades[2] })
    }
}

/// Where a ray enters and leaves an outline on the ground, and which side it enters by: its number, and
/// which shade that has.
type Outline = ([f64; 2], (u32, usize));

pub(super) fn slab(origin: Point3, ahead: Vector3, half: [f64; 2]) -> Option<Outline> {
    let (mut enter, mut leave, mut side) = (f64::NEG_INFINITY, f64::INFINITY, (0, 0));
    for (axis, half) in [(0, half[0]), (2, half[1])] {
        let sign = ahead[axis].signum();
        let near = (-sign * half - origin[axis]) / ahead[axis];
        let far = (sign * half - origin[axis]) / ahead[axis];
        if ahead[axis] == 0.0 && origin[axis].abs() > half {
            return None;
        }
        if near > enter {
            enter = near;
            side = (axis as u32 + u32::from(sign > 0.0), usize::from(axis == 0));
        }
        leave = leave.min(far);
    }
    (enter < leave && leave > 0.0).then_some(([enter, leave], side))
}

pub(super) fn round(origin: Point3, ahead: Vector3, radius: f64) -> Option<Outline> {
    let a = ahead.x * ahead.x + ahead.z * ahead.z;
    let b = origin.x * ahead.x + origin.z * ahead.z;
    let c = origin.x * origin.x + origin.z * origin.z - radius * radius;
    let root = b * b - a * c;
    if root <= 0.0 || a == 0.0 {
        return None;
    }
    let (enter, leave) = ((-b - root.sqrt()) / a, (-b + root.sqrt()) / a);
    (leave > 0.0).then_some(([enter, leave], (0, 0)))
}

/// Where a ray meets the chart's plane: distance, and place on the chart.
pub(super) fn on_board(ray: &Ray, chart_from_robot: &Pose) -> Option<(f64, [f64; 2])> {
    let own = ray.transformed(chart_from_robot);
    let distance = -own.origin.z / own.direction.z;
    let place = own.at(distance);
    (distance > 0.0 && place.coords.norm() < 1e9).then_some((distance, [place.x, place.y]))
}
