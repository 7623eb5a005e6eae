//! The 2001 paper done again, as plain data.

use serde::Serialize;

/// The farthest chart that is learned, in centimetres.
pub(super) const TRAINED_TO: f64 = 140.0;

/// Least, middle and greatest value over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeedRange {
    /// Least.
    pub least: f64,
    /// Middle.
    pub median: f64,
    /// Greatest.
    pub greatest: f64,
}

/// Figure 5: mean error in percent of the distance, against epochs.
#[derive(Clone, Debug, Serialize)]
pub struct LearningPoint {
    /// Epochs done.
    pub epoch: u64,
    /// On the pairs that are learned.
    pub training_percent: SeedRange,
    /// On points elsewhere in the same range.
    pub exam_percent: SeedRange,
}

/// Figure 6: mean error of Z beyond the trained range, for one way of locating.
#[derive(Clone, Debug, Serialize)]
pub struct BeyondCurve {
    /// The method.
    pub method: String,
    /// Distances and errors.
    pub points: Vec<BeyondPoint>,
    /// The exponent p of a percentage that is `a + b (Z - 140 cm)^p`: 1 for a straight line.
    pub percent_growth: Growth,
    /// The exponent p of an error in centimetres that is `b Z^p`: 2 where it grows as the square.
    pub error_growth: Growth,
}

/// One distance of figure 6.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BeyondPoint {
    /// Z, in centimetres.
    pub distance: f64,
    /// Mean of |error of Z| / Z, in percent.
    pub percent: f64,
    /// Mean of |error of Z|, in centimetres.
    pub error: f64,
}

/// How fast something grows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// The exponent.
    pub exponent: f64,
    /// Its 95 % confidence interval.
    pub interval: [f64; 2],
}

/// One network of the study of architectures.
#[derive(Clone, Debug, Serialize)]
pub struct Architecture {
    /// Units in each hidden layer.
    pub hidden: Vec<usize>,
    /// Mean error in percent on points elsewhere in range, at the end.
    pub exam_percent: SeedRange,
    /// Epochs until it is below 5 %; none where it never is, for half of the seeds or more.
    pub epochs_to_5_percent: Option<u64>,
}

/// One row of the comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Rival {
    /// The method.
    pub method: String,
    /// Mean error in percent, in the trained range.
    pub inside_percent: f64,
    /// The same at 150 to 200 cm.
    pub beyond_percent: f64,
    /// Root mean square error over the floor, in the trained range.
    pub inside_ratio_to_floor: f64,
}

/// The paper's recipe where one thing is otherwise than in the paper.
#[derive(Clone, Debug, Serialize)]
pub struct Condition {
    /// What is otherwise.
    pub change: Change,
    /// Mean error in percent on points elsewhere in range, at the end; infinite where training diverged.
    pub exam_percent: SeedRange,
    /// Root mean square error on them, in centimetres.
    pub exam_rms: SeedRange,
}

/// What is otherwise than in the paper.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// Nothing.
    Nothing,
    /// Pixels are exact, not read to whole ones.
    ExactPixels,
    /// The world's origin and axes are elsewhere.
    Origin,
    /// Inputs and targets are learned as they are, in pixels and centimetres, not scaled to 0 … 1.
    Unscaled,
    /// Other cameras: the name of the rig.
    Cameras(String),
}

/// Drives of the robot with the paper's recipe, in simple worlds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Drives {
    /// How many.
    pub worlds: usize,
    /// Those in which it reached the goal.
    pub reached: usize,
    /// Those in which it ran into something.
    pub collisions: usize,
}

/// All of it.
#[derive(Clone, Debug, Serialize)]
pub struct Reproduction {
    /// Epochs of training.
    pub epochs: u64,
    /// Seeds of each network.
    pub seeds: u64,
    /// Pairs that are learned.
    pub pairs: usize,
    /// Figures 1 to 4.
    pub setup: crate::SetupFigures,
    /// Figure 5.
    pub figure_5: Vec<LearningPoint>,
    /// Figure 6.
    pub figure_6: Vec<BeyondCurve>,
    /// The study of architectures.
    pub architectures: Vec<Architecture>,
    /// The comparison.
    pub comparison: Vec<Rival>,
    /// The recipe under other conditions.
    pub conditions: Vec<Condition>,
    /// Drives of the robot, where it drove.
    pub drives: Option<Drives>,
    /// What the paper says, and what is measured.
    pub claims: Vec<Claim>,
}

/// Whether a claim holds here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It does.
    Confirmed,
    /// It does not.
    NotConfirmed,
    /// What it speaks of was not run.
    NotTested,
}

impl Verdict {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::NotConfirmed => "not confirmed",
            Self::NotTested => "not tested",
        }
    }
}

/// One claim of the paper.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// What the paper says.
    pub claim: String,
    /// What was measured; empty where nothing was.
    pub measured: String,
    /// Whether the two agree.
    pub verdict: Verdict,
    /// The criterion, which was set before measuring, and what explains the figure; or why it was not tested.
    pub why: String,
}
