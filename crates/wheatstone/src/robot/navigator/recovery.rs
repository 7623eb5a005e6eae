//! What to do where driving on is not possible: look about, back up, doubt the map, and in the end
//! give up.

use super::{
    Activity, Decision, Navigator, Reason,
    following::{STEP, TURN},
};
use crate::robot::{Believed, Ground, Velocity, plan::Terrain, world::ROBOT_RADIUS, wrapped};

/// Something that takes many steps.
#[derive(Clone, Copy, Debug)]
pub(super) enum Manoeuvre {
    /// Turning in place: radians left, signed, and the heading before.
    LookAbout { left: f64, heading: f64 },
    /// Backing up: centimetres left, and the place before.
    Back { left: f64, place: Ground },
}

/// Looks in a row at unseen floor after which the robot tries something else.
const STARED: usize = 2;

/// Looks without motion during which the robot stands, and after which it gives up.
const STANDING: usize = 2;
const GIVING_UP: usize = 12;

/// How often the robot tries to find a way again before it gives up.
const RECOVERIES: usize = 8;

/// How far it backs up, in centimetres: what lies nearer than this is not seen from where it stands.
const BACK: f64 = 15.0;

/// The map is doubted within this distance, in centimetres, and by this factor: the surest obstacle is
/// no more than a guess then.
const DOUBTED: (f64, f64) = (80.0, 0.25);

/// Unseen floor that lies aside by more than this is turned to, in radians: well within the field.
const ASIDE: f64 = 0.2;

impl Navigator {
    /// Goes on with what takes many steps.
    pub(super) fn manoeuvre(&mut self, believed: &Believed, terrain: &Terrain) -> Option<Velocity> {
        match self.manoeuvre? {
            Manoeuvre::LookAbout { left, heading } => {
                let left = left - wrapped(believed.pose.heading - heading);
                let done = left.abs() < 0.5 * TURN || left * self.sense() < 0.0;
                self.manoeuvre = (!done)
                    .then_some(Manoeuvre::LookAbout { left, heading: believed.pose.heading });
                self.activity = Activity::Looking;
                let turn = left.clamp(-TURN, TURN) / self.period;
                (!done).then_some(Velocity { forward: 0.0, turn })
            }
            Manoeuvre::Back { left, place } => {
                let left = left - (believed.pose.place() - place).norm();
                let back = Velocity { forward: -0.6 * STEP / self.period, turn: 0.0 };
                let on = left > 0.0 && self.is_free(&believed.pose, back, terrain);
                let place = believed.pose.place();
                self.manoeuvre = on.then_some(Manoeuvre::Back { left, place });
                self.activity = Activity::Backing;
                on.then_some(back)
            }
        }
    }

    /// Which way the look about turns.
    fn sense(&self) -> f64 {
        if self.recoveries % 2 == 0 { -1.0 } else { 1.0 }
    }

    /// Looks at what is not seen of the next stretch of the way.
    pub(super) fn look_ahead(&mut self, believed: &Believed, terrain: &Terrain) -> Decision {
        self.stared += 1;
        let next = believed.pose.transform(Ground::new(0.0, STEP));
        let unseen = terrain.unseen_about(&self.map, next, ROBOT_RADIUS + 4.0);
        let own = unseen.map(|place| believed.pose.inverse_transform(place));
        let error = own.map_or(0.0, |own| libm::atan2(own.x, own.y));
        if self.stared <= STARED {
            if error.abs() > ASIDE {
                return self.turn(error, "the next stretch was not seen");
            }
            return self.wait("the next stretch was not seen: looking again");
        }
        self.stared = 0;
        self.recover(believed, terrain, "the next stretch stays unseen")
    }

    /// Tries to find a way again, each time by a stronger means.
    pub(super) fn recover(
        &mut self,
        believed: &Believed,
        terrain: &Terrain,
        why: &'static str,
    ) -> Decision {
        self.recoveries += 1;
        if self.recoveries > RECOVERIES {
            return self
                .stop(Reason::NoWay, "no way was found after looking about again and again");
        }
        let pose = believed.pose;
        if self.recoveries % 2 == 0 {
            self.map.doubt(pose.place(), DOUBTED.0, DOUBTED.1);
            self.manoeuvre = Some(Manoeuvre::Back { left: BACK, place: pose.place() });
            if let Some(velocity) = self.manoeuvre(believed, terrain) {
                self.why = why;
                return Decision::Drive(velocity);
            }
        }
        let left = self.sense() * std::f64::consts::TAU;
        self.manoeuvre = Some(Manoeuvre::LookAbout { left, heading: pose.heading });
        self.why = why;
        let velocity = self.manoeuvre(believed, terrain).unwrap_or(Velocity::STOP);
        Decision::Drive(velocity)
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
