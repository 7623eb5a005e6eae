//! Crossings found so far, by label, and what is known about them from their neighbours.

use nalgebra::Vector2;
use std::collections::BTreeMap;
use wheatstone_core::geometry::Pixel;

/// Column and row, counted from the crossing that was found first.
pub(super) type Label = (i32, i32);

/// The four neighbours of a crossing: one way along the columns' count, one way along the rows',
/// then backwards.
pub(super) const SIDES: [Label; 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// The label `times` sides on.
pub(super) fn onward(label: Label, side: Label, times: i32) -> Label {
    (label.0 + times * side.0, label.1 + times * side.1)
}

/// The side a quarter turn on.
pub(super) fn crosswise(side: Label) -> Label {
    (-side.1, side.0)
}

/// A crossing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Where it is, in the pixels of the level that is worked on.
    pub(super) pixel: Pixel,
    /// How much darker than the ground the lines around it are, in grey levels.
    pub(super) depth: f64,
    /// Standard deviation along each axis, in the same pixels, by how its lines scatter; 0 before they are
    /// measured.
    pub(super) sigma: f64,
}

/// Crossings by label.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    /// The crossings.
    pub(super) nodes: BTreeMap<Label, Node>,
    /// Width of the lines as blurred, a share of the pitch.
    pub(super) width: f64,
}

impl Grid {
    /// Where a crossing is, if it is known.
    pub(super) fn pixel(&self, label: Label) -> Option<Pixel> {
        self.nodes.get(&label).map(|node| node.pixel)
    }

    /// The step from a crossing to its neighbour on `side`: from its own neighbours, or else from
    /// those of crossings near it on the other line.
    pub(super) fn step(&self, label: Label, side: Label) -> Option<Vector2<f64>> {
        let cross = crosswise(side);
        // As far as a missing crossing or two can make it look.
        [0, 1, -1, 2, -2].iter().find_map(|away| self.own_step(onward(label, cross, *away), side))
    }

    fn own_step(&self, label: Label, side: Label) -> Option<Vector2<f64>> {
        let here = self.pixel(label)?;
        let next = self.pixel(onward(label, side, 1)).map(|next| next - here);
        let last = self.pixel(onward(label, side, -1)).map(|last| here - last);
        match (next, last) {
            (Some(next), Some(last)) => Some((next + last) / 2.0),
            (one, other) => one.or(other),
        }
    }

    /// Where the neighbour of a known crossing should be: as far on as steps near it go.
    pub(super) fn prediction(&self, from: Label, side: Label) -> Option<Pixel> {
        let here = self.pixel(from)?;
        let mut steps = Vec::new();
        if let Some(last) = self.pixel(onward(from, side, -1)) {
            let step = here - last;
            // Perspective and lens make steps grow or shrink steadily.
            let change = self
                .pixel(onward(from, side, -2))
                .map_or(Vector2::zeros(), |third| step - (last - third));
            steps.push(step + change);
        }
        let cross = crosswise(side);
        for away in [1, -1] {
            let beside = onward(from, cross, away);
            if let (Some(a), Some(b)) = (self.pixel(beside), self.pixel(onward(beside, side, 1))) {
                steps.push(b - a);
            }
        }
        let count = steps.len() as f64;
        (!steps.is_empty()).then(|| here + steps.iter().sum::<Vector2<f64>>() / count)
    }

    /// Keeps the crossings that hang together with the largest group.
    pub(super) fn keep_largest_group(&mut self) {
        let mut rest: Vec<Label> = self.nodes.keys().copied().collect();
        let mut largest = Vec::new();
        while let Some(first) = rest.first().copied() {
            let mut group = vec![first];
            rest.remove(0);
            let mut next = 0;
            while let Some(label) = group.get(next).copied() {
                for side in SIDES {
                    if let Ok(i) = rest.binary_search(&onward(label, side, 1)) {
                        group.push(rest.remove(i));
                    }
                }
                next += 1;
            }
            if group.len() > largest.len() {
                largest = group;
            }
        }
        self.nodes.retain(|label, _| largest.contains(label));
    }
}
