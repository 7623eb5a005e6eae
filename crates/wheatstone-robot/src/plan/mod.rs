//! A way over the map to the goal: distances to what stands on the floor, the cheapest way over the
//! raster, and that way made straight.

mod distance;
mod search;
mod terrain;

pub use terrain::{MARGIN, TIGHT, Terrain};

use super::{
    Ground,
    map::{CELL, Map},
};
use search::search;

/// A robot that stands nearer to something than ways lead may still leave: within this distance of
/// where it stands, in centimetres, ways may lead as near as that.
const LEAVING: f64 = 16.0;

/// Floor that was not seen and is too near to be seen costs so much more: the way had better lead
/// elsewhere, if only until it comes into sight.
const TOO_NEAR: f32 = 4.0;

/// A straight stretch may cost so much more than the way over the raster that it replaces, whose steps
/// have eight directions only.
const SHORTCUT: f64 = 1.01;

/// A way to the goal, or towards it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// Where it bends, from the robot's place to its end.
    pub places: Vec<Ground>,
    /// What it costs: its length in centimetres, more where it is narrow or was not seen.
    pub cost: f64,
    /// Whether it ends at the goal.
    pub whole: bool,
}

impl Terrain {
    /// The cheapest way, if the map leaves any; else one to the place nearest to the goal that it leaves.
    #[must_use]
    pub fn way(&self, map: &Map, from: Ground, goal: Ground) -> Option<Path> {
        let index = |place| map.cell_at(place).map(|[column, row]| row * self.columns + column);
        let (start, end) = (index(from)?, index(goal)?);
        let cost = |cell: usize| self.cost_near(map, from, cell);
        let (cells, whole) = search(self, start, end, cost);
        let mut places: Vec<Ground> = cells.iter().map(|&cell| self.place(map, cell)).collect();
        places[0] = from;
        if let Some(last) = places.last_mut().filter(|_| whole) {
            *last = goal;
        }
        let places = self.straightened(map, &places, from);
        let cost = self.cost(map, &places);
        Some(Path { places, cost, whole })
    }

    /// What is left of a way for a robot that has come to a place: it goes on from the nearest of the
    /// way's stretches. Also how far from the way that is, in centimetres.
    #[must_use]
    pub fn rest(&self, map: &Map, way: &Path, from: Ground) -> (Path, f64) {
        let foot = |ends: &[Ground]| {
            let along = ends[1] - ends[0];
            let part = (from - ends[0]).dot(&along) / along.norm_squared().max(1e-12);
            (ends[0] + along * part.clamp(0.0, 1.0) - from).norm()
        };
        let mut nearest = (0, f64::INFINITY);
        for (at, ends) in way.places.windows(2).enumerate() {
            let away = foot(ends);
            if away < nearest.1 {
                nearest = (at, away);
            }
        }
        let mut places = vec![from];
        places.extend(way.places.iter().skip(nearest.0 + 1));
        let cost = self.cost(map, &places);
        (Path { places, cost, whole: way.whole }, nearest.1)
    }

    /// What it costs to follow these places; infinite where something bars the way.
    #[must_use]
    pub fn cost(&self, map: &Map, places: &[Ground]) -> f64 {
        let Some(&from) = places.first() else {
            return f64::INFINITY;
        };
        places.windows(2).map(|ends| self.straight(map, from, ends[0], ends[1])).sum()
    }

    fn place(&self, map: &Map, cell: usize) -> Ground {
        map.place(cell % self.columns, cell / self.columns)
    }

    /// What a centimetre costs on a cell for a robot that stands at `from`.
    fn cost_near(&self, map: &Map, from: Ground, cell: usize) -> f32 {
        let cost = self.costs[cell];
        if cost.is_finite() && self.is_sure(cell) {
            return cost;
        }
        match (self.place(map, cell) - from).norm() {
            away if cost.is_finite() && away < map.sight() => cost * TOO_NEAR,
            away if !cost.is_finite() && away < LEAVING => self.cost_of_leaving(map, from, cell),
            _ => cost,
        }
    }

    /// What a straight stretch costs for a robot that stands at `from`.
    fn straight(&self, map: &Map, from: Ground, start: Ground, end: Ground) -> f64 {
        let parts = ((end - start).norm() / (0.5 * CELL)).ceil().max(1.0) as usize;
        let part = (end - start) / parts as f64;
        let at = |index: usize| {
            let [column, row] = map.cell_at(start + part * (index as f64 + 0.5))?;
            Some(self.cost_near(map, from, row * self.columns + column))
        };
        let sum: f64 = (0..parts).map(|i| at(i).map_or(f64::INFINITY, f64::from)).sum();
        sum * part.norm()
    }

    /// As few straight stretches as cost no more than the way itself.
    fn straightened(&self, map: &Map, way: &[Ground], from: Ground) -> Vec<Ground> {
        let mut places = vec![way[0]];
        let mut at = 0;
        while at + 1 < way.len() {
            let mut reach = at + 1;
            let mut along = self.straight(map, from, way[at], way[reach]);
            for next in at + 2..way.len() {
                along += self.straight(map, from, way[next - 1], way[next]);
                if self.straight(map, from, way[at], way[next]) <= SHORTCUT * along {
                    reach = next;
                }
            }
            places.push(way[reach]);
            at = reach;
        }
        places
    }
}
