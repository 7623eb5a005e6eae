//! What the robot knows of the floor: a raster in the start frame in which every look leaves evidence.
//!
//! Each cell holds the logarithm of the odds that something stands on it (Moravec & Elfes 1985,
//! doi:10.1109/ROBOT.1985.1087316). Evidence is bounded, so that the map can change its mind.

mod evidence;
#[cfg(test)]
mod tests;

use super::{Estimated, Ground, scene::Scene, world::ROBOT_RADIUS};
use evidence::Look;

/// The side of a cell, in centimetres: a seventh of what the narrowest gap leaves beside the robot.
pub const CELL: f64 = 2.0;

/// The map reaches this far beyond start and goal on each side, in centimetres.
const MARGIN: f64 = 200.0;

/// The floor's owner sets the robot down where this much beyond its rim is free, in centimetres.
const FREE_AT_START: f64 = 28.0;

/// The robot takes itself to see no floor nearer than this until it has seen any, in centimetres.
const SIGHT: f64 = 60.0;

/// Log odds stay between these. Floor that was seen free becomes an obstacle by two looks that agree,
/// and the surest obstacle becomes free floor by six.
const SUREST: [f32; 2] = [-2.4, 4.0];

/// Above this something stands there: more than one lone point tells ([`evidence`]).
const OCCUPIED: f32 = 1.0;

/// Below this nothing does: two looks that missed an obstacle are not enough, three are.
const FREE: f32 = -2.0;

/// What is known of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cell {
    /// Nothing, or nothing certain.
    #[default]
    Unknown,
    /// Nothing stands there.
    Free,
    /// Something does.
    Occupied,
}

/// A raster of the floor in the start frame.
#[derive(Clone, Debug)]
pub struct Map {
    /// The corner with the least x and z.
    corner: Ground,
    columns: usize,
    rows: usize,
    /// Log odds that something stands there, row by row.
    odds: Vec<f32>,
    /// See [`Map::sight`].
    sight: f64,
    /// What one look says, kept for its memory.
    look: Look,
}

impl Map {
    /// A map that holds the start, the goal and what lies about them; nothing is known but that the
    /// floor about the start is free.
    #[must_use]
    pub fn new(goal: Ground) -> Self {
        let corner = Ground::new(goal.x.min(0.0) - MARGIN, goal.y.min(0.0) - MARGIN);
        let cells = |length: f64| ((length.abs() + 2.0 * MARGIN) / CELL).ceil() as usize;
        let (columns, rows) = (cells(goal.x), cells(goal.y));
        let look = Look::new(columns * rows);
        let mut map =
            Self { corner, columns, rows, odds: vec![0.0; columns * rows], sight: SIGHT, look };
        map.free_disc(Ground::origin(), ROBOT_RADIUS + FREE_AT_START);
        map
    }

    /// Cells from left to right.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Cells from near to far.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// What is known of a cell; nothing beyond the map's rim.
    #[must_use]
    pub fn cell(&self, column: usize, row: usize) -> Cell {
        if column >= self.columns || row >= self.rows {
            return Cell::Unknown;
        }
        match self.odds[row * self.columns + column] {
            odds if odds > OCCUPIED => Cell::Occupied,
            odds if odds < FREE => Cell::Free,
            _ => Cell::Unknown,
        }
    }

    /// The middle of a cell, in the start frame.
    #[must_use]
    pub fn place(&self, column: usize, row: usize) -> Ground {
        let along = |first: f64, index: usize| first + (index as f64 + 0.5) * CELL;
        Ground::new(along(self.corner.x, column), along(self.corner.y, row))
    }

    /// The column and the row of the cell that holds a place, if the map does.
    #[must_use]
    pub fn cell_at(&self, place: Ground) -> Option<[usize; 2]> {
        let (x, z) = ((place.x - self.corner.x) / CELL, (place.y - self.corner.y) / CELL);
        let within = x >= 0.0 && z >= 0.0 && x < self.columns as f64 && z < self.rows as f64;
        within.then_some([x as usize, z as usize])
    }

    /// The index of the cell that holds a place, row by row.
    fn index_at(&self, place: Ground) -> Option<usize> {
        self.cell_at(place).map(|[column, row]| row * self.columns + column)
    }

    /// Adds what a pair of pictures shows, taken where the robot believes itself to be; and that nothing
    /// stands where the robot does. `weight` is how much the look counts beside a look that can be trusted, 0 to 1.
    pub fn add(&mut self, scene: &Scene, believed: &Estimated, weight: f64) {
        let mut look = std::mem::take(&mut self.look);
        look.read(self, scene, believed);
        look.tell(&mut self.odds, weight as f32);
        self.sight = evidence::sight(scene).map_or(self.sight, |sight| sight.min(self.sight));
        self.look = look;
        self.free_disc(believed.pose.place(), ROBOT_RADIUS - 0.5 * CELL);
    }

    /// What lies nearer to the robot's middle than this it does not see, in centimetres, whichever way
    /// it turns: learnt from where the stretches that it saw begin.
    #[must_use]
    pub fn sight(&self) -> f64 {
        self.sight
    }

    /// Makes obstacles within a radius of a place less certain by a factor, so that the next looks
    /// decide.
    pub fn doubt(&mut self, centre: Ground, radius: f64, factor: f64) {
        self.change_disc(centre, radius, |odds| odds.min(odds * factor as f32));
    }

    /// Takes what was not seen within a radius of a place half for an obstacle: it was looked at, and
    /// shows nothing. Twice is enough to bar the way until it is seen to be free.
    pub fn suspect(&mut self, centre: Ground, radius: f64) {
        let unknown = FREE..=OCCUPIED;
        let more = 0.6 * OCCUPIED;
        self.change_disc(centre, radius, |odds| {
            if unknown.contains(&odds) { odds.max(0.0) + more } else { odds }
        });
    }

    /// Makes a disc known free.
    fn free_disc(&mut self, centre: Ground, radius: f64) {
        self.change_disc(centre, radius, |_| SUREST[0]);
    }

    fn change_disc(&mut self, centre: Ground, radius: f64, change: impl Fn(f32) -> f32) {
        let first = |place: f64, corner: f64| ((place - radius - corner) / CELL).max(0.0) as usize;
        let span = (2.0 * radius / CELL) as usize + 2;
        let (left, near) = (first(centre.x, self.corner.x), first(centre.y, self.corner.y));
        for row in near..(near + span).min(self.rows) {
            for column in left..(left + span).min(self.columns) {
                if (self.place(column, row) - centre).norm() <= radius {
                    let odds = &mut self.odds[row * self.columns + column];
                    *odds = change(*odds);
                }
            }
        }
    }
}
