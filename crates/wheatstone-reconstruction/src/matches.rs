//! From disparities of the rectified pair to matched pixels of the cameras' own pictures.

use wheatstone_core::rectification::Table;

/// Matched pixels, column by column.
#[derive(Clone, Debug, Default)]
pub(crate) struct Matches {
    /// x and y in the left camera's picture.
    pub(crate) left: [Vec<f64>; 2],
    /// x and y in the right camera's picture.
    pub(crate) right: [Vec<f64>; 2],
    /// By how much the right pixel moves along x and y for a disparity that is larger by a pixel.
    pub(crate) along: [Vec<f64>; 2],
}

impl Matches {
    pub(crate) fn push(&mut self, left: [f64; 2], right: [f64; 2], along: [f64; 2]) {
        let columns = self.left.iter_mut().chain(&mut self.right).chain(&mut self.along);
        let values = left.into_iter().chain(right).chain(along);
        columns.zip(values).for_each(|(column, value)| column.push(value));
    }

    pub(crate) fn len(&self) -> usize {
        self.left[0].len()
    }
}

/// The place in the model's picture that a rectified picture shows between its pixels, bilinear; `None` where the table
/// shows nothing.
pub(crate) fn source(table: &Table, x: f64, y: f64) -> Option<[f64; 2]> {
    let (column, row) = (x.floor(), y.floor());
    let inside =
        column >= 0.0 && row >= 0.0 && column < table.width as f64 && row < table.height as f64;
    if !inside {
        return None;
    }
    // At the last column and row nothing lies beyond.
    let next = |at: f64, side: usize| (at as usize + 1).min(side - 1);
    let columns = [column as usize, next(column, table.width)];
    let rows = [row as usize, next(row, table.height)];
    let (along, down) = (x - column, y - row);
    let mut found = [0.0; 2];
    for (row, share) in rows.into_iter().zip([1.0 - down, down]) {
        for (column, part) in columns.into_iter().zip([1.0 - along, along]) {
            let at = row * table.width + column;
            let shows = [table.x[at], table.y[at]];
            if shows == [Table::NOWHERE; 2] {
                return None;
            }
            for (found, shows) in found.iter_mut().zip(shows) {
                *found += share * part * f64::from(shows);
            }
        }
    }
    Some(found)
}

/// How many pixels of a rectified picture show one pixel of the model's picture, about a place; `None` where the table
/// shows nothing.
pub(crate) fn stretch(table: &Table, x: f64, y: f64) -> Option<f64> {
    let at = |dx: f64, dy: f64| source(table, x + dx, y + dy);
    let [ahead, behind] = [at(1.0, 0.0)?, at(-1.0, 0.0)?];
    let [below, above] = [at(0.0, 1.0)?, at(0.0, -1.0)?];
    let [x, y] = [0, 1].map(|axis| [ahead[axis] - behind[axis], below[axis] - above[axis]]);
    Some(4.0 / (x[0] * y[1] - x[1] * y[0]).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_linear_between_their_pixels_and_end_at_their_border() {
        let (width, height) = (5, 4);
        let of = |value: fn(usize, usize) -> f32| {
            (0..width * height).map(|at| value(at % width, at / width)).collect()
        };
        let mut table = Table {
            width,
            height,
            x: of(|x, y| 3.0 * x as f32 + y as f32),
            y: of(|x, y| 2.0 * y as f32 - x as f32),
            filled: 1.0,
            shown: 1.0,
        };
        let [x, y] = source(&table, 1.25, 2.5).unwrap();
        assert!((x - 6.25).abs() < 1e-6 && (y - 3.75).abs() < 1e-6, "{x} {y}");
        assert!(source(&table, -0.1, 0.0).is_none() && source(&table, 0.0, 4.0).is_none());
        assert!(source(&table, 4.0, 3.0).is_some());
        (table.x[7], table.y[7]) = (Table::NOWHERE, Table::NOWHERE);
        assert!(source(&table, 1.5, 1.0).is_none() && source(&table, 3.0, 1.0).is_some());
    }
}
