//! A walled floor of tiles with boxes and cylinders on it, all with plain faces, and a robot that stands
//! somewhere in it: what is true, which the robot never learns.

mod eye;
mod layout;
mod surfaces;

pub use eye::{Board, Eye};

use super::Ground;
use serde::{Deserialize, Serialize};

/// Half the robot's width, in centimetres: it is round.
pub const ROBOT_RADIUS: f64 = 12.0;

/// The narrowest gap on the way that a world must offer, in centimetres: 1.6 robot widths.
pub const NARROWEST: f64 = 1.6 * 2.0 * ROBOT_RADIUS;

/// The narrowest gap in a simple world, in centimetres: three robot widths.
pub const WIDE: f64 = 3.0 * 2.0 * ROBOT_RADIUS;

/// From the start to the goal, in centimetres.
pub const DISTANCE: f64 = 300.0;

/// No obstacle is lower than this, in centimetres: what the floor's owner promises to the robot.
pub const LOWEST_OBSTACLE: f64 = 15.0;

/// The outline of an obstacle on the floor, about its own centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Footprint {
    /// Half the sides of a rectangle, in centimetres.
    Box([f64; 2]),
    /// The radius of a circle, in centimetres.
    Cylinder(f64),
}

/// A box or a cylinder on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Obstacle {
    /// Its outline.
    pub footprint: Footprint,
    /// Where its centre stands, in the start frame.
    pub centre: [f64; 2],
    /// How far it is turned to the right, in radians.
    pub turn: f64,
    /// In centimetres.
    pub height: f64,
    /// How much light its faces return, 0 to 1: ahead and behind, sides, top.
    pub shades: [f64; 3],
}

impl Obstacle {
    /// A place on the floor in the obstacle's own frame.
    #[must_use]
    pub fn own(&self, place: Ground) -> Ground {
        let (sine, cosine) = (libm::sin(self.turn), libm::cos(self.turn));
        let (x, z) = (place.x - self.centre[0], place.y - self.centre[1]);
        Ground::new(x * cosine - z * sine, x * sine + z * cosine)
    }

    /// From a place to the outline, in centimetres; negative inside.
    #[must_use]
    pub fn distance(&self, place: Ground) -> f64 {
        let own = self.own(place);
        match self.footprint {
            Footprint::Cylinder(radius) => own.coords.norm() - radius,
            Footprint::Box(half) => {
                let (x, z) = (own.x.abs() - half[0], own.y.abs() - half[1]);
                let outside = (x.max(0.0).powi(2) + z.max(0.0).powi(2)).sqrt();
                outside + x.max(z).min(0.0)
            }
        }
    }

    /// The radius of the circle about its centre that holds its outline.
    #[must_use]
    pub fn reach(&self) -> f64 {
        match self.footprint {
            Footprint::Cylinder(radius) => radius,
            Footprint::Box([x, z]) => (x * x + z * z).sqrt(),
        }
    }
}

/// Square tiles of two shades, like a chessboard.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tiles {
    /// The side of a tile, in centimetres.
    pub side: f64,
    /// How far the rows are turned to the right, in radians.
    pub turn: f64,
    /// Where a corner lies, in the start frame.
    pub corner: [f64; 2],
    /// How much light they return, 0 to 1.
    pub shades: [f64; 2],
}

/// Everything that is true of a place, in the start frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// The seed that it was made from.
    pub seed: u64,
    /// Inner faces of the walls: left (x), right (x), behind (z), ahead (z).
    pub walls: [f64; 4],
    /// Height of the walls, in centimetres.
    pub wall_height: f64,
    /// The walls are panels of these two shades by turns, so wide.
    pub panels: ([f64; 2], f64),
    /// The floor.
    pub tiles: Tiles,
    /// What stands on it.
    pub obstacles: Vec<Obstacle>,
    /// Where the robot is told to go.
    pub goal: [f64; 2],
}

impl World {
    /// The world of a seed: 6 to 12 obstacles, and a way from the start to the goal in which no gap is
    /// narrower than [`NARROWEST`]. In every second one the way leads through a gap about as narrow.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        layout::world(seed)
    }

    /// A simple world, as the 2001 paper's robot had: two to four square boxes, black or white, and a way
    /// to the goal in which no gap is narrower than [`WIDE`].
    #[must_use]
    pub fn simple(seed: u64) -> Self {
        layout::simple(seed)
    }

    /// From a place to the nearest wall or obstacle, in centimetres; negative inside.
    #[must_use]
    pub fn clearance(&self, place: Ground) -> f64 {
        let [left, right, behind, ahead] = self.walls;
        let walls =
            (place.x - left).min(right - place.x).min(place.y - behind).min(ahead - place.y);
        self.obstacles.iter().map(|obstacle| obstacle.distance(place)).fold(walls, f64::min)
    }

    /// Where the robot is told to go.
    #[must_use]
    pub fn goal(&self) -> Ground {
        Ground::from(self.goal)
    }
}
