//! A robot in a made world: wheels that slip and are not alike, cameras that may be knocked or covered.

use super::{
    Ground, PlanarPose, Vehicle, Velocity,
    cameras::cameras,
    world::{Eye, ROBOT_RADIUS, World},
};
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{
    Result,
    camera::PosedCamera,
    geometry::{Pose, Vector3},
};
use wheatstone_numeric::random::Random;
use wheatstone_synthetic::{Sensor, exposed};

/// How wheels do otherwise than they are told, as shares of what they were told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheels {
    /// Standard deviation of what is amiss all the time, of forward and of turn.
    pub bias: f64,
    /// Standard deviation of what is amiss in one step.
    pub noise: f64,
    /// How often they slip in a step.
    pub slips: f64,
    /// The largest share of a step that is lost then.
    pub slip: f64,
}

impl Default for Wheels {
    /// Cheap motors on a smooth floor.
    fn default() -> Self {
        Self { bias: 0.05, noise: 0.08, slips: 0.05, slip: 0.4 }
    }
}

/// Something that befalls the cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraFailure {
    /// A camera (counted from 0) is turned by this rotation vector, in radians, in its own frame.
    Knocked {
        /// Which.
        camera: usize,
        /// By what.
        rotation: [f64; 3],
    },
    /// A camera (counted from 0) observes nothing more.
    Covered {
        /// Which.
        camera: usize,
    },
}

/// The simulated robot, with the truth about it.
pub struct SimulatedRobot<'a> {
    world: &'a World,
    eyes: [Eye; 2],
    wheels: Wheels,
    bias: [f64; 2],
    pose: PlanarPose,
    covered: Option<usize>,
    sensor: Sensor,
    random: Random,
    /// Least distance of the robot's body from anything, so far, in centimetres.
    clearance: f64,
}

/// What light finds its way through a hand over a lens, in grey levels.
const LEAKING: f32 = 4.0;

/// Seconds from one command to the next: four looks a second.
const PERIOD: f64 = 0.25;

/// The robot's eyes in a world: the cameras as they are mounted, and the room's light.
///
/// # Errors
///
/// None with the built-in cameras.
pub fn eyes(sensor: Sensor, random: &mut Random) -> Result<[Eye; 2]> {
    Ok(cameras()?.map(|camera| Eye::new(camera, sensor, random)))
}

impl<'a> SimulatedRobot<'a> {
    /// At the start, with these eyes.
    #[must_use]
    pub fn new(
        world: &'a World,
        eyes: [Eye; 2],
        (wheels, sensor): (Wheels, Sensor),
        mut random: Random,
    ) -> Self {
        let bias = [0, 1].map(|_| wheels.bias * random.normal());
        let pose = PlanarPose::default();
        let clearance = world.clearance(pose.place()) - ROBOT_RADIUS;
        Self { world, eyes, wheels, bias, pose, covered: None, sensor, random, clearance }
    }

    /// Where it truly is, in the start frame.
    #[must_use]
    pub fn pose(&self) -> PlanarPose {
        self.pose
    }

    /// The least distance of its body from anything so far, in centimetres; below 0 it ran into
    /// something.
    #[must_use]
    pub fn clearance(&self) -> f64 {
        self.clearance
    }

    /// Something happens to a camera.
    ///
    /// # Errors
    ///
    /// None with the built-in cameras.
    pub fn befall(&mut self, mishap: CameraFailure) -> Result<()> {
        match mishap {
            CameraFailure::Covered { camera } => self.covered = Some(camera),
            CameraFailure::Knocked { camera, rotation } => {
                let mounted = cameras()?[camera].clone();
                let turn = Pose::from_rotation_vector(Vector3::zeros(), rotation.into());
                let camera_from_world = turn.after(&mounted.camera_from_world);
                let knocked = PosedCamera { camera_from_world, ..mounted };
                self.eyes[camera] = self.eyes[camera].moved(knocked);
            }
        }
        Ok(())
    }
}

impl Vehicle for SimulatedRobot<'_> {
    fn look(&mut self) -> Result<Option<[GrayImage; 2]>> {
        let [left, right] = &self.eyes;
        let mut pictures =
            [left, right].map(|eye| eye.look(self.world, self.pose, None, &mut self.random));
        if let Some(camera) = self.covered {
            let [width, height] = [pictures[camera].width(), pictures[camera].height()];
            let dark = GrayImage::from_fn(width, height, |_, _| LEAKING);
            pictures[camera] = exposed(dark, self.sensor, &mut self.random);
        }
        Ok(Some(pictures))
    }

    fn drive(&mut self, velocity: Velocity) -> Result<()> {
        // Collisions are looked for all along the way.
        const PARTS: usize = 10;
        let Wheels { noise, slips, slip, .. } = self.wheels;
        let mut amiss = |bias: f64| 1.0 + bias + noise * self.random.normal();
        let (mut forward, mut turn) = (amiss(self.bias[0]), amiss(self.bias[1]));
        if self.random.uniform(0.0, 1.0) < slips {
            let left = 1.0 - self.random.uniform(0.0, slip);
            (forward, turn) = (forward * left, turn * left);
        }
        // Wheels that are not alike turn the robot as it drives.
        let swerve = 0.1 * self.bias[1] * velocity.forward / ROBOT_RADIUS;
        let done =
            Velocity { forward: velocity.forward * forward, turn: velocity.turn * turn + swerve };
        for _ in 0..PARTS {
            self.pose = self.pose.then(&done.motion(PERIOD / PARTS as f64));
            let place: Ground = self.pose.place();
            self.clearance = self.clearance.min(self.world.clearance(place) - ROBOT_RADIUS);
        }
        Ok(())
    }

    fn period(&self) -> f64 {
        PERIOD
    }
}
