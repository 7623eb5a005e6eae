//! From what is seen and where the robot believes itself to be, to what its wheels shall do next: a
//! state machine that always ends.

mod following;
mod recovery;

use super::{
    Estimated, Ground, Velocity,
    map::Map,
    plan::{MARGIN, Path, TIGHT, Terrain},
    scene::{Scene, Trust},
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

/// The goal is reached within this distance of it, in centimetres...
const ARRIVED: f64 = 8.0;

/// ... and where nothing is in the way, the robot goes on to within this: a step's length.
const CLOSE: f64 = 4.0;

/// Looks in a row that contradict the calibration, after which the robot stops for good: one may be a
/// picture torn in transmission.
const BROKEN: usize = 3;

/// Looks after which the robot gives up: three times what the longest of three hundred ways took.
const MOST_STEPS: usize = 1000;

/// A look that says little counts half.
const POOR: f64 = 0.5;

/// A new way is taken where the old one costs so much more: less would have the robot waver between two
/// ways as each look changes their costs a little.
const WAVER: f64 = 1.1;

/// Where no way leads to the goal, one is worth its steps that leads so much nearer to it, in centimetres: a
/// body's radius.
const NEARER: f64 = 12.0;

/// A robot farther than this from its way has lost it, in centimetres: half a body.
const ASTRAY: f64 = 6.0;

/// Something that takes many steps.
#[derive(Clone, Copy, Debug)]
enum Command {
    /// Turning in place: radians left, signed, and the heading before.
    LookAbout { left: f64, heading: f64 },
    /// Backing up from a place that was not seen, centimetres at most.
    Back { left: f64, unseen: Ground },
    /// Turning to a place that was not seen.
    Face { unseen: Ground },
}

/// Finds the way to a goal from what is seen.
#[derive(Clone, Debug)]
pub struct Navigator {
    goal: Ground,
    period: f64,
    map: Map,
    way: Path,
    activity: Activity,
    why: &'static str,
    steps: usize,
    end: Option<Decision>,
    /// What is being done that takes many steps.
    command: Option<Command>,
    /// Looks in a row that contradicted the calibration, and whose motion was not found.
    broken: usize,
    lost: usize,
    recoveries: usize,
    /// Looks in a row at floor that stayed unseen.
    stared: usize,
    last: Velocity,
    /// What ways keep beyond the usual margins, in centimetres.
    doubt: f64,
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
            way: Path::default(),
            activity: Activity::default(),
            why: "nothing was seen yet",
            steps: 0,
            end: None,
            command: None,
            broken: 0,
            lost: 0,
            recoveries: 0,
            stared: 0,
            last: Velocity::STOP,
            doubt: 0.0,
        }
    }

    /// Keeps so much more distance from what stands on the floor, in centimetres: the error of the map that
    /// says where it stands.
    #[must_use]
    pub fn with_doubt(self, doubt: f64) -> Self {
        Self { doubt, ..self }
    }

    /// What to do after a look: what it shows, and where the robot believes it was taken, or `None`
    /// where its own motion was not found. What has ended stays so.
    pub fn step(&mut self, scene: &Scene, motion: Option<&Estimated>) -> Decision {
        if let Some(end) = self.end {
            return end;
        }
        self.steps += 1;
        let decision = self.decide(scene, motion);
        match decision {
            // What the robot does when it is lost it does not undo.
            Decision::Drive(velocity) if self.lost == 0 => self.last = velocity,
            Decision::Drive(_) => {}
            Decision::Arrived => self.activity = Activity::Arrived,
            Decision::Stopped(_) => self.activity = Activity::Stopped,
        }
        self.end = (!matches!(decision, Decision::Drive(_))).then_some(decision);
        decision
    }

    fn decide(&mut self, scene: &Scene, motion: Option<&Estimated>) -> Decision {
        if self.steps > MOST_STEPS {
            return self.stop(Reason::TooLong, "as many steps were taken as may be");
        }
        if scene.trust == Trust::Broken {
            self.broken += 1;
            return if self.broken >= BROKEN {
                self.stop(Reason::Broken, "the pictures contradict the calibration")
            } else {
                self.wait("the pictures contradict the calibration: looking again")
            };
        }
        self.broken = 0;
        let Some(believed) = motion else {
            return self.lost();
        };
        self.lost = 0;
        let weight = if scene.trust == Trust::Poor { POOR } else { 1.0 };
        self.map.add(scene, believed, weight);
        let terrain = Terrain::new(&self.map, MARGIN + self.doubt);
        if self.arrived(believed, &terrain) {
            self.why = "the goal is here";
            return Decision::Arrived;
        }
        if let Some(velocity) = self.command(believed, &terrain) {
            return Decision::Drive(velocity);
        }
        if self.plan(believed, &terrain) {
            return self.follow(believed, &terrain, scene.trust);
        }
        let tight = Terrain::new(&self.map, TIGHT + self.doubt);
        if self.plan(believed, &tight) {
            return self.follow(believed, &tight, scene.trust);
        }
        if self.approach(believed, &terrain) {
            return self.follow(believed, &terrain, scene.trust);
        }
        self.recover(believed, "no way is known")
    }

    /// Whether the robot is as near to the goal as it will come.
    fn arrived(&self, believed: &Estimated, terrain: &Terrain) -> bool {
        let own = believed.pose.inverse_transform(self.goal);
        let distance = own.coords.norm();
        // What lies aside or behind would take turning on the spot.
        let ahead = own.y > 0.5 * distance;
        let free = terrain.sure(&self.map, self.goal) > super::world::ROBOT_RADIUS;
        distance < CLOSE || distance < ARRIVED && !(ahead && free)
    }

    /// Plans the way, or keeps the one there is; whether there is one.
    fn plan(&mut self, believed: &Estimated, terrain: &Terrain) -> bool {
        let from = believed.pose.place();
        let (rest, astray) = terrain.rest(&self.map, &self.way, from);
        let new = terrain.way(&self.map, from, self.goal).unwrap_or_default();
        let keep = rest.whole && astray < ASTRAY && rest.cost <= WAVER * new.cost;
        self.way = if keep { rest } else { new };
        self.way.whole
    }

    /// Plans a way to as near to the goal as the map leaves one, where that is any nearer: what bars the goal
    /// from afar may prove a mistake from there. Whether there is one.
    fn approach(&mut self, believed: &Estimated, terrain: &Terrain) -> bool {
        let from = believed.pose.place();
        self.way = terrain.way(&self.map, from, self.goal).unwrap_or_default();
        let away = |place: &Ground| (place - self.goal).norm();
        self.way.places.last().is_some_and(|end| away(end) + NEARER < away(&from))
    }

    fn stop(&mut self, reason: Reason, why: &'static str) -> Decision {
        self.why = why;
        Decision::Stopped(reason)
    }

    fn wait(&mut self, why: &'static str) -> Decision {
        self.activity = Activity::Waiting;
        self.why = why;
        Decision::Drive(Velocity::STOP)
    }

    /// What is known of the floor.
    #[must_use]
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The way planned, from the robot to the goal or as near to it as one is known.
    #[must_use]
    pub fn path(&self) -> &[Ground] {
        &self.way.places
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
