//! Stages that are not where they are said to be: seeded errors of a chart's placements.

use super::Placement;
use wheatstone_core::geometry::{Pose, Vector3};
use wheatstone_numeric::random::Random;

/// How far a chart stands from where it is said to stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageError {
    /// Standard deviation of its offset along each axis, in the rig's unit.
    pub offset: f64,
    /// Standard deviation of its rotation about each axis, in radians.
    pub rotation: f64,
}

impl StageError {
    /// Placements as they really are, for nominal ones; each view's error is independent. The chart
    /// turns about its own origin.
    ///
    /// Data with an error have the pixels of charts at these placements, and the world places of the
    /// nominal ones: [`super::misplaced_correspondences`].
    #[must_use]
    pub fn apply(&self, nominal: &[Placement], seed: u64) -> Vec<Placement> {
        let mut random = Random::new(seed);
        let mut vector = |sigma: f64| {
            let mut draw = || sigma * random.normal();
            Vector3::new(draw(), draw(), draw())
        };
        let mut moved = |(name, pose): &Placement| {
            let (offset, turn) = (vector(self.offset), vector(self.rotation));
            let turned =
                Pose::from_rotation_vector(Vector3::zeros(), turn).rotation * pose.rotation;
            (name.clone(), Pose { rotation: turned, translation: pose.translation + offset })
        };
        nominal.iter().map(&mut moved).collect()
    }
}
