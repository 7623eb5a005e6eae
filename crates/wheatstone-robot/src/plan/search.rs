//! The cheapest way over the raster: A* (Hart, Nilsson & Raphael 1968, doi:10.1109/TSSC.1968.300136).

use super::Terrain;
use crate::map::CELL;
use std::{cmp::Ordering, collections::BinaryHeap};

/// An open end of the search; the one that promises the cheapest whole way comes first.
#[derive(Clone, Copy, PartialEq)]
struct End {
    promise: f32,
    cell: usize,
}

impl Eq for End {}

impl Ord for End {
    fn cmp(&self, other: &Self) -> Ordering {
        other.promise.total_cmp(&self.promise).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for End {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The steps to the eight cells about one, and their lengths in cells.
const STEPS: [([isize; 2], f32); 8] = {
    const ASLANT: f32 = std::f32::consts::SQRT_2;
    [
        ([1, 0], 1.0),
        ([-1, 0], 1.0),
        ([0, 1], 1.0),
        ([0, -1], 1.0),
        ([1, 1], ASLANT),
        ([1, -1], ASLANT),
        ([-1, 1], ASLANT),
        ([-1, -1], ASLANT),
    ]
};

/// The cells of the cheapest way from one cell to another, both included, and that it leads there; where none
/// does, of the way to the nearest cell to it that can be reached. `cost` is what a centimetre costs on a
/// cell, never less than 1; infinite where no way leads.
pub(super) fn search(
    terrain: &Terrain,
    from: usize,
    to: usize,
    cost: impl Fn(usize) -> f32,
) -> (Vec<usize>, bool) {
    let columns = terrain.columns;
    let mut best = vec![f32::INFINITY; terrain.costs.len()];
    let mut came = vec![0_u8; terrain.costs.len()];
    let mut open = BinaryHeap::new();
    best[from] = 0.0;
    open.push(End { promise: octile(columns, from, to), cell: from });
    while let Some(End { promise, cell }) = open.pop() {
        if cell == to {
            return (trace(columns, &came, from, to), true);
        }
        if promise > best[cell] + octile(columns, cell, to) {
            // A cheaper way to it was found since.
            continue;
        }
        let here = cost(cell);
        for (number, (step, length)) in STEPS.iter().enumerate() {
            let Some(next) = stepped(columns, terrain.costs.len(), cell, *step) else {
                continue;
            };
            let whole = best[cell] + 0.5 * (here + cost(next)) * length * CELL as f32;
            if whole < best[next] {
                best[next] = whole;
                came[next] = number as u8;
                open.push(End { promise: whole + octile(columns, next, to), cell: next });
            }
        }
    }
    let reached = (0..best.len()).filter(|cell| best[*cell].is_finite());
    let away = |cell: &usize| octile(columns, *cell, to);
    let nearest = reached.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(from);
    (trace(columns, &came, from, nearest), false)
}

/// The cell after a step, if the raster holds it.
fn stepped(columns: usize, cells: usize, cell: usize, step: [isize; 2]) -> Option<usize> {
    let column = (cell % columns).checked_add_signed(step[0]).filter(|column| *column < columns)?;
    let row = (cell / columns).checked_add_signed(step[1])?;
    Some(row * columns + column).filter(|next| *next < cells)
}

/// The shortest way between two cells in the open, in centimetres.
fn octile(columns: usize, from: usize, to: usize) -> f32 {
    let across = (from % columns).abs_diff(to % columns) as f32;
    let along = (from / columns).abs_diff(to / columns) as f32;
    let (long, short) = (across.max(along), across.min(along));
    (long + (std::f32::consts::SQRT_2 - 1.0) * short) * CELL as f32
}

/// The way back from the last cell.
fn trace(columns: usize, came: &[u8], from: usize, to: usize) -> Vec<usize> {
    let mut way = vec![to];
    let mut cell = to;
    while cell != from {
        let [across, along] = STEPS[usize::from(came[cell])].0;
        cell = cell.wrapping_add_signed(-across - along * columns as isize);
        way.push(cell);
    }
    way.reverse();
    way
}
