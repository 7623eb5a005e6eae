//! From disparities of the rectified pair to matched pixels of the cameras' own pictures.

use wheatstone_core::rectification::Table;

/// Matched pixels of several cameras, column by column; NaN where a camera has no match.
#[derive(Clone, Debug)]
pub(crate) struct Matches {
    /// Cameras of the model: the reference, whose pixels say which points are meant, and the others.
    pub(crate) cameras: Vec<usize>,
    /// x and y in each camera's picture.
    pub(crate) pixels: Vec<[Vec<f64>; 2]>,
    /// The standard deviation of every pixel along x and y, where matches are uncertain so.
    pub(crate) pixel_sigma: Option<f64>,
    /// By how much each pixel moves along x and y for a disparity that is larger by its standard deviation; nothing of
    /// the reference.
    pub(crate) deviations: Vec<[Vec<f64>; 2]>,
    /// Where the reference camera's pixel would go for a larger disparity with the other pixel in its place: a direction
    /// in its picture, of length 1.
    pub(crate) directions: Vec<[Vec<f64>; 2]>,
}

/// What another camera matches with a pixel of the reference camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MatchedPixel {
    pub(crate) pixel: [f64; 2],
    pub(crate) deviation: [f64; 2],
    pub(crate) direction: [f64; 2],
}

impl Matches {
    pub(crate) fn new(cameras: Vec<usize>) -> Self {
        let columns = vec![<[Vec<f64>; 2]>::default(); cameras.len()];
        Self {
            cameras,
            pixel_sigma: None,
            pixels: columns.clone(),
            deviations: columns.clone(),
            directions: columns,
        }
    }

    /// Adds a pixel of the reference camera, and what the others match with it.
    pub(crate) fn push(
        &mut self,
        reference: [f64; 2],
        others: impl Iterator<Item = Option<MatchedPixel>>,
    ) {
        const NOTHING: [f64; 2] = [f64::NAN; 2];
        let nothing = MatchedPixel { pixel: NOTHING, deviation: NOTHING, direction: NOTHING };
        let own = MatchedPixel { pixel: reference, deviation: [0.0; 2], direction: [0.0; 2] };
        let found = std::iter::once(own).chain(others.map(|other| other.unwrap_or(nothing)));
        for (side, found) in found.enumerate() {
            for axis in 0..2 {
                self.pixels[side][axis].push(found.pixel[axis]);
                self.deviations[side][axis].push(found.deviation[axis]);
                self.directions[side][axis].push(found.direction[axis]);
            }
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.pixels[0][0].len()
    }

    /// The pixel of one of the cameras.
    pub(crate) fn pixel(&self, side: usize, index: usize) -> [f64; 2] {
        self.pixels[side].each_ref().map(|column| column[index])
    }
}

/// The place in the model's picture that a rectified picture shows between its pixels, bilinear, as far as the outermost
/// pixels that show something reach: half a pixel beyond their middles. `None` where the table shows nothing.
pub(crate) fn source(table: &Table, x: f64, y: f64) -> Option<[f64; 2]> {
    // The first of the two pixels that a place lies between, and of the two beside them that it is nearer to.
    let firsts = |at: f64, side: usize| {
        let own = at.floor();
        let beside = if at - own <= 0.5 { own - 1.0 } else { own + 1.0 };
        let inside = move |first: &f64| *first >= 0.0 && *first + 1.0 < side as f64;
        [own, beside].into_iter().filter(inside).map(|first| first as usize)
    };
    let rows = firsts(y, table.height);
    let mut cells = rows.flat_map(|row| firsts(x, table.width).map(move |column| (column, row)));
    cells.find_map(|cell| within(table, cell, (x, y)))
}

/// The same by the four pixels of one cell, or beyond them as between them.
fn within(table: &Table, (column, row): (usize, usize), (x, y): (f64, f64)) -> Option<[f64; 2]> {
    let (along, down) = (x - column as f64, y - row as f64);
    let mut found = [0.0; 2];
    for (row, share) in [(row, 1.0 - down), (row + 1, down)] {
        for (column, part) in [(column, 1.0 - along), (column + 1, along)] {
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
        let [x, y] = source(&table, -0.25, 3.5).unwrap();
        assert!((x - 2.75).abs() < 1e-6 && (y - 7.25).abs() < 1e-6, "{x} {y}");
        assert!(source(&table, -0.6, 0.0).is_none() && source(&table, 0.0, 3.6).is_none());
        assert!(source(&table, 4.0, 3.0).is_some());
        (table.x[7], table.y[7]) = (Table::NOWHERE, Table::NOWHERE);
        assert!(source(&table, 1.6, 1.0).is_none() && source(&table, 2.0, 0.8).is_none());
        // Beside the hole, and a rounding error beyond its neighbour's middle.
        for (x, y) in [(3.0, 1.0), (1.4, 1.0), (3.0 - 1e-9, 1.0), (2.0, 2.0 - 1e-9)] {
            let [found, _] = source(&table, x, y).unwrap();
            assert!((found - (3.0 * x + y)).abs() < 1e-6, "{x} {y}: {found}");
        }
    }
}
