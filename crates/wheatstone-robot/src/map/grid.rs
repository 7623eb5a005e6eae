//! Where the cells of the map lie.

use crate::Ground;

/// The side of a cell, in centimetres: a seventh of what the narrowest gap leaves beside the robot.
pub const CELL: f64 = 2.0;

/// Cells in rows, in the start frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// The corner with the least x and z.
    pub(super) corner: Ground,
    /// Cells from left to right.
    pub(super) columns: usize,
    /// Cells from near to far.
    pub(super) rows: usize,
}

impl Grid {
    /// The middle of a cell, in the start frame.
    pub(super) fn place(&self, column: usize, row: usize) -> Ground {
        let along = |first: f64, index: usize| first + (index as f64 + 0.5) * CELL;
        Ground::new(along(self.corner.x, column), along(self.corner.y, row))
    }

    /// The column and the row of the cell that holds a place, if the grid does.
    pub(super) fn cell_at(&self, place: Ground) -> Option<[usize; 2]> {
        let (x, z) = ((place.x - self.corner.x) / CELL, (place.y - self.corner.y) / CELL);
        let within = x >= 0.0 && z >= 0.0 && x < self.columns as f64 && z < self.rows as f64;
        within.then_some([x as usize, z as usize])
    }

    /// The index of the cell that holds a place, row by row.
    pub(super) fn index_at(&self, place: Ground) -> Option<usize> {
        self.cell_at(place).map(|[column, row]| row * self.columns + column)
    }
}
