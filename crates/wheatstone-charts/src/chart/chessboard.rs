//! The chessboard: points at the inner corners.

mod edges;
pub(super) mod fold;
pub(super) mod growth;
pub(super) mod highlights;
mod response;
pub(super) mod saddle;
pub(super) mod seed;

use super::{
    AnyChart, Chart, ChartSearch, Shape, Sigmas,
    lattice::{Labelled, Lattice, Origin},
    length,
    trimming::trim,
};
use crate::imaging::GrayImage;
use serde::{Deserialize, Serialize};
use wheatstone_core::{Result, geometry::Point3};

/// A chessboard, counted in inner corners.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chessboard {
    /// Inner corners across.
    pub columns: usize,
    /// Inner corners down.
    pub rows: usize,
    /// Side of a square, in the user's unit.
    #[serde(alias = "square")]
    pub pitch: f64,
    /// Where the chart's frame begins.
    #[serde(default)]
    pub origin: Origin,
}

/// Ten times the corners of a large board.
const MOST_CORNERS: usize = 4_000;

impl Default for Chessboard {
    fn default() -> Self {
        Self { columns: 9, rows: 6, pitch: 30.0, origin: Origin::Centre }
    }
}

impl Chessboard {
    fn lattice(&self) -> Lattice {
        Lattice { columns: self.columns, rows: self.rows, pitch: self.pitch, origin: self.origin }
    }

    /// The colour of the square below and right of point 0.
    ///
    /// Where one count is odd and the other even, half a turn exchanges the colours, which then tell
    /// where point 0 is: at a light square, as in OpenCV's order of such boards. On other boards the
    /// colours say nothing about it, and corners are printed dark to stand out from the margin.
    fn first_square_is_dark(&self) -> bool {
        (self.columns + self.rows).is_multiple_of(2)
    }

    /// Whether colours tell one way to lay the board down from another: half turns where one count
    /// is odd, quarter turns of square boards with an odd count. Boards of either colouring exist of
    /// all others, and are welcome.
    fn colours_tell(&self) -> bool {
        (self.columns + self.rows) % 2 == 1 || (self.columns == self.rows && self.columns % 2 == 1)
    }

    /// Looks at one size of the picture. With what is found: whether nothing of it is missing, and
    /// how much there is of it, anything that can be placed on the chart before anything that cannot.
    fn look(&self, image: &GrayImage, scale: seed::Scale) -> Option<(bool, usize, ChartSearch)> {
        let look = seed::Look::new(image, scale);
        let count = self.columns * self.rows;
        // A board's corners are among the strongest places, and few of these take little time.
        let few = look.few(count);
        let first = self.look_among(image, &look, few);
        if look.count() <= few || first.as_ref().is_some_and(|(whole, ..)| *whole) {
            return first;
        }
        let all = self.look_among(image, &look, MOST_CORNERS.max(4 * count));
        let rank = |found: &Option<(bool, usize, ChartSearch)>| found.as_ref().map(|found| found.1);
        if rank(&first) > rank(&all) { first } else { all }
    }

    /// The same, among the `most` strongest places.
    fn look_among(
        &self,
        image: &GrayImage,
        look: &seed::Look,
        most: usize,
    ) -> Option<(bool, usize, ChartSearch)> {
        let seed = look.find(self.columns * self.rows, most).into_iter().next()?;
        let most_points = growth::most_points(self.columns * self.rows);
        let growth::Grown { labels, dark_square, mut sigmas } =
            growth::grow(image, &seed, most_points, f64::INFINITY)?;
        let parts = fold::parts(labels).into_iter();
        let looks = parts.filter_map(|mut part| {
            growth::settle(image, most_points, (&mut part, &mut sigmas));
            self.look_at(image, part, dark_square, &sigmas)
        });
        // The larger of two that are alike.
        looks.reduce(|best, other| if other.1 > best.1 { other } else { best })
    }

    /// What the corners of one board come to; see [`Self::look`].
    fn look_at(
        &self,
        image: &GrayImage,
        mut labels: seed::Labels,
        dark_square: (i32, i32),
        sigmas: &Sigmas,
    ) -> Option<(bool, usize, ChartSearch)> {
        trim(&mut labels, (self.columns, self.rows), 1.0);
        let bounds = |pick: fn(&(i32, i32)) -> i32| {
            let all = labels.keys().map(pick);
            Some(all.clone().max()? - all.min()? + 1)
        };
        let (across, down) = (bounds(|label| label.0)?, bounds(|label| label.1)?);
        // Corners in one row are anywhere on any board.
        if across.min(down) < 2 {
            return None;
        }
        let box_of_labels = across * down;
        let found: Vec<Labelled> = labels
            .iter()
            .map(|((column, row), pixel)| Labelled { column: *column, row: *row, pixel: *pixel })
            .collect();
        // Beside a dark square there is a light one.
        let beside = i32::from(!self.first_square_is_dark());
        let first_square = (dark_square.0 + beside, dark_square.1);
        let sighting =
            self.lattice().place(&found, image, self.colours_tell().then_some(first_square));
        let sighting = sigmas.told(highlights::without(image, &labels, sighting));
        let placed = matches!(sighting, ChartSearch::Found(_));
        let rank = found.len() + if placed { self.columns * self.rows } else { 0 };
        // A whole board of other counts is whole at every size of the picture.
        let counts_enough = placed || found.len() > self.columns * self.rows;
        Some((counts_enough && found.len() == box_of_labels as usize, rank, sighting))
    }
}

impl Chart for Chessboard {
    fn points(&self) -> Vec<Point3> {
        self.lattice().points()
    }

    fn shapes(&self) -> Vec<Shape> {
        let [left, top] = self.lattice().first_point();
        let squares = (0..=self.rows).flat_map(|row| (0..=self.columns).map(move |c| (c, row)));
        // The square below and right of point 0 has column 1 and row 1 here.
        let light = usize::from(!self.first_square_is_dark());
        let dark = squares.filter(|(column, row)| (column + row) % 2 == light);
        dark.map(|(column, row)| {
            let x = left + (column as f64 - 1.0) * self.pitch;
            let y = top + (row as f64 - 1.0) * self.pitch;
            Shape::Rectangle([x, y, x + self.pitch, y + self.pitch])
        })
        .collect()
    }

    fn label(&self, scale: f64) -> String {
        let side = length(scale * self.pitch);
        let (columns, rows) = (self.columns, self.rows);
        format!("{columns} columns x {rows} rows of inner corners, squares of {side} mm")
    }

    fn size(&self) -> Option<(&'static str, f64)> {
        Some(("pitch", self.pitch))
    }

    fn board(&self) -> [f64; 4] {
        let [left, top] = self.lattice().first_point();
        let across = (self.columns + 1) as f64 * self.pitch;
        let down = (self.rows + 1) as f64 * self.pitch;
        // Half a square of white all round.
        [
            left - 1.5 * self.pitch,
            top - 1.5 * self.pitch,
            left + across - 0.5 * self.pitch,
            top + down - 0.5 * self.pitch,
        ]
    }

    fn reflectance(&self, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> Option<f64> {
        let [left, top, right, bottom] = self.board();
        if x < left || x > right || y < top || y > bottom {
            return None;
        }
        let [first_x, first_y] = self.lattice().first_point();
        // In squares, 0 at the printed area's edge.
        let across = |at: f64, first: f64| (at - first) / self.pitch + 1.0;
        let (u, v) = (across(x, first_x), across(y, first_y));
        let (across, inside_x) = stripes(u, width / self.pitch, self.columns + 1);
        let (down, inside_y) = stripes(v, height / self.pitch, self.rows + 1);
        // Both stripes even or both odd, or not.
        let sign = if self.first_square_is_dark() { 1.0 } else { -1.0 };
        let dark = (inside_x * inside_y + sign * across * down) / 2.0;
        Some(1.0 - dark)
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        let mut best: Option<(usize, ChartSearch)> = None;
        let pixels = image.width() * image.height();
        for scale in seed::Scale::ladder(pixels) {
            // Squares under ten pixels in a large picture show in its half, if not whole; a texture that shows
            // nothing there would take seconds.
            let promising =
                best.as_ref().is_some_and(|(most, _)| 8 * most >= self.columns * self.rows);
            if pixels >= seed::LARGE && *scale == seed::Scale::Full && !promising {
                continue;
            }
            let Some((full, count, sighting)) = self.look(image, *scale) else { continue };
            if full {
                return sighting;
            }
            if best.as_ref().is_none_or(|(most, _)| count > *most) {
                best = Some((count, sighting));
            }
        }
        best.map_or_else(
            || ChartSearch::NotFound("no chessboard found".into()),
            |(_, sighting)| sighting,
        )
    }

    fn miscounted(&self) -> Option<AnyChart> {
        let fewer = Self { columns: self.columns - 1, rows: self.rows - 1, ..self.clone() };
        fewer.validate().is_ok().then(|| fewer.into())
    }

    fn validate(&self) -> Result<()> {
        self.lattice().validate()
    }
}

/// Means over a box at `at` of the wave that is 1 on even stripes and -1 on odd ones (stripes are 1
/// wide, `count` of them from 0, nothing beyond), and of its absolute value.
fn stripes(at: f64, width: f64, count: usize) -> (f64, f64) {
    let (low, high) = (at - width / 2.0, at + width / 2.0);
    let within = |x: f64| x.clamp(0.0, count as f64);
    // The wave's integral from 0 is a triangle wave.
    let triangle = |x: f64| {
        let rest = x - 2.0 * (x / 2.0).floor();
        if rest < 1.0 { rest } else { 2.0 - rest }
    };
    if width > 0.0 {
        let mean = (triangle(within(high)) - triangle(within(low))) / width;
        return (mean, (within(high) - within(low)) / width);
    }
    let inside = at >= 0.0 && at < count as f64;
    let sign = if at.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
    if inside { (sign, 1.0) } else { (0.0, 0.0) }
}
