//! How far each place is from what the robot must not touch, and what a way over it costs.

use super::distance::distances;
use crate::{
    Ground,
    map::{CELL, Cell, Map},
    world::ROBOT_RADIUS,
};
use nalgebra::Vector2;

/// Ways keep this far from what stands on the floor, beyond the robot's rim, in centimetres: the
/// narrowest gap leaves 7.2 beside the robot, and smeared edges and the raster take 3 of them.
pub const MARGIN: f64 = 3.5;

/// Where no way keeps that, they keep this: what the robot strays from its way, and the raster.
pub const TIGHT: f64 = 2.0;

/// Nearer than this beyond its rim the robot rather keeps away, in centimetres: what is left beside it
/// then covers how far it strays from its way ten times over.
const COMFORT: f32 = 14.0;

/// A centimetre on the margin costs so much more than one in the open. Ways through the narrowest gaps
/// must stay cheaper than a detour of a few gaps' lengths.
const NEARNESS: f32 = 6.0;

/// A centimetre over floor that was not seen costs so much: it may prove barred.
const UNSEEN: f32 = 1.8;

/// Floor that was not seen counts where a disc of this radius fits into it, in centimetres: thinner
/// slivers between what was seen hide nothing that stands on the floor.
const SLIVER: f32 = 4.0;

/// Distances are measured so far and no farther, in cells: to where nearness costs nothing any more,
/// and as far as slivers are thick.
const REACH: usize = 16;
const NEAR: usize = 4;

/// Distances and costs over the map, as it is at one moment.
#[derive(Clone, Debug)]
pub struct Terrain {
    pub(super) columns: usize,
    /// To the nearest cell on which something stands, in centimetres.
    clearance: Vec<f32>,
    /// Whether a cell lies where something may stand unseen.
    hidden: Vec<bool>,
    /// To the nearest cell on which something stands or may stand.
    sure: Vec<f32>,
    /// What a centimetre costs; infinite where no way may lead.
    pub(super) costs: Vec<f32>,
}

impl Terrain {
    /// The terrain of a map; ways keep `margin` beyond the robot's rim, in centimetres.
    #[must_use]
    pub fn new(map: &Map, margin: f64) -> Self {
        let columns = map.columns();
        let cells = || (0..map.rows()).flat_map(|z| (0..columns).map(move |x| map.cell(x, z)));
        let occupied: Vec<bool> = cells().map(|cell| cell == Cell::Occupied).collect();
        let known: Vec<bool> = cells().map(|cell| cell != Cell::Unknown).collect();
        let clearance = distances(columns, &occupied, REACH);
        let hidden: Vec<bool> =
            distances(columns, &known, NEAR).into_iter().map(|unseen| unseen > SLIVER).collect();
        let sure: Vec<f32> = distances(columns, &hidden, REACH)
            .iter()
            .zip(&clearance)
            .map(|(hidden, clearance)| clearance.min(hidden - SLIVER))
            .collect();
        let least = (ROBOT_RADIUS + margin) as f32;
        let costs = clearance
            .iter()
            .zip(&sure)
            .map(|(&clearance, &sure)| cost(clearance, sure, least))
            .collect();
        Self { columns, clearance, hidden, sure, costs }
    }

    /// From a place to the nearest thing that stands on the floor, in centimetres, as far as the map
    /// tells; 32 where that is farther.
    #[must_use]
    pub fn clearance(&self, map: &Map, place: Ground) -> f64 {
        self.between(map, &self.clearance, place)
    }

    /// From a place to the nearest thing that stands on the floor, or floor of which that is not
    /// known.
    #[must_use]
    pub fn sure(&self, map: &Map, place: Ground) -> f64 {
        self.between(map, &self.sure, place)
    }

    /// Whether everything below a robot on a cell was seen.
    pub(super) fn is_sure(&self, cell: usize) -> bool {
        self.sure[cell] >= ROBOT_RADIUS as f32
    }

    /// The middle of what was not seen within a distance of a place, in centimetres.
    #[must_use]
    pub fn unseen_about(&self, map: &Map, place: Ground, distance: f64) -> Option<Ground> {
        let [column, row] = map.cell_at(place)?;
        let reach = (distance / CELL).ceil() as usize;
        let (mut sum, mut count) = (Vector2::zeros(), 0.0);
        for z in row.saturating_sub(reach)..(row + reach + 1).min(map.rows()) {
            for x in column.saturating_sub(reach)..(column + reach + 1).min(self.columns) {
                let away = map.place(x, z) - place;
                if self.hidden[z * self.columns + x] && away.norm() <= distance {
                    sum += away;
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| place + sum / count)
    }

    /// What a centimetre costs on a cell too near to something for a robot that leaves from a place
    /// just as near; infinite where the cell is nearer still.
    pub(super) fn cost_of_leaving(&self, map: &Map, from: Ground, cell: usize) -> f32 {
        let near = f64::from(self.clearance[cell]) < self.clearance(map, from) - 0.5 * CELL;
        if near { f32::INFINITY } else { 2.0 * (1.0 + NEARNESS) }
    }

    /// A field between the middles of its cells; nothing is near or far beyond the map: 0 there.
    fn between(&self, map: &Map, field: &[f32], place: Ground) -> f64 {
        let half = Ground::new(place.x - 0.5 * CELL, place.y - 0.5 * CELL);
        let Some([column, row]) = map.cell_at(half) else {
            return 0.0;
        };
        let (column, row) = (column.min(self.columns - 2), row.min(map.rows() - 2));
        let from = (place - map.place(column, row)) / CELL;
        let at = |x: usize, z: usize| f64::from(field[(row + z) * self.columns + column + x]);
        let along = |z: usize| at(0, z) * (1.0 - from.x) + at(1, z) * from.x;
        along(0) * (1.0 - from.y) + along(1) * from.y
    }
}

fn cost(clearance: f32, sure: f32, least: f32) -> f32 {
    if clearance < least {
        return f32::INFINITY;
    }
    let comfort = ROBOT_RADIUS as f32 + COMFORT;
    let near = ((comfort - clearance) / (comfort - least)).max(0.0);
    let unseen = if sure < ROBOT_RADIUS as f32 { UNSEEN } else { 1.0 };
    (1.0 + NEARNESS * near * near) * unseen
}
