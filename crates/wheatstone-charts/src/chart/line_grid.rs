//! The grid of lines, the chart of the 2001 paper: points where the lines cross.

mod candidates;
mod grid;
mod growth;
mod level;
mod profile;
mod refine;
mod search;

use super::{
    AnyChart, Chart, ChartSearch, Shape,
    charuco::share,
    lattice::{Lattice, Origin},
    length, refused,
};
use crate::imaging::GrayImage;
use serde::{Deserialize, Serialize};
use wheatstone_core::{Result, geometry::Point3};

/// Straight lines, evenly spaced both ways, counted by their crossings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineGrid {
    /// Crossings across: lines that run down.
    pub columns: usize,
    /// Crossings down: lines that run across.
    pub rows: usize,
    /// Distance of neighbouring lines, centre to centre, in the user's unit.
    pub pitch: f64,
    /// Width of a line as a share of the pitch. Used for drawing; any width is found.
    #[serde(default = "default_line_width")]
    pub line_width: f64,
    /// Where the chart's frame begins.
    #[serde(default)]
    pub origin: Origin,
}

/// Wide enough for three pixels where the pitch has thirty, narrow enough to leave two thirds of
/// each line free of its crossings.
fn default_line_width() -> f64 {
    0.1
}

impl Default for LineGrid {
    fn default() -> Self {
        Self {
            columns: 9,
            rows: 7,
            pitch: 5.0,
            line_width: default_line_width(),
            origin: Origin::Centre,
        }
    }
}

/// Crossings below which a part of a grid is not told from clutter.
const LEAST_FOUND: usize = 8;

impl LineGrid {
    fn lattice(&self) -> Lattice {
        Lattice { columns: self.columns, rows: self.rows, pitch: self.pitch, origin: self.origin }
    }

    /// How far lines go on beyond the outermost crossings.
    fn overhang(&self) -> f64 {
        0.5 * self.pitch
    }
}

impl Chart for LineGrid {
    fn points(&self) -> Vec<Point3> {
        self.lattice().points()
    }

    fn shapes(&self) -> Vec<Shape> {
        let [left, top] = self.lattice().first_point();
        let right = left + (self.columns - 1) as f64 * self.pitch;
        let bottom = top + (self.rows - 1) as f64 * self.pitch;
        let (half, over) = (self.line_width * self.pitch / 2.0, self.overhang());
        let down = (0..self.columns).map(|column| {
            let x = left + column as f64 * self.pitch;
            Shape::Rectangle([x - half, top - over, x + half, bottom + over])
        });
        let across = (0..self.rows).map(|row| {
            let y = top + row as f64 * self.pitch;
            Shape::Rectangle([left - over, y - half, right + over, y + half])
        });
        down.chain(across).collect()
    }

    fn label(&self, scale: f64) -> String {
        let pitch = length(scale * self.pitch);
        format!("{} columns x {} rows of crossings, pitch {pitch} mm", self.columns, self.rows)
    }

    fn size(&self) -> Option<(&'static str, f64)> {
        Some(("pitch", self.pitch))
    }

    fn board(&self) -> [f64; 4] {
        let [left, top] = self.lattice().first_point();
        let margin = 0.8 * self.pitch;
        [
            left - margin,
            top - margin,
            left + (self.columns - 1) as f64 * self.pitch + margin,
            top + (self.rows - 1) as f64 * self.pitch + margin,
        ]
    }

    fn reflectance(&self, [x, y]: [f64; 2], [width, height]: [f64; 2]) -> Option<f64> {
        let [left, top, right, bottom] = self.board();
        if x < left || x > right || y < top || y > bottom {
            return None;
        }
        let [first_x, first_y] = self.lattice().first_point();
        let bars = |at: f64, first: f64, size: f64, count: usize| {
            let (at, size) = ((at - first) / self.pitch, size / self.pitch);
            // The nearest line is the only one that a box narrower than half the pitch can touch.
            let line = at.round().clamp(0.0, (count - 1) as f64);
            let over = self.overhang() / self.pitch;
            let ink = share(at, size, line - self.line_width / 2.0, line + self.line_width / 2.0);
            (ink, share(at, size, -over, (count - 1) as f64 + over))
        };
        let (down, within_x) = bars(x, first_x, width, self.columns);
        let (across, within_y) = bars(y, first_y, height, self.rows);
        let (down, across) = (down * within_y, across * within_x);
        Some((1.0 - down) * (1.0 - across))
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        let whole = self.columns * self.rows;
        let (found, sigmas) = search::crossings(image, whole);
        // Fewer than a grid's worth of cells is any window frame.
        if found.len() < whole.min(LEAST_FOUND) {
            return ChartSearch::NotFound("no crossing lines found".into());
        }
        sigmas.told(self.lattice().place(&found, image, None))
    }

    fn miscounted(&self) -> Option<AnyChart> {
        let fewer = Self { columns: self.columns - 1, rows: self.rows - 1, ..self.clone() };
        fewer.validate().is_ok().then(|| fewer.into())
    }

    fn validate(&self) -> Result<()> {
        self.lattice().validate()?;
        if self.line_width > 0.0 && self.line_width < 0.6 {
            return Ok(());
        }
        let need = "a fraction of the pitch above 0 and below 0.6";
        Err(refused("line_width", self.line_width, need))
    }
}
