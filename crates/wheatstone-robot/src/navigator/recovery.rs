//! What to do where driving on is not possible: look about, back up, doubt the map, and in the end
//! give up.

use super::{Activity, Command, Decision, Navigator, Reason, following::TURN};
use crate::{Estimated, Ground, Velocity, plan::Terrain, wrapped};

/// Looks in a row at unseen floor after which the robot tries something else.
const STARED: usize = 1;

/// What stays unseen within this distance of what was looked at is suspected, in centimetres: half a
/// body.
const SUSPECTED: f64 = 6.0;

/// Looks without motion during which the robot stands, and after which it gives up.
const STANDING: usize = 2;
const GIVING_UP: usize = 12;

/// How often the robot tries to find a way again before it gives up.
const RECOVERIES: usize = 8;

/// The robot backs up until it observes what was too near, but so far at most, and by so much a step, in
/// centimetres.
const BACK: f64 = 24.0;
const BACKING: f64 = 4.0;

/// Every third time it doubts its map: what it takes for an obstacle may be a mistake that it does not
/// see again from where it stands.
const DOUBTING: usize = 3;

/// The map is doubted within this distance, in centimetres, and by this factor: the surest obstacle is
/// no more than a guess then.
const DOUBTED: (f64, f64) = (80.0, 0.25);

/// Unseen floor that lies aside by more than this is turned to, in radians: well within the field.
const ASIDE: f64 = 0.2;

impl Navigator {
    /// Goes on with what takes many steps.
    pub(super) fn command(&mut self, believed: &Estimated, terrain: &Terrain) -> Option<Velocity> {
        match self.command? {
            Command::LookAbout { left, heading } => {
                let left = left - wrapped(believed.pose.heading - heading);
                let done = left.abs() < 0.5 * TURN;
                self.command =
                    (!done).then_some(Command::LookAbout { left, heading: believed.pose.heading });
                self.activity = Activity::Looking;
                let turn = left.clamp(-TURN, TURN) / self.period;
                (!done).then_some(Velocity { forward: 0.0, turn })
            }
            Command::Back { left, unseen } => {
                let back = Velocity { forward: -BACKING / self.period, turn: 0.0 };
                let far = (believed.pose.place() - unseen).norm() > self.map.sight();
                if far || left <= 0.0 || !self.is_free(&believed.pose, back, terrain) {
                    self.command = Some(Command::Face { unseen });
                    return self.command(believed, terrain);
                }
                self.command = Some(Command::Back { left: left - BACKING, unseen });
                self.activity = Activity::Backing;
                Some(back)
            }
            Command::Face { unseen } => {
                let own = believed.pose.inverse_transform(unseen);
                let error = libm::atan2(own.x, own.y);
                let on = error.abs() > ASIDE;
                self.command = on.then_some(Command::Face { unseen });
                self.activity = Activity::Looking;
                let turn = error.clamp(-TURN, TURN) / self.period;
                on.then_some(Velocity { forward: 0.0, turn })
            }
        }
    }

    /// Looks at a place on the next stretch of the way that was not seen.
    pub(super) fn look_at(
        &mut self,
        believed: &Estimated,
        terrain: &Terrain,
        unseen: Ground,
    ) -> Decision {
        let own = believed.pose.inverse_transform(unseen);
        let error = libm::atan2(own.x, own.y);
        let near = own.coords.norm() < self.map.sight();
        if !near && error.abs() > ASIDE {
            return self.turn(error, "the next stretch was not seen");
        }
        self.stared += 1;
        if self.stared <= STARED {
            return self.wait("the next stretch was not seen: looking again");
        }
        self.map.suspect(unseen, SUSPECTED);
        if near && self.stared == STARED + 1 {
            self.command = Some(Command::Back { left: BACK, unseen });
            if let Some(velocity) = self.command(believed, terrain) {
                self.why = "backing up to see the next stretch";
                return Decision::Drive(velocity);
            }
        }
        self.stared = 0;
        self.recover(believed, "the next stretch stays unseen")
    }

    /// Tries to find a way again by looking about, after which the map is believed less and less.
    pub(super) fn recover(&mut self, believed: &Estimated, why: &'static str) -> Decision {
        self.recoveries += 1;
        if self.recoveries > RECOVERIES {
            return self
                .stop(Reason::NoWay, "no way was found after looking about again and again");
        }
        let pose = believed.pose;
        if self.recoveries.is_multiple_of(DOUBTING) {
            self.map.doubt(pose.place(), DOUBTED.0, DOUBTED.1);
        }
        let sense = if self.recoveries.is_multiple_of(2) { -1.0 } else { 1.0 };
        let left = sense * std::f64::consts::TAU;
        self.command = Some(Command::LookAbout { left, heading: pose.heading });
        self.activity = Activity::Looking;
        self.why = why;
        Decision::Drive(Velocity { forward: 0.0, turn: sense * TURN / self.period })
    }

    /// Stands, then turns back to where it last knew its motion.
    pub(super) fn lost(&mut self) -> Decision {
        self.lost += 1;
        if self.lost > GIVING_UP {
            return self.stop(Reason::Lost, "its own motion is not found any more");
        }
        if self.lost <= STANDING {
            return self.wait("its own motion was not found: looking again");
        }
        let sense = if self.last.turn > 0.0 { -1.0 } else { 1.0 };
        self.turn(sense * 0.5 * TURN, "its own motion was not found: turning back")
    }
}
