//! The ChArUco board of OpenCV: a chessboard with a marker in every light square, so that every inner
//! corner has a name of its own, whatever part of the board is seen.

mod markers;
mod misdeclared;

use super::{
    Chart, ChartSearch, Detection, Shape,
    chessboard::{growth, highlights, seed},
    lattice::{Lattice, Origin},
    length, refused,
};
use crate::imaging::GrayImage;
use calib_targets::aruco::{Dictionary, builtins};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use wheatstone_core::{
    Error, Result,
    geometry::{Pixel, Point3},
};

/// A ChArUco board, counted in squares as OpenCV counts it. Its points are the inner corners.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Charuco {
    /// Squares across.
    pub columns: usize,
    /// Squares down.
    pub rows: usize,
    /// Side of a square, in the user's unit.
    #[serde(alias = "square")]
    pub pitch: f64,
    /// Side of a marker with its black border, in the user's unit.
    pub marker: f64,
    /// The markers' dictionary, by OpenCV's name: `DICT_4X4_50`, `DICT_APRILTAG_36h11`, ...
    pub dictionary: String,
    /// Whether boards with an even count of rows begin with a light square, as OpenCV drew them before
    /// version 4.6. Used for drawing; either layout is found.
    #[serde(default)]
    pub legacy: bool,
    /// Where the chart's frame begins.
    #[serde(default)]
    pub origin: Origin,
}

impl Default for Charuco {
    fn default() -> Self {
        Self {
            columns: 8,
            rows: 6,
            pitch: 30.0,
            marker: 22.0,
            dictionary: "DICT_4X4_50".into(),
            legacy: false,
            origin: Origin::Centre,
        }
    }
}

impl Charuco {
    fn lattice(&self) -> Lattice {
        Lattice {
            columns: self.columns.saturating_sub(1),
            rows: self.rows.saturating_sub(1),
            pitch: self.pitch,
            origin: self.origin,
        }
    }

    fn words(&self) -> Option<Dictionary> {
        builtins::builtin_dictionary(&self.dictionary)
    }

    /// The board's left and top edges, without its margin.
    fn corner(&self) -> [f64; 2] {
        self.lattice().first_point().map(|first| first - self.pitch)
    }

    /// Whether a square has a marker: the light ones.
    fn is_light(&self, column: usize, row: usize, legacy: bool) -> bool {
        let first_light = legacy && self.rows.is_multiple_of(2);
        (column + row).is_multiple_of(2) == first_light
    }

    /// Squares with markers, by the markers' ids.
    fn marked(&self, legacy: bool) -> Vec<(usize, usize)> {
        let squares = (0..self.rows).flat_map(|row| (0..self.columns).map(move |c| (c, row)));
        squares.filter(|(column, row)| self.is_light(*column, *row, legacy)).collect()
    }

    /// Dark rectangles of one square, from its left and top edges.
    fn ink(&self, column: usize, row: usize, words: &Dictionary) -> Vec<[f64; 4]> {
        if !self.is_light(column, row, self.legacy) {
            return vec![[0.0, 0.0, self.pitch, self.pitch]];
        }
        let before = row * self.columns + column;
        // Of every two squares one is light; an odd count of columns takes turns.
        let id = (0..before)
            .filter(|at| self.is_light(at % self.columns, at / self.columns, self.legacy))
            .count();
        let Some(word) = words.codes().get(id) else { return Vec::new() };
        let bits = words.marker_size();
        let (begin, cell) = ((self.pitch - self.marker) / 2.0, self.marker / (bits + 2) as f64);
        let dark = |x: usize, y: usize| {
            let inside = x > 0 && y > 0 && x <= bits && y <= bits;
            !inside || (word >> ((y - 1) * bits + x - 1)) & 1 == 1
        };
        let edge = |count: usize| begin + count as f64 * cell;
        let cells = (0..bits + 2).flat_map(|y| (0..bits + 2).map(move |x| (x, y)));
        cells
            .filter(|(x, y)| dark(*x, *y))
            .map(|(x, y)| [edge(x), edge(y), edge(x + 1), edge(y + 1)])
            .collect()
    }

    /// Where growth looks for a corner's colours, as shares of a square: nearer than the markers.
    fn reach(&self) -> f64 {
        // A sixth of the margin is left for blur.
        (self.pitch - self.marker) / 2.0 / self.pitch * 5.0 / 6.0
    }

    /// Looks at the picture's sizes, each with the seeds that `find` gives for a count of points among the
    /// most corners. No points where there is no board.
    fn look(
        &self,
        image: &GrayImage,
        words: &Dictionary,
        find: impl Fn(&seed::Look, usize, usize) -> Vec<seed::Seed>,
    ) -> Detection {
        let count = self.columns * self.rows;
        // A marker has up to 36 corners of its own, and every second square has one.
        let most = (20 * count).clamp(4_000, 10_000);
        let whole = (self.columns - 1) * (self.rows - 1);
        seed::Scale::most_of_markers(image, whole, |scale| {
            let seeds = find(&seed::Look::new(image, scale), count, most);
            // A grating may have more corners than the board, but has no markers.
            seeds.iter().find_map(|seed| self.read(image, seed, words)).unwrap_or_default()
        })
    }

    /// What a piece of a chessboard comes to, if it has the board's markers.
    fn read(&self, image: &GrayImage, seed: &seed::Seed, words: &Dictionary) -> Option<Detection> {
        let count = self.columns * self.rows;
        let grown = growth::grow(image, seed, growth::most_points(count), self.reach())?;
        let grown = markers::face_up(grown);
        let place = markers::place(self, image, &grown, words)?;
        let mut points: Vec<(usize, Pixel)> = grown
            .labels
            .iter()
            .filter_map(|(label, pixel)| {
                let (column, row) = place.board(*label);
                let inside =
                    column > 0 && row > 0 && column < self.columns as i32 && row < self.rows as i32;
                let id = || (row - 1) as usize * (self.columns - 1) + (column - 1) as usize;
                inside.then(|| (id(), *pixel))
            })
            .collect();
        points.sort_unstable_by_key(|(id, _)| *id);
        let seen = ChartSearch::Found(vec![Detection { points, ..Detection::default() }]);
        match grown.sigmas.told(highlights::without(image, &grown.labels, seen)) {
            ChartSearch::Found(mut readings) => readings.pop(),
            ChartSearch::NotFound(_) => None,
        }
    }
}

impl Chart for Charuco {
    fn points(&self) -> Vec<Point3> {
        self.lattice().points()
    }

    fn shapes(&self) -> Vec<Shape> {
        let Some(words) = self.words() else { return Vec::new() };
        let [left, top] = self.corner();
        let squares = (0..self.rows).flat_map(|row| (0..self.columns).map(move |c| (c, row)));
        squares
            .flat_map(|(column, row)| {
                let x = left + column as f64 * self.pitch;
                let y = top + row as f64 * self.pitch;
                let ink = self.ink(column, row, &words).into_iter();
                ink.map(move |[l, t, r, b]| Shape::Rectangle([x + l, y + t, x + r, y + b]))
            })
            .collect()
    }

    fn label(&self, scale: f64) -> String {
        let [side, marker] = [self.pitch, self.marker].map(|side| length(scale * side));
        let (columns, rows, dictionary) = (self.columns, self.rows, &self.dictionary);
        format!(
            "{columns} columns x {rows} rows of squares of {side} mm, markers of {marker} mm, {dictionary}"
        )
    }

    fn size(&self) -> Option<(&'static str, f64)> {
        Some(("pitch", self.pitch))
    }

    fn board(&self) -> [f64; 4] {
        let [left, top] = self.corner();
        // Half a square of white all round.
        let margin = 0.5 * self.pitch;
        [
            left - margin,
            top - margin,
            left + self.columns as f64 * self.pitch + margin,
            top + self.rows as f64 * self.pitch + margin,
        ]
    }

    fn reflectance(&self, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> Option<f64> {
        let [left, top, right, bottom] = self.board();
        if x < left || x > right || y < top || y > bottom {
            return None;
        }
        let Some(words) = self.words() else { return Some(1.0) };
        let corner = self.corner();
        let (x, y) = (x - corner[0], y - corner[1]);
        let touched = |at: f64, size: f64, count: usize| {
            let index = |at: f64| (at / self.pitch).floor().clamp(0.0, (count - 1) as f64) as usize;
            index(at - size / 2.0)..=index(at + size / 2.0)
        };
        let mut ink = 0.0;
        for row in touched(y, height, self.rows) {
            for column in touched(x, width, self.columns) {
                let across = x - column as f64 * self.pitch;
                let down = y - row as f64 * self.pitch;
                for [l, t, r, b] in self.ink(column, row, &words) {
                    ink += share(across, width, l, r) * share(down, height, t, b);
                }
            }
        }
        Some(1.0 - ink)
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        let Some(words) = self.words() else {
            return ChartSearch::NotFound(format!("no dictionary {}", self.dictionary));
        };
        let mut best = self.look(image, &words, seed::Look::find);
        if best.points.is_empty() {
            // Something beside the board may hide it from the first search.
            best = self.look(image, &words, seed::Look::find_by_turn);
        }
        if best.points.is_empty() {
            return ChartSearch::NotFound(
                "no chessboard with these columns, rows and markers found".into(),
            );
        }
        ChartSearch::Found(vec![best])
    }

    fn misdeclared(&self, image: &GrayImage) -> Option<String> {
        misdeclared::told(self, image)
    }

    fn validate(&self) -> Result<()> {
        for (name, count) in [("columns", self.columns), ("rows", self.rows)] {
            if !(3..=500).contains(&count) {
                return Err(refused(name, count, "3 to 500 squares"));
            }
        }
        self.lattice().validate()?;
        // Less than a twelfth of the square on each side, and corners cannot be told from markers.
        if !(self.marker > 0.0 && self.marker <= 0.85 * self.pitch) {
            let need = "a length above 0 and at most 0.85 of the pitch";
            return Err(refused("marker", self.marker, need));
        }
        has_words(&self.dictionary, self.marked(self.legacy).len(), "markers")
    }
}

/// Refuses a dictionary that is not known, or has words for fewer markers than are needed.
pub(super) fn has_words(dictionary: &str, needed: usize, markers: &str) -> Result<()> {
    let words = builtins::builtin_dictionary(dictionary).ok_or_else(|| Error::UnknownName {
        kind: "dictionary",
        name: dictionary.into(),
        known: builtins::BUILTIN_DICTIONARY_NAMES.iter().map(|n| (*n).into()).collect(),
    })?;
    let known = words.codes().len();
    if needed > known {
        let need = format!("a dictionary with {needed} {markers}; this one has {known}");
        return Err(refused("dictionary", dictionary, need));
    }
    Ok(())
}

/// Share of a stretch of `size` at `at` that lies between `low` and `high`.
pub(super) fn share(at: f64, size: f64, low: f64, high: f64) -> f64 {
    if size > 0.0 {
        ((at + size / 2.0).min(high) - (at - size / 2.0).max(low)).max(0.0) / size
    } else {
        f64::from(at >= low && at < high)
    }
}

/// Where on the board a label is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    /// Quarter turns from the labels to the board.
    turns: u8,
    /// Then added.
    shift: (i32, i32),
}

impl Place {
    /// By the square whose lowest labels are `label` and which is `square` on the board.
    fn by_square(turns: u8, label: (i32, i32), square: (i32, i32)) -> Self {
        // Twice the square's middle, which turns into the square's middle on the board.
        let middle = turned(turns, (2 * label.0 + 1, 2 * label.1 + 1));
        let shift = ((2 * square.0 + 1 - middle.0) / 2, (2 * square.1 + 1 - middle.1) / 2);
        Self { turns, shift }
    }

    /// Counted from the board's top left corner, in squares.
    fn board(&self, label: (i32, i32)) -> (i32, i32) {
        let (x, y) = turned(self.turns, label);
        (x + self.shift.0, y + self.shift.1)
    }
}

/// A step along the labels as a step on the board, for a marker whose word was read after `turns`
/// quarter turns.
fn turned(turns: u8, (x, y): (i32, i32)) -> (i32, i32) {
    match turns {
        0 => (x, y),
        1 => (y, -x),
        2 => (-x, -y),
        _ => (-y, x),
    }
}

/// Labels of a chessboard, with places beyond its rim.
type Labels = BTreeMap<(i32, i32), Pixel>;
