//! What one pair of pictures shows, on the ground about the robot.

use super::Ground;
use nalgebra::Matrix2;

/// What one pair of pictures shows, in the robot's own frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Points that stand out from the floor: the robot must not go there.
    pub obstacles: Vec<ScenePoint>,
    /// Stretches of floor that nothing stands on, one a direction in which the pictures look, left to
    /// right. What lies nearer than a stretch's beginning or farther than its end was not seen.
    pub clear: Vec<Stretch>,
    /// Whether the pictures can be trusted.
    pub trust: Trust,
}

/// A point of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenePoint {
    /// Where it is above.
    pub place: Ground,
    /// The covariance of that, in square centimetres.
    pub covariance: Matrix2<f64>,
    /// How high above the floor, in centimetres.
    pub height: f64,
}

/// A straight stretch of free floor along a line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Its near end.
    pub from: Ground,
    /// Its far end.
    pub to: Ground,
    /// Standard deviation of where it ends, along it, in centimetres.
    pub sigma: f64,
    /// Whether it ends at the foot of something rather than where no more was seen.
    pub blocked: bool,
}

/// How far a pair of pictures can be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Trust {
    /// Enough was seen, and it agrees with the calibration.
    #[default]
    Sound,
    /// Too little was seen to go by: drive on slowly, or look elsewhere.
    Poor,
    /// The pictures contradict the calibration: a camera was moved, or is covered.
    Broken,
}
