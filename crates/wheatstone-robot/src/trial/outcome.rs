//! What became of a trial, and of many.

use crate::{
    map::{Cell, Map},
    navigator::{Decision, Reason},
    pilot::{Pilot, Step},
    scene::Trust,
    simulated::SimulatedRobot,
    world::{ROBOT_RADIUS, World},
};
use serde::Serialize;
use wheatstone_numeric::statistics::{median, percentile};

/// How a trial ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ended {
    /// The robot says that it has arrived.
    Arrived,
    /// It stopped because its pictures contradict the calibration.
    Broken,
    /// It stopped because it does not find its own motion any more.
    Lost,
    /// It stopped because no way leads on.
    NoWay,
    /// It stopped after as many steps as it dares.
    TooLong,
    /// It was still on its way when the trial was broken off.
    Underway,
}

impl Ended {
    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Arrived => "arrived",
            Self::Broken => "stopped: cameras moved or covered",
            Self::Lost => "stopped: lost",
            Self::NoWay => "stopped: no way",
            Self::TooLong => "stopped: too many steps",
            Self::Underway => "still underway",
        }
    }

    pub(super) fn of(decision: Option<Decision>) -> Self {
        match decision {
            Some(Decision::Arrived) => Self::Arrived,
            Some(Decision::Stopped(Reason::Broken)) => Self::Broken,
            Some(Decision::Stopped(Reason::Lost)) => Self::Lost,
            Some(Decision::Stopped(Reason::NoWay)) => Self::NoWay,
            Some(Decision::Stopped(Reason::TooLong)) => Self::TooLong,
            Some(Decision::Drive(_)) | None => Self::Underway,
        }
    }
}

/// The middle and the 95th percentile of errors, in centimetres; both 0 where there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Distribution {
    /// Half of them are smaller.
    pub median: f64,
    /// Of twenty, nineteen are smaller.
    pub p95: f64,
}

impl Distribution {
    /// Of these errors.
    #[must_use]
    pub fn of(errors: &[f64]) -> Self {
        Self { median: median(errors), p95: percentile(errors, 0.95) }
    }
}

/// How soon the robot saw that something had befallen its cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Detected {
    /// The first look after the mishap, counted from 1.
    pub at: usize,
    /// Looks from that one, which counts, to the first that the robot found to contradict its
    /// calibration; none where it never did.
    pub after: Option<usize>,
}

/// What became of a trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Of the world.
    pub seed: u64,
    /// How many stood in it.
    pub obstacles: usize,
    /// How it ended.
    pub ended: Ended,
    /// What the robot said last of why.
    pub why: String,
    /// Whether it said that it had arrived, truly stood over the goal - no farther from it than its own
    /// radius - and ran into nothing.
    pub reached: bool,
    /// Whether it ran into something.
    pub collided: bool,
    /// The least distance of its body from anything, in centimetres; below 0 where it collided.
    pub clearance: f64,
    /// Looks that it took.
    pub steps: usize,
    /// Looks from which it did not find its own motion.
    pub lost: usize,
    /// Looks that it took for contradicting the calibration though nothing had befallen its cameras.
    pub false_alarms: usize,
    /// From where it believed itself to be at the end to where it was, in centimetres.
    pub position_error: f64,
    /// From where it was at the end to the goal, in centimetres.
    pub goal_distance: f64,
    /// From the cells of its map that it took for occupied to the nearest true surface, in centimetres.
    pub map_error: Distribution,
    /// The mishap, where one came to pass.
    pub noticed: Option<Detected>,
    /// Those distances, cell by cell.
    #[serde(skip)]
    pub map_errors: Vec<f64>,
    /// From the pictures to the command, of each step, by the caller's clock, in seconds.
    #[serde(skip)]
    pub seconds: Vec<f64>,
}

impl Outcome {
    /// Whether the robot stopped by itself before the goal, and had run into nothing.
    #[must_use]
    pub fn stopped_safely(&self) -> bool {
        !self.collided && !matches!(self.ended, Ended::Arrived | Ended::Underway)
    }
}

/// What became of many trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// How many there were.
    pub worlds: usize,
    /// In so many the robot reached the goal.
    pub reached: usize,
    /// In so many it ran into something.
    pub collisions: usize,
    /// In so many it stopped by itself before the goal, and had run into nothing.
    pub stopped_safely: usize,
    /// From where it believed itself to be at the end to where it was, in centimetres, over the worlds.
    pub position_error: Distribution,
    /// From where it said that it had arrived to the goal, in centimetres, over the worlds where it did.
    pub arrival_error: Option<Distribution>,
    /// From cells taken for occupied to the nearest true surface, in centimetres, over all cells of all
    /// worlds.
    pub map_error: Distribution,
    /// Mishaps that came to pass, and those of them that the robot noticed.
    pub mishaps: usize,
    /// See there.
    pub noticed: usize,
    /// Looks that half of these took.
    pub noticed_after: Option<f64>,
    /// Looks taken for contradicting the calibration before any mishap.
    pub false_alarms: usize,
    /// Looks, over the worlds.
    pub steps: Distribution,
    /// How many steps from pictures to command a second would hold: half of them take less than one over
    /// this. None without a clock.
    pub steps_per_second: Option<f64>,
}

impl Summary {
    /// Of these.
    #[must_use]
    pub fn of(outcomes: &[Outcome]) -> Self {
        let count = |holds: &dyn Fn(&Outcome) -> bool| outcomes.iter().filter(|o| holds(o)).count();
        let spread = |value: &dyn Fn(&Outcome) -> f64| {
            Distribution::of(&outcomes.iter().map(value).collect::<Vec<_>>())
        };
        let arrived: Vec<f64> = outcomes
            .iter()
            .filter(|outcome| outcome.ended == Ended::Arrived)
            .map(|outcome| outcome.goal_distance)
            .collect();
        let pooled = |values: &dyn Fn(&Outcome) -> &[f64]| -> Vec<f64> {
            outcomes.iter().flat_map(|outcome| values(outcome).iter().copied()).collect()
        };
        let after: Vec<f64> =
            outcomes.iter().filter_map(|outcome| Some(outcome.noticed?.after? as f64)).collect();
        let seconds = median(&pooled(&|outcome| &outcome.seconds));
        Self {
            worlds: outcomes.len(),
            reached: count(&|outcome| outcome.reached),
            collisions: count(&|outcome| outcome.collided),
            stopped_safely: count(&|outcome| outcome.stopped_safely()),
            position_error: spread(&|outcome| outcome.position_error),
            arrival_error: (!arrived.is_empty()).then(|| Distribution::of(&arrived)),
            map_error: Distribution::of(&pooled(&|outcome| &outcome.map_errors)),
            mishaps: count(&|outcome| outcome.noticed.is_some()),
            noticed: after.len(),
            noticed_after: (!after.is_empty()).then(|| median(&after)),
            false_alarms: outcomes.iter().map(|outcome| outcome.false_alarms).sum(),
            steps: spread(&|outcome| outcome.steps as f64),
            steps_per_second: (seconds > 0.0).then(|| 1.0 / seconds),
        }
    }
}

/// What is counted on the way.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) steps: usize,
    lost: usize,
    false_alarms: usize,
    pub(super) noticed: Option<Detected>,
    seconds: Vec<f64>,
}

impl Tally {
    pub(super) fn count(&mut self, step: &Step, seconds: f64) {
        self.seconds.push(seconds);
        self.steps += 1;
        self.lost += usize::from(step.found.is_none());
        if step.observation.scene.trust != Trust::Broken {
            return;
        }
        match &mut self.noticed {
            Some(noticed) => {
                noticed.after.get_or_insert(self.steps + 1 - noticed.at);
            }
            None => self.false_alarms += 1,
        }
    }
}

/// What became of a robot.
pub(super) fn outcome(
    (ended, tally): (Ended, Tally),
    world: &World,
    robot: &SimulatedRobot,
    pilot: &Pilot,
) -> Outcome {
    let place = robot.pose().place();
    let goal_distance = (place - world.goal()).norm();
    let collided = robot.clearance() < 0.0;
    let map_errors = map_errors(pilot.navigator().map(), world);
    Outcome {
        seed: world.seed,
        obstacles: world.obstacles.len(),
        ended,
        why: pilot.navigator().why().to_owned(),
        reached: ended == Ended::Arrived && goal_distance <= ROBOT_RADIUS && !collided,
        collided,
        clearance: robot.clearance(),
        steps: tally.steps,
        lost: tally.lost,
        false_alarms: tally.false_alarms,
        position_error: (pilot.pose().place() - place).norm(),
        goal_distance,
        map_error: Distribution::of(&map_errors),
        noticed: tally.noticed,
        map_errors,
        seconds: tally.seconds,
    }
}

/// From the middle of every cell that is taken for occupied to the nearest true surface.
pub(super) fn map_errors(map: &Map, world: &World) -> Vec<f64> {
    let cells = (0..map.rows()).flat_map(|row| (0..map.columns()).map(move |column| (column, row)));
    cells
        .filter(|&(column, row)| map.cell(column, row) == Cell::Occupied)
        .map(|(column, row)| world.clearance(map.place(column, row)).abs())
        .collect()
}
