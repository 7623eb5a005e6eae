//! Values over a picture, cell by cell.

use serde::{Deserialize, Serialize};

/// Cells over a part of a picture, row by row from its top left.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Cells in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Points in each cell.
    pub counts: Vec<usize>,
    /// Root mean square of the points' values in each cell; none where there are no points.
    pub values: Vec<Option<f64>>,
}

/// On average so many points fall in a cell: below four a cell's figure is mostly chance, above ten
/// the map loses detail that the points have.
const POINTS_A_CELL: f64 = 6.0;

impl Grid {
    /// Sorts values at pixels into nearly square cells over `area` (left, top, right, bottom).
    pub(super) fn of(area: [f64; 4], values: &[([f64; 2], f64)]) -> Self {
        let (width, height) = (area[2] - area[0], area[3] - area[1]);
        if width <= 0.0 || height <= 0.0 {
            return Self::default();
        }
        let cells = (values.len() as f64 / POINTS_A_CELL).clamp(16.0, 600.0);
        let columns = (cells * width / height).sqrt().round().clamp(2.0, 40.0) as usize;
        let rows = (cells * height / width).sqrt().round().clamp(2.0, 40.0) as usize;
        let (mut counts, mut squares) = (vec![0; columns * rows], vec![0.0; columns * rows]);
        for ([x, y], value) in values {
            let place = |share: f64, count: usize| {
                ((share * count as f64).floor().max(0.0) as usize).min(count - 1)
            };
            let cell = place((y - area[1]) / height, rows) * columns
                + place((x - area[0]) / width, columns);
            counts[cell] += 1;
            squares[cell] += value * value;
        }
        let values = counts.iter().zip(&squares);
        let values = values
            .map(|(count, square)| (*count > 0).then(|| (square / *count as f64).sqrt()))
            .collect();
        Self { columns, rows, counts, values }
    }

    /// The share of cells that hold a point.
    #[must_use]
    pub fn covered(&self) -> f64 {
        let held = self.counts.iter().filter(|count| **count > 0).count();
        held as f64 / self.counts.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::Grid;

    #[test]
    fn values_fall_into_their_cells() {
        // The middle of each of 8 by 6 squares of ten pixels: 48 points, sixteen cells at least.
        let points: Vec<([f64; 2], f64)> = (0..48)
            .map(|i| ([f64::from(i % 8) * 10.0 + 4.5, f64::from(i / 8) * 10.0 + 4.5], 2.0))
            .collect();
        let grid = Grid::of([-0.5, -0.5, 79.5, 59.5], &points);
        assert_eq!(grid.counts.iter().sum::<usize>(), 48);
        assert_eq!(grid.covered(), 1.0);
        assert!(grid.values.iter().all(|value| *value == Some(2.0)));
        let corner =
            Grid::of([0.0, 0.0, 100.0, 100.0], &[([99.0, 99.0], 3.0), ([99.0, 98.0], 4.0)]);
        assert_eq!(corner.counts.last(), Some(&2));
        assert_eq!(corner.values.last(), Some(&Some(12.5_f64.sqrt())));
        assert!(corner.covered() < 0.1);
    }

    #[test]
    fn no_area_no_cells() {
        assert_eq!(Grid::of([1.0, 1.0, 1.0, 5.0], &[([1.0, 1.0], 1.0)]), Grid::default());
    }
}
