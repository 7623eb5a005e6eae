//! Following a way: towards a point some way along it, on floor that is known to be free.

use super::{Activity, Decision, Navigator};
use crate::{
    Estimated, Ground, PlanarPose, Velocity, plan::Terrain, scene::Trust, world::ROBOT_RADIUS,
};

/// The robot steers for the point of its way so far ahead, in centimetres (pure pursuit: Coulter 1992,
/// CMU-RI-TR-92-01): about its own radius, so that it cuts no corner by more than a centimetre.
const AHEAD: f64 = 14.0;

/// The longest step, in centimetres.
pub(super) const STEP: f64 = 5.0;

/// The longest step beside something, on poor pictures or in doubt where the robot is.
const SLOW: f64 = 3.0;

/// The farthest turn in one step, in radians: eight degrees, a sixth of the field, so that pictures
/// overlap.
pub(super) const TURN: f64 = 0.14;

/// A direction off by more than this is turned to in place, in radians.
const ASKEW: f64 = 0.45;

/// A direction off by less than this is faced, in radians: two degrees.
const FACED: f64 = 0.035;

/// What was not seen within this distance of the next place is looked at, in centimetres: the robot's
/// radius, and what slivers and the raster take.
const UNSEEN: f64 = ROBOT_RADIUS + 4.0;

/// Clearance beyond the rim below which the robot slows down, in centimetres.
const NARROW: f64 = 4.0;

/// The robot never drives where the map leaves less than this beside it, in centimetres: less than ways
/// keep, as it strays from them.
const LEAST: f64 = 1.2;

/// It stops within this distance beyond a step, in centimetres, which must be free as well.
const BRAKING: f64 = 3.0;

/// Distances over the raster are met to this, in centimetres: a quarter of a cell.
const GRAIN: f64 = 0.5;

/// Beyond these standard deviations the robot goes slowly: centimetres and radians. At that, an
/// obstacle seen some steps ago may stand beside the robot instead.
const DOUBT: [f64; 2] = [12.0, 0.12];

impl Navigator {
    /// The next step along the way.
    pub(super) fn follow(
        &mut self,
        believed: &Estimated,
        terrain: &Terrain,
        trust: Trust,
    ) -> Decision {
        let target = self.target();
        let own = believed.pose.inverse_transform(target);
        let error = libm::atan2(own.x, own.y);
        if error.abs() > ASKEW {
            return self.turn(error, "the way leads aside");
        }
        let longest = self.longest_step(believed, terrain, trust).min(own.coords.norm());
        for length in [longest, 0.6 * longest] {
            let bend = 2.0 * own.x / own.coords.norm_squared().max(1.0);
            let velocity = Velocity {
                forward: length / self.period,
                turn: (bend * length).clamp(-TURN, TURN) / self.period,
            };
            if self.is_free(&believed.pose, velocity, terrain) {
                self.activity = Activity::Driving;
                self.why = if longest < STEP { "slowly along the way" } else { "along the way" };
                self.stared = 0;
                return Decision::Drive(velocity);
            }
        }
        let reach = own.coords.norm().min(STEP + BRAKING);
        let next = own.coords.normalize() * reach;
        let next = believed.pose.transform(Ground::from(next));
        if let Some(unseen) = terrain.unseen_about(&self.map, next, UNSEEN) {
            return self.look_at(believed, terrain, unseen);
        }
        if error.abs() > FACED {
            return self.turn(error, "turning to the way before driving on");
        }
        self.recover(believed, "something stands on the way")
    }

    /// A place on the way, [`AHEAD`] along it.
    fn target(&self) -> Ground {
        let mut left = AHEAD;
        for ends in self.way.places.windows(2) {
            let along = ends[1] - ends[0];
            if along.norm() >= left {
                return ends[0] + along.normalize() * left;
            }
            left -= along.norm();
        }
        self.way.places.last().copied().unwrap_or(self.goal)
    }

    fn longest_step(&self, believed: &Estimated, terrain: &Terrain, trust: Trust) -> f64 {
        let covariance = &believed.covariance;
        let far = covariance.m11 + covariance.m22 > DOUBT[0].powi(2);
        let turned = covariance.m33 > DOUBT[1].powi(2);
        let here = believed.pose.transform(Ground::new(0.0, STEP));
        let narrow = terrain.clearance(&self.map, here) < ROBOT_RADIUS + NARROW;
        if far || turned || narrow || trust == Trust::Poor { SLOW } else { STEP }
    }

    /// Whether a step leads over floor that is known to be free, braking included.
    pub(super) fn is_free(&self, pose: &PlanarPose, velocity: Velocity, terrain: &Terrain) -> bool {
        let fields = |place| [terrain.clearance(&self.map, place), terrain.sure(&self.map, place)];
        // Where the robot already stands too near, it may go on as near as that. What is below it is
        // known to be free, so that it meets nothing by that.
        let here = fields(pose.place());
        let near = here[0].min(ROBOT_RADIUS + LEAST + self.doubt) - 1e-6;
        let sure = here[1].min(ROBOT_RADIUS) - GRAIN;
        let length = velocity.forward.abs() * self.period;
        let seconds = self.period * (length + BRAKING) / length.max(1e-9);
        const PARTS: usize = 4;
        (1..=PARTS).all(|part| {
            let along = velocity.motion(seconds * part as f64 / PARTS as f64);
            let there = fields(pose.then(&along).place());
            there[0] >= near && there[1] >= sure
        })
    }

    pub(super) fn turn(&mut self, error: f64, why: &'static str) -> Decision {
        self.activity = Activity::Turning;
        self.why = why;
        Decision::Drive(Velocity { forward: 0.0, turn: error.clamp(-TURN, TURN) / self.period })
    }
}
