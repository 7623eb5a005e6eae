//! What the robot knows of the floor: a raster in the start frame in which every look leaves evidence.
//!
//! Each cell holds the logarithm of the odds that something stands on it (Moravec & Elfes 1985,
//! doi:10.1109/ROBOT.1985.1087316). Evidence is bounded, so that the map can change its mind.

mod evidence;
mod grid;

use super::{Estimated, Ground, scene::Scene, world::ROBOT_RADIUS};
use evidence::{Look, OCCUPIED, SUREST};
pub use grid::CELL;
use grid::Grid;

/// The map reaches this far beyond start and goal on each side, in centimetres.
const MARGIN: f64 = 200.0;

/// The floor's owner sets the robot down where this much beyond its rim is free, in centimetres.
const FREE_AT_START: f64 = 28.0;

/// The robot takes itself to see no floor nearer than this until it has seen any, in centimetres.
const SIGHT: f64 = 60.0;

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
    grid: Grid,
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
        let grid = Grid { corner, columns, rows };
        let mut map = Self { grid, odds: vec![0.0; columns * rows], sight: SIGHT, look };
        map.free_disc(Ground::origin(), ROBOT_RADIUS + FREE_AT_START);
        map
    }

    /// Cells from left to right.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.grid.columns
    }

    /// Cells from near to far.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.grid.rows
    }

    /// What is known of a cell; nothing beyond the map's rim.
    #[must_use]
    pub fn cell(&self, column: usize, row: usize) -> Cell {
        if column >= self.columns() || row >= self.rows() {
            return Cell::Unknown;
        }
        match self.odds[row * self.columns() + column] {
            odds if odds > OCCUPIED => Cell::Occupied,
            odds if odds < FREE => Cell::Free,
            _ => Cell::Unknown,
        }
    }

    /// The middle of a cell, in the start frame.
    #[must_use]
    pub fn place(&self, column: usize, row: usize) -> Ground {
        self.grid.place(column, row)
    }

    /// The column and the row of the cell that holds a place, if the map does.
    #[must_use]
    pub fn cell_at(&self, place: Ground) -> Option<[usize; 2]> {
        self.grid.cell_at(place)
    }

    /// Adds what a pair of pictures shows, taken where the robot believes itself to be; and that nothing
    /// stands where the robot does. `weight` is how much the look counts beside a look that can be trusted, 0 to 1.
    pub fn add(&mut self, scene: &Scene, believed: &Estimated, weight: f64) {
        self.look.read((&self.grid, &self.odds), scene, believed);
        self.look.tell(&mut self.odds, weight as f32);
        self.sight = evidence::sight(scene).map_or(self.sight, |sight| sight.min(self.sight));
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
        let Grid { corner, columns, rows } = self.grid;
        let (left, near) = (first(centre.x, corner.x), first(centre.y, corner.y));
        for row in near..(near + span).min(rows) {
            for column in left..(left + span).min(columns) {
                if (self.place(column, row) - centre).norm() <= radius {
                    let odds = &mut self.odds[row * columns + column];
                    *odds = change(*odds);
                }
            }
        }
    }
}
