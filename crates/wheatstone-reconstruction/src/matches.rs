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

/// The place in the model's picture that a rectified picture shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub(crate) pixel: [f64; 2],
    /// By how much it moves for a step of one pixel to the right and down in the rectified picture.
    pub(crate) right: [f64; 2],
    pub(crate) down: [f64; 2],
}

impl Source {
    /// Between the pixels of a table, bilinear, as far as the outermost pixels that show something reach: half a pixel
    /// beyond their middles. `None` where the table shows nothing.
    pub(crate) fn of(table: &Table, x: f64, y: f64) -> Option<Self> {
        let cell = [x.floor() as i64, y.floor() as i64];
        let own = Self::within(table, cell, (x, y));
        own.or_else(|| {
            // The cells beside it that the place is nearer to.
            let beside = [x, y].map(|at| if at - at.floor() <= 0.5 { -1 } else { 1 });
            let steps = [[beside[0], 0], [0, beside[1]], beside];
            let cells = steps.map(|[right, down]| [cell[0] + right, cell[1] + down]);
            cells.into_iter().find_map(|cell| Self::within(table, cell, (x, y)))
        })
    }

    /// By the four pixels of one cell, or beyond them as between them.
    fn within(table: &Table, [column, row]: [i64; 2], (x, y): (f64, f64)) -> Option<Self> {
        let inside = |at: i64, side: usize| at >= 0 && at + 1 < side as i64;
        if !inside(column, table.width) || !inside(row, table.height) {
            return None;
        }
        let (along, lower) = (x - column as f64, y - row as f64);
        let first = row as usize * table.width + column as usize;
        let corners = [first, first + 1, first + table.width, first + table.width + 1];
        let shows = corners.map(|at| [table.x[at], table.y[at]]);
        if shows.contains(&[Table::NOWHERE; 2]) {
            return None;
        }
        let of = |axis: usize| {
            let [a, b, c, d] = shows.map(|place| f64::from(place[axis]));
            let (right, down) =
                ((b - a) + lower * (d - c - b + a), (c - a) + along * (d - c - b + a));
            (a + along * right + lower * (c - a), right, down)
        };
        let [(x, x_right, x_down), (y, y_right, y_down)] = [of(0), of(1)];
        Some(Self { pixel: [x, y], right: [x_right, y_right], down: [x_down, y_down] })
    }

    /// How many pixels of the rectified picture show one pixel of the model's picture.
    pub(crate) fn stretch(&self) -> f64 {
        let ([a, b], [c, d]) = (self.right, self.down);
        1.0 / (a * d - b * c).abs()
    }
}

/// What two cameras show at one rectified pixel of the reference camera and a disparity.
pub(crate) struct Shown {
    pub(crate) reference: Source,
    pub(crate) other: Source,
    /// By how many rows the epipolar curve leads down for a disparity that is a pixel larger.
    pub(crate) bend: f64,
}

impl Shown {
    /// The other camera's pixel, of a disparity of this standard deviation.
    pub(crate) fn matched(&self, sigma: f64) -> MatchedPixel {
        let Source { pixel, right, down } = self.other;
        let [along, across] = self.reference.right;
        let length = (along * along + across * across).sqrt();
        MatchedPixel {
            pixel,
            deviation: [0, 1].map(|axis| sigma * (self.bend * down[axis] - right[axis])),
            direction: [along / length, across / length],
        }
    }
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
        let Source { pixel: [x, y], right, down } = Source::of(&table, 1.25, 2.5).unwrap();
        assert!((right, down) == ([3.0, -1.0], [1.0, 2.0]));
        assert!((x - 6.25).abs() < 1e-6 && (y - 3.75).abs() < 1e-6, "{x} {y}");
        let [x, y] = Source::of(&table, -0.25, 3.5).unwrap().pixel;
        assert!((x - 2.75).abs() < 1e-6 && (y - 7.25).abs() < 1e-6, "{x} {y}");
        assert!(Source::of(&table, -0.6, 0.0).is_none() && Source::of(&table, 0.0, 3.6).is_none());
        assert!(Source::of(&table, 4.0, 3.0).is_some());
        (table.x[7], table.y[7]) = (Table::NOWHERE, Table::NOWHERE);
        assert!(Source::of(&table, 1.6, 1.0).is_none() && Source::of(&table, 2.0, 0.8).is_none());
        // Beside the hole, and a rounding error beyond its neighbour's middle.
        for (x, y) in [(3.0, 1.0), (1.4, 1.0), (3.0 - 1e-9, 1.0), (2.0, 2.0 - 1e-9)] {
            let [found, _] = Source::of(&table, x, y).unwrap().pixel;
            assert!((found - (3.0 * x + y)).abs() < 1e-6, "{x} {y}: {found}");
        }
    }
}
