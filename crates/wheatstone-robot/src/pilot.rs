//! From pictures to commands: the whole of the robot's mind, step by step.

use super::{
    Estimated, Ground, PlanarPose, Vehicle, Velocity,
    motion::OwnMotion,
    navigator::{Decision, Navigator},
    scene::Trust,
    seeing::{Observation, Observer},
};
use wheatstone_charts::imaging::GrayImage;
use wheatstone_core::{Calibration, Result};
use wheatstone_numeric::progress::Progress;

/// What observes, remembers and decides.
pub struct Pilot<'a> {
    observer: Observer<'a>,
    motion: OwnMotion,
    navigator: Navigator,
    period: f64,
    /// What the vehicle was told last.
    told: Velocity,
}

/// Who is told of every look: the vehicle, the pilot, the pictures and what they came to.
pub type Watch<'a, V> = &'a mut dyn FnMut(&mut V, &Pilot, &[GrayImage; 2], &Step) -> Result<()>;

/// What a look came to.
#[derive(Clone, Debug)]
pub struct Step {
    /// What the pictures show.
    pub observation: Observation,
    /// Where the robot found itself; none where its own motion was not found.
    pub found: Option<Estimated>,
    /// What it does next.
    pub decision: Decision,
}

impl<'a> Pilot<'a> {
    /// A pilot to a goal in the start frame, on coordinates from this calibration, for pictures of this
    /// size.
    ///
    /// # Errors
    ///
    /// Those of [`Observer::new`].
    pub fn new(
        calibration: &'a Calibration,
        size: [usize; 2],
        (goal, period): (Ground, f64),
        (seed, progress): (u64, &dyn Progress),
    ) -> Result<Self> {
        let observer = Observer::new(calibration, size, progress)?;
        let (motion, navigator) = (OwnMotion::new(seed), Navigator::new(goal, period));
        let (motion, navigator) = match observer.map_error() {
            Some(error) => (motion.with_compass_first(), navigator.with_doubt(error)),
            None => (motion, navigator),
        };
        Ok(Self { observer, motion, navigator, period, told: Velocity::STOP })
    }

    /// What to do after a pair of pictures.
    pub fn step(&mut self, pictures: &[GrayImage; 2]) -> Step {
        let observation = self.observer.observe(pictures);
        let told = self.told.motion(self.period);
        // Pictures that contradict the calibration say nothing of where the robot is.
        let (corners, floor) = match observation.scene.trust {
            Trust::Broken => (&[][..], None),
            _ => (&observation.corners[..], observation.floor_direction),
        };
        let found = self.motion.update((corners, floor), &told);
        let decision = self.navigator.step(&observation.scene, found.as_ref());
        self.told = match decision {
            Decision::Drive(velocity) => velocity,
            _ => Velocity::STOP,
        };
        Step { observation, found, decision }
    }

    /// Looks and drives until the vehicle has arrived, has stopped for good, or shows nothing more;
    /// `watch` is told of every look, before the vehicle moves.
    ///
    /// # Errors
    ///
    /// Those of the vehicle, and of `watch`.
    pub fn drive<V: Vehicle>(
        &mut self,
        vehicle: &mut V,
        watch: Watch<V>,
    ) -> Result<Option<Decision>> {
        while let Some(pictures) = vehicle.look()? {
            let step = self.step(&pictures);
            watch(vehicle, self, &pictures, &step)?;
            match step.decision {
                Decision::Drive(velocity) => vehicle.drive(velocity)?,
                ended => {
                    vehicle.drive(Velocity::STOP)?;
                    return Ok(Some(ended));
                }
            }
        }
        Ok(None)
    }

    /// What it knows of the floor, and where it means to go.
    #[must_use]
    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    /// The corners that it finds its way by.
    #[must_use]
    pub fn motion(&self) -> &OwnMotion {
        &self.motion
    }

    /// Where it last found itself to be.
    #[must_use]
    pub fn pose(&self) -> PlanarPose {
        self.motion.believed().pose
    }
}
