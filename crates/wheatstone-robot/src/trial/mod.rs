//! One robot in one made world, from its calibration to its end, and what of it was true; and many of
//! them.

mod many;
mod outcome;

pub use many::run_all;
pub use outcome::{Detected, Distribution, Ended, Outcome, Summary};

use super::{
    PlanarPose, Vehicle, Velocity,
    cameras::cameras,
    capture::ChartPictures,
    pilot::{Pilot, Step},
    simulated::{CameraFailure, SimulatedRobot, Wheels, eyes},
    world::{DISTANCE, Eye, World},
};
use outcome::{Tally, outcome};
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{Calibration, Result, geometry::Vector3, method::AnyMethod};
use wheatstone_numeric::{progress::Progress, random::Random};
use wheatstone_synthetic::Sensor;

/// Streams of random numbers: what the eyes see, how the wheels slip, what befalls the cameras.
const EYES: u64 = 5;
const WHEELS: u64 = 6;
const MISHAPS: u64 = 9;

/// What befalls a camera when the robot is half-way to its goal: which camera is left to chance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// It is turned by so many degrees about an axis that is left to chance.
    Knock(f64),
    /// Its lens is covered.
    Cover,
}

/// A world and what the robot is to do in it.
#[derive(Clone, Debug)]
pub struct Trial {
    /// What the world, its light and its slips are made from.
    pub seed: u64,
    /// Whether the world is a simple one ([`World::simple`]).
    pub simple: bool,
    /// How the robot learns where pairs of pixels point.
    pub method: AnyMethod,
    /// Looks after which the trial is broken off.
    pub steps: usize,
    /// What befalls the cameras.
    pub trouble: Option<Fault>,
}

/// A look, with the truth about it.
pub struct Look<'a> {
    /// Counted from 1.
    pub number: usize,
    /// Where the robot truly is.
    pub pose: PlanarPose,
    /// What the cameras show.
    pub pictures: &'a [GrayImage; 2],
    /// What it came to.
    pub step: &'a Step,
    /// What it knows and believes after it.
    pub pilot: &'a Pilot<'a>,
}

/// Sees a trial from outside.
pub trait Observer {
    /// Sees a look, before the robot moves on.
    ///
    /// # Errors
    ///
    /// Its own, which end the trial.
    fn look(&mut self, look: &Look) -> Result<()>;

    /// Called with the outcome.
    ///
    /// # Errors
    ///
    /// Its own.
    fn ended(self: Box<Self>, outcome: &Outcome) -> Result<()>;
}

/// Seconds since some moment. The library has no clock of its own, so that what it makes does not
/// depend on the time.
pub type Clock<'a> = &'a (dyn Fn() -> f64 + Sync);

/// Who observes a trial, if anyone does.
pub type Observers<'a> = &'a (dyn Fn(&Trial, &World) -> Option<Box<dyn Observer>> + Sync);

/// A robot that shows no more than so many looks, and remembers when it showed the last one.
struct Watched<'a> {
    robot: SimulatedRobot<'a>,
    clock: Clock<'a>,
    left: usize,
    shown: f64,
}

impl Vehicle for Watched<'_> {
    fn look(&mut self) -> Result<Option<[GrayImage; 2]>> {
        let Some(left) = self.left.checked_sub(1) else {
            return Ok(None);
        };
        self.left = left;
        let pictures = self.robot.look();
        self.shown = (self.clock)();
        pictures
    }

    fn drive(&mut self, velocity: Velocity) -> Result<()> {
        self.robot.drive(velocity)
    }

    fn period(&self) -> f64 {
        self.robot.period()
    }
}

impl Trial {
    /// The robot learns from a chart where pairs of pixels point, then drives.
    ///
    /// # Errors
    ///
    /// Those of [`ChartPictures::calibrate`], of [`Pilot::new`] and of the witness, and
    /// [`wheatstone_core::Error::Cancelled`].
    pub fn run(
        &self,
        observers: Observers,
        clock: Clock,
        progress: &dyn Progress,
    ) -> Result<Outcome> {
        let world = self.world();
        let mut witness = observers(self, &world);
        let (sensor, mut random) = (Sensor::default(), Random::stream(self.seed, EYES));
        let eyes = eyes(sensor, &mut random)?;
        let calibration = self.calibration(&eyes, &world, &mut random, progress)?;
        let [camera, _] = cameras()?;
        let size = [camera.width, camera.height];
        let random = Random::stream(self.seed, WHEELS);
        let robot = SimulatedRobot::new(&world, eyes, (Wheels::default(), sensor), random);
        let goal = (world.goal(), robot.period());
        let mut pilot = Pilot::new(&calibration, size, goal, (self.seed, progress))?;
        let mut robot = Watched { robot, clock, left: self.steps, shown: 0.0 };
        let mut tally = Tally::default();
        let decision = pilot.drive(&mut robot, &mut |robot, pilot, pictures, step| {
            tally.count(step, (robot.clock)() - robot.shown);
            progress.check()?;
            progress.report("driving", tally.steps as u64, self.steps as u64);
            if let Some(witness) = &mut witness {
                let (number, pose) = (tally.steps, robot.robot.pose());
                witness.look(&Look { number, pose, pictures, step, pilot })?;
            }
            self.befall(robot, &world, &mut tally)
        })?;
        let outcome = outcome((Ended::of(decision), tally), &world, &robot.robot, &pilot);
        if let Some(witness) = witness {
            witness.ended(&outcome)?;
        }
        Ok(outcome)
    }

    fn world(&self) -> World {
        if self.simple { World::simple(self.seed) } else { World::new(self.seed) }
    }

    fn calibration(
        &self,
        eyes: &[Eye; 2],
        world: &World,
        random: &mut Random,
        progress: &dyn Progress,
    ) -> Result<Calibration> {
        // The network of every world begins alike: worlds differ, not luck in training.
        ChartPictures::take(eyes, world, random)?.calibrate(&self.method, 0, progress)
    }

    /// Lets the mishap happen once the robot is nearer to the goal than half the way.
    fn befall(&self, robot: &mut Watched, world: &World, tally: &mut Tally) -> Result<()> {
        let away = (robot.robot.pose().place() - world.goal()).norm();
        let Some(trouble) =
            self.trouble.filter(|_| tally.noticed.is_none() && away < DISTANCE / 2.0)
        else {
            return Ok(());
        };
        tally.noticed = Some(Detected { at: tally.steps + 1, after: None });
        let mut random = Random::stream(self.seed, MISHAPS);
        let axis = Vector3::new(random.normal(), random.normal(), random.normal()).normalize();
        let camera = random.below(2);
        robot.robot.befall(match trouble {
            Fault::Cover => CameraFailure::Covered { camera },
            Fault::Knock(degrees) => {
                CameraFailure::Knocked { camera, rotation: (axis * degrees.to_radians()).into() }
            }
        })
    }
}

#[cfg(test)]
mod tests;
