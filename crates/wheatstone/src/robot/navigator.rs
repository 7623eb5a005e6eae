//! From what is seen and where the robot believes itself to be, to what its wheels shall do next.

use super::{
    Believed, Ground, Velocity,
    map::Map,
    scene::{Scene, Trust},
    wrapped,
};

/// What the robot shall do next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// Drive so until the next pictures.
    Drive(Velocity),
    /// Nothing more: the goal is reached, as far as the robot believes.
    Arrived,
    /// Nothing more: it cannot go on.
    Stopped(Reason),
}

/// Why the robot gave up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The pictures contradict the calibration.
    Broken,
    /// Its own motion is not found any more.
    Lost,
    /// No way leads to the goal, or none that it dares.
    NoWay,
    /// It has taken as many steps as it may.
    TooLong,
}

/// What the robot is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Activity {
    /// It looks about before it moves, or because it does not know where to go.
    #[default]
    Looking,
    /// It turns in place towards its way.
    Turning,
    /// It drives along its way.
    Driving,
    /// It backs away over floor that it knows.
    Backing,
    /// It stands because its pictures say too little.
    Waiting,
    /// It has arrived.
    Arrived,
    /// It has given up.
    Stopped,
}

/// Finds the way to a goal from what is seen.
#[derive(Clone, Debug)]
pub struct Navigator {
    goal: Ground,
    period: f64,
    map: Map,
    path: Vec<Ground>,
    activity: Activity,
    why: &'static str,
    steps: usize,
}

impl Navigator {
    /// A navigator to a goal in the start frame, for a vehicle with so many seconds from one command to
    /// the next ([`super::Vehicle::period`]).
    #[must_use]
    pub fn new(goal: Ground, period: f64) -> Self {
        Self {
            goal,
            period,
            map: Map::new(goal),
            path: Vec::new(),
            activity: Activity::default(),
            why: "it has seen nothing yet",
            steps: 0,
        }
    }

    /// What to do after a look: what it shows, and where the robot believes it was taken, or `None`
    /// where its own motion was not found.
    pub fn step(&mut self, scene: &Scene, motion: Option<&Believed>) -> Decision {
        self.steps += 1;
        let Some(believed) = motion else {
            return Decision::Drive(Velocity::STOP);
        };
        if scene.trust == Trust::Broken {
            return Decision::Stopped(Reason::Broken);
        }
        self.map.add(scene, believed, 1.0);
        self.path = vec![believed.pose.place(), self.goal];
        let away = believed.pose.inverse_transform(self.goal);
        if away.coords.norm() < 8.0 {
            self.activity = Activity::Arrived;
            return Decision::Arrived;
        }
        let error = wrapped(libm::atan2(away.x, away.y));
        self.activity = if error.abs() > 0.3 { Activity::Turning } else { Activity::Driving };
        let forward = if error.abs() > 0.3 { 0.0 } else { 5.0 };
        Decision::Drive(Velocity {
            forward: forward / self.period,
            turn: error.clamp(-0.14, 0.14) / self.period,
        })
    }

    /// What is known of the floor.
    #[must_use]
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The way planned, from the robot to the goal; empty where none is known.
    #[must_use]
    pub fn path(&self) -> &[Ground] {
        &self.path
    }

    /// What the robot is about.
    #[must_use]
    pub fn activity(&self) -> Activity {
        self.activity
    }

    /// Why it is about that, in words.
    #[must_use]
    pub fn why(&self) -> &str {
        self.why
    }

    /// How many looks it has taken.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }
}
