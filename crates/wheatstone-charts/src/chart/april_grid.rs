//! The AprilGrid of Kalibr: AprilTags in rows, with a small dark square between the corners of every four.
//! Every tag has a name, and where tag and square touch there is a saddle as on a chessboard.

mod grid;
mod tags;

use super::{
    Chart, ChartSearch, Detection, Shape,
    charuco::{has_words, share},
    chessboard::seed,
    lattice::Origin,
    length, refused,
};
use crate::imaging::GrayImage;
use calib_targets::aruco::{Dictionary, builtins};
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use wheatstone_core::{
    Result,
    geometry::{Pixel, Point3},
};

/// An AprilGrid as Kalibr describes it. Its points are the tags' corners, row by row from the bottom left,
/// and so are the tags' numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AprilGrid {
    /// Tags across, Kalibr's `tagCols`.
    #[serde(alias = "tagCols")]
    pub columns: usize,
    /// Tags down, Kalibr's `tagRows`.
    #[serde(alias = "tagRows")]
    pub rows: usize,
    /// Side of a tag with its dark border, in the user's unit; Kalibr's `tagSize`.
    #[serde(alias = "tagSize", alias = "pitch")]
    pub tag: f64,
    /// Distance of neighbouring tags' edges as a share of a tag's side; Kalibr's `tagSpacing`.
    #[serde(alias = "tagSpacing")]
    pub spacing: f64,
    /// Width of a tag's dark border in cells: 2 on Kalibr's charts. Used for drawing; 1 and 2 are found.
    #[serde(default = "kalibr_border")]
    pub border: usize,
    /// The number of the first tag.
    #[serde(default)]
    pub first: usize,
    /// The tags' dictionary, by OpenCV's name.
    #[serde(default = "kalibr_dictionary")]
    pub dictionary: String,
    /// Where the chart's frame begins.
    #[serde(default)]
    pub origin: Origin,
}

fn kalibr_border() -> usize {
    2
}

fn kalibr_dictionary() -> String {
    "DICT_APRILTAG_36h11".into()
}

impl Default for AprilGrid {
    fn default() -> Self {
        Self {
            columns: 6,
            rows: 4,
            tag: 30.0,
            spacing: 0.3,
            border: kalibr_border(),
            first: 0,
            dictionary: kalibr_dictionary(),
            origin: Origin::Centre,
        }
    }
}

impl AprilGrid {
    fn words(&self) -> Option<Dictionary> {
        builtins::builtin_dictionary(&self.dictionary)
    }

    /// From one tag to the next.
    fn pitch(&self) -> f64 {
        self.tag * (1.0 + self.spacing)
    }

    fn gap(&self) -> f64 {
        self.tag * self.spacing
    }

    /// The left edge of the first column, and the lower edge of the lowest row.
    fn corner(&self) -> [f64; 2] {
        match self.origin {
            Origin::FirstPoint => [0.0, 0.0],
            Origin::Centre => {
                let extent = |count: usize| count as f64 * self.pitch() - self.gap();
                [-extent(self.columns) / 2.0, extent(self.rows) / 2.0]
            }
        }
    }

    /// Where a point is that stands `column` from the left and `row` from below, on the chart.
    fn place(&self, column: usize, row: usize) -> [f64; 2] {
        let [left, bottom] = self.corner();
        let along = |at: usize| (at / 2) as f64 * self.pitch() + (at % 2) as f64 * self.tag;
        [left + along(column), bottom - along(row)]
    }

    /// The dark square at the lower left of the tag in this column and row; one more of either has those at
    /// the far edges.
    fn square(&self, column: usize, row: usize) -> [f64; 4] {
        let [left, bottom] = self.corner();
        let x = left + column as f64 * self.pitch() - self.gap();
        let y = bottom - row as f64 * self.pitch();
        [x, y, x + self.gap(), y + self.gap()]
    }

    /// Cells along a tag's side.
    fn cells(&self, words: &Dictionary) -> usize {
        words.marker_size() + 2 * self.border
    }

    /// Whether a cell of a tag is dark, counted from its top left.
    fn is_dark(
        &self,
        (column, row): (usize, usize),
        (x, y): (usize, usize),
        words: &Dictionary,
    ) -> bool {
        let bits = words.marker_size();
        let inside = |at: usize| at >= self.border && at < bits + self.border;
        let word = words.codes().get(self.first + row * self.columns + column).copied();
        let bit = || word.unwrap_or(0) >> ((y - self.border) * bits + x - self.border) & 1 == 1;
        !(inside(x) && inside(y)) || bit()
    }

    /// Ink in a box about `(x, y)` from the tag in this column and row, as a share of the box.
    fn ink(
        &self,
        tag: (usize, usize),
        [x, y]: [f64; 2],
        [width, height]: [f64; 2],
        words: &Dictionary,
    ) -> f64 {
        let [left, bottom] = self.place(2 * tag.0, 2 * tag.1);
        let (top, count) = (bottom - self.tag, self.cells(words));
        let cell = self.tag / count as f64;
        let touched = |at: f64, size: f64| {
            let index = |at: f64| (at / cell).floor().clamp(0.0, (count - 1) as f64) as usize;
            index(at - size / 2.0)..=index(at + size / 2.0)
        };
        let mut ink = 0.0;
        for row in touched(y - top, height) {
            let (t, b) = (top + row as f64 * cell, top + (row + 1) as f64 * cell);
            for column in touched(x - left, width) {
                if self.is_dark(tag, (column, row), words) {
                    let (l, r) = (left + column as f64 * cell, left + (column + 1) as f64 * cell);
                    ink += share(x, width, l, r) * share(y, height, t, b);
                }
            }
        }
        ink
    }

    /// The tags that one size of the picture shows.
    fn tags(&self, image: &GrayImage, scale: seed::Scale, words: &Dictionary) -> Vec<tags::Tag> {
        // A tag has up to 25 corners of its own beside its four.
        let most = (40 * self.columns * self.rows).clamp(1_500, MOST_CORNERS);
        tags::find(image, &seed::corners(image, scale, most), words)
    }

    /// Looks at one size of the picture; `None` where the tags lie on a grid of other counts.
    fn look(&self, image: &GrayImage, scale: seed::Scale, words: &Dictionary) -> Option<Detection> {
        let tags = self.tags(image, scale, words);
        if grid::better_counts(self, &tags).is_some() {
            return None;
        }
        let Some(points) = grid::laid(self, &tags) else { return Some(Detection::default()) };
        Some(grid::completed(self, image, points))
    }

    /// What is told of a grid with other counts or another first tag.
    fn told(&self, meant: &Self) -> String {
        let mut told = format!("`columns = {}`, `rows = {}`", meant.columns, meant.rows);
        if meant.first != self.first {
            told += &format!(", `first = {}`", meant.first);
        }
        told
    }
}

/// Corners that a picture is searched for tags with: noise has more, tags the strongest.
const MOST_CORNERS: usize = 4_000;

impl Chart for AprilGrid {
    fn points(&self) -> Vec<Point3> {
        let across = 2 * self.columns;
        let point = |id: usize| {
            let [x, y] = self.place(id % across, id / across);
            Point3::new(x, y, 0.0)
        };
        (0..across * 2 * self.rows).map(point).collect()
    }

    fn shapes(&self) -> Vec<Shape> {
        let Some(words) = self.words() else { return Vec::new() };
        let grid = |columns: usize, rows: usize| {
            (0..rows).flat_map(move |row| (0..columns).map(move |column| (column, row)))
        };
        let squares = grid(self.columns + 1, self.rows + 1);
        let mut shapes: Vec<Shape> =
            squares.map(|(column, row)| Shape::Rectangle(self.square(column, row))).collect();
        let count = self.cells(&words);
        let cell = self.tag / count as f64;
        for tag in grid(self.columns, self.rows) {
            let [left, bottom] = self.place(2 * tag.0, 2 * tag.1);
            for (x, y) in grid(count, count).filter(|place| self.is_dark(tag, *place, &words)) {
                let (l, t) = (left + x as f64 * cell, bottom - self.tag + y as f64 * cell);
                shapes.push(Shape::Rectangle([l, t, l + cell, t + cell]));
            }
        }
        shapes
    }

    fn label(&self, scale: f64) -> String {
        let [side, gap] = [self.tag, self.gap()].map(|side| length(scale * side));
        let (columns, rows, dictionary) = (self.columns, self.rows, &self.dictionary);
        format!(
            "{columns} columns x {rows} rows of tags of {side} mm, gaps of {gap} mm, {dictionary}"
        )
    }

    fn size(&self) -> Option<(&'static str, f64)> {
        Some(("tag", self.tag))
    }

    fn board(&self) -> [f64; 4] {
        let [left, bottom] = self.corner();
        let margin = self.gap() + 0.25 * self.tag;
        let [right, top] = self.place(2 * self.columns - 1, 2 * self.rows - 1);
        [left - margin, top - margin, right + margin, bottom + margin]
    }

    fn reflectance(&self, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> Option<f64> {
        let [left, top, right, bottom] = self.board();
        if x < left || x > right || y < top || y > bottom {
            return None;
        }
        let Some(words) = self.words() else { return Some(1.0) };
        let corner = self.corner();
        let touched = |from: f64, size: f64, count: usize| {
            let index = |from: f64| {
                ((from + self.gap()) / self.pitch()).floor().clamp(0.0, (count - 1) as f64) as usize
            };
            index(from - size / 2.0)..=index(from + size / 2.0)
        };
        let mut ink = 0.0;
        for row in touched(corner[1] - y, height, self.rows + 1) {
            for column in touched(x - corner[0], width, self.columns + 1) {
                let [l, t, r, b] = self.square(column, row);
                ink += share(x, width, l, r) * share(y, height, t, b);
                if column < self.columns && row < self.rows {
                    ink += self.ink((column, row), [x, y], [width, height], &words);
                }
            }
        }
        Some(1.0 - ink)
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        let Some(words) = self.words() else {
            return ChartSearch::NotFound(format!("no dictionary {}", self.dictionary));
        };
        let whole = 4 * self.columns * self.rows;
        // Another size of the picture may show fewer tags, and these do not contradict.
        let is_contradicted = Cell::new(false);
        let best = seed::Scale::most_of_markers(image, whole, |scale| {
            self.look(image, scale, &words).unwrap_or_else(|| {
                is_contradicted.set(true);
                Detection::default()
            })
        });
        if is_contradicted.get() {
            let (columns, rows) = (self.columns, self.rows);
            return ChartSearch::NotFound(format!(
                "the tags do not lie as on a grid of {columns} columns and {rows} rows with these numbers"
            ));
        }
        if best.points.is_empty() {
            return ChartSearch::NotFound(
                "no two tags are side by side as on this grid: are dictionary, counts and first tag as printed, and black squares between the corners of tags?"
                    .into(),
            );
        }
        ChartSearch::Found(vec![best])
    }

    fn misdeclared(&self, image: &GrayImage) -> Option<String> {
        let words = self.words()?;
        [seed::Scale::Full, seed::Scale::Half].into_iter().find_map(|scale| {
            let tags = self.tags(image, scale, &words);
            grid::better_counts(self, &tags).map(|meant| self.told(&meant))
        })
    }

    fn validate(&self) -> Result<()> {
        if self.columns < 1 || self.rows < 1 || self.columns * self.rows < 2 {
            let value = format!("{}, {}", self.columns, self.rows);
            return Err(refused("columns, rows", value, "at least two tags"));
        }
        if !(self.tag.is_finite() && self.tag > 0.0) {
            return Err(refused("tag", self.tag, "a length above 0"));
        }
        // Squares of less than a tag's cell are not told from its word; wider gaps are another chart.
        if !(0.1..=1.0).contains(&self.spacing) {
            let need = "0.1 to 1: the gap between tags as a fraction of their side";
            return Err(refused("spacing", self.spacing, need));
        }
        if !(1..=2).contains(&self.border) {
            return Err(refused("border", self.border, "1 or 2 cells"));
        }
        has_words(&self.dictionary, self.first + self.columns * self.rows, "tags")
    }
}

/// A point of the grid found in a picture: columns from the left and rows from below.
type Found = std::collections::BTreeMap<(usize, usize), Pixel>;
