//! A mobile robot whose two cameras are its only sensors, as the 2001 paper's: it learns where pairs of
//! pixels point from a chart, then drives among obstacles to a goal.
//!
//! What observes and what plans knows pictures alone; [`Vehicle`] stands between it and the wheels, and
//! behind that a simulated world, a recorded sequence or a real robot.
//!
//! Lengths are centimetres, as the rig's. The *start frame* is where the robot's own frame was when it
//! set out: origin on the floor midway between the wheels, x right, y down, z forward; so the floor is
//! y = 0 and what stands on it has negative y. On the ground x and z alone count.

pub mod cameras;
pub mod capture;
pub mod film;
pub mod map;
pub mod motion;
pub mod navigator;
pub mod pilot;
pub mod plan;
pub mod recorded;
pub mod scene;
pub mod seeing;
pub mod simulated;
pub mod trial;
pub mod world;

use nalgebra::{Matrix3, Point2};
use serde::{Deserialize, Serialize};
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{Result, geometry::Point3};

/// A place on the floor: x (right) and z (forward), in centimetres.
pub type Ground = Point2<f64>;

/// Where something stands on the floor and which way it looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlanarPose {
    /// Right of the frame's origin, in centimetres.
    pub x: f64,
    /// Ahead of it, in centimetres.
    pub z: f64,
    /// How far it is turned to the right, in radians.
    pub heading: f64,
}

impl PlanarPose {
    /// A place on the ground given in this pose's own frame, in the frame in which the pose is given.
    #[must_use]
    pub fn transform(&self, own: Ground) -> Ground {
        let (sine, cosine) = (libm::sin(self.heading), libm::cos(self.heading));
        Ground::new(self.x + own.x * cosine + own.y * sine, self.z - own.x * sine + own.y * cosine)
    }

    /// A place on the ground, in this pose's own frame.
    #[must_use]
    pub fn inverse_transform(&self, place: Ground) -> Ground {
        let (sine, cosine) = (libm::sin(self.heading), libm::cos(self.heading));
        let (x, z) = (place.x - self.x, place.y - self.z);
        Ground::new(x * cosine - z * sine, x * sine + z * cosine)
    }

    /// A point above the ground given in this pose's own frame, in the frame of the pose.
    #[must_use]
    pub fn transform_point(&self, own: Point3) -> Point3 {
        let ground = self.transform(Ground::new(own.x, own.z));
        Point3::new(ground.x, own.y, ground.y)
    }

    /// This pose followed by a motion that is given in its own frame.
    #[must_use]
    pub fn then(&self, motion: &Self) -> Self {
        let ground = self.transform(Ground::new(motion.x, motion.z));
        Self { x: ground.x, z: ground.y, heading: wrapped(self.heading + motion.heading) }
    }

    /// The motion, in this pose's own frame, that leads to `next`.
    #[must_use]
    pub fn motion_to(&self, next: &Self) -> Self {
        let ground = self.inverse_transform(Ground::new(next.x, next.z));
        Self { x: ground.x, z: ground.y, heading: wrapped(next.heading - self.heading) }
    }

    /// Where it stands.
    #[must_use]
    pub fn place(&self) -> Ground {
        Ground::new(self.x, self.z)
    }
}

/// Where the robot believes itself to be in the start frame, and how surely.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimated {
    /// The pose itself.
    pub pose: PlanarPose,
    /// The covariance of x, z and heading, in centimetres and radians.
    pub covariance: Matrix3<f64>,
}

/// An angle as one between minus and plus half a turn, in radians.
#[must_use]
pub fn wrapped(angle: f64) -> f64 {
    libm::remainder(angle, std::f64::consts::TAU)
}

/// What the wheels are told to do until the next pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Velocity {
    /// Forward, in centimetres a second.
    pub forward: f64,
    /// To the right, in radians a second.
    pub turn: f64,
}

impl Velocity {
    /// Standing still.
    pub const STOP: Self = Self { forward: 0.0, turn: 0.0 };

    /// The motion that these velocities make in so many seconds, if the wheels do not slip: an arc.
    #[must_use]
    pub fn motion(&self, seconds: f64) -> PlanarPose {
        let (distance, heading) = (self.forward * seconds, self.turn * seconds);
        // The chord of an arc; a turn too small for the quotient is a straight line.
        let chord = if heading.abs() < 1e-6 {
            distance
        } else {
            distance * 2.0 * libm::sin(heading / 2.0) / heading
        };
        PlanarPose {
            x: chord * libm::sin(heading / 2.0),
            z: chord * libm::cos(heading / 2.0),
            heading,
        }
    }
}

/// Something with two cameras and wheels: a simulated robot, a real one, or a recording, which only
/// looks.
pub trait Vehicle {
    /// Takes a picture with each camera, at one moment; `None` where a recording has ended.
    ///
    /// # Errors
    ///
    /// Those of the cameras.
    fn look(&mut self) -> Result<Option<[GrayImage; 2]>>;

    /// Moves with these velocities for [`Vehicle::period`], then stands.
    ///
    /// # Errors
    ///
    /// Those of the motors.
    fn drive(&mut self, velocity: Velocity) -> Result<()>;

    /// Seconds from one command to the next.
    fn period(&self) -> f64;
}
