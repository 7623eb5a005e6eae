//! What charts with points on a square lattice share: where the points are, and which point of the
//! chart each crossing found in a picture can be.

use super::{ChartSearch, Detection, refused};
use crate::imaging::GrayImage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use wheatstone_core::{
    Result,
    geometry::{Pixel, Point3},
};

/// Which point of the chart is the origin of its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// The middle of the points.
    #[default]
    Centre,
    /// The point with id 0, top left.
    FirstPoint,
}

/// Points `pitch` apart, row by row from the top left, in the plane z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Points a row.
    pub columns: usize,
    /// Points a column.
    pub rows: usize,
    /// Distance of neighbours, in the user's unit.
    pub pitch: f64,
    /// Where the frame begins.
    pub origin: Origin,
}

/// A lattice point found in a picture. Its labels count along the two directions of the lattice as
/// the picture shows it; where they begin and which way they go says nothing about the chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Labelled {
    /// Along one direction.
    pub column: i32,
    /// Along the other.
    pub row: i32,
    /// Where the point is.
    pub pixel: Pixel,
}

impl Lattice {
    /// The points, by id: `row * columns + column`.
    #[must_use]
    pub fn points(&self) -> Vec<Point3> {
        let [left, top] = self.first_point();
        (0..self.rows * self.columns)
            .map(|id| {
                let (row, column) = (id / self.columns, id % self.columns);
                Point3::new(left + column as f64 * self.pitch, top + row as f64 * self.pitch, 0.0)
            })
            .collect()
    }

    /// Where the point with id 0 is.
    #[must_use]
    pub fn first_point(&self) -> [f64; 2] {
        let middle = |count: usize| -(count as f64 - 1.0) / 2.0 * self.pitch;
        match self.origin {
            Origin::Centre => [middle(self.columns), middle(self.rows)],
            Origin::FirstPoint => [0.0, 0.0],
        }
    }

    /// Refuses lattices that no chart has.
    ///
    /// # Errors
    ///
    /// [`wheatstone_core::Error::Setting`].
    pub fn validate(&self) -> Result<()> {
        for (setting, count) in [("columns", self.columns), ("rows", self.rows)] {
            if !(2..=500).contains(&count) {
                let need = "2 to 500 (inner corners or crossings, not squares)";
                return Err(refused(setting, count, need));
            }
        }
        if !(self.pitch.is_finite() && self.pitch > 0.0) {
            return Err(refused("pitch", self.pitch, "a length above 0, in the capture's unit"));
        }
        Ok(())
    }

    /// Every way in which the points found can lie on the chart. Where the chart would go on beyond
    /// them, it must go on outside the picture: otherwise more of it would have been found.
    ///
    /// Where squares between the points have colours that matter, `first_square` names one, by its
    /// lowest labels, that has the colour of the square below and right of point 0.
    #[must_use]
    pub fn place(
        &self,
        found: &[Labelled],
        image: &GrayImage,
        first_square: Option<(i32, i32)>,
    ) -> ChartSearch {
        let mut turned = Found::new(found, first_square);
        let mut readings: Vec<(f64, Detection)> = Vec::new();
        for _ in 0..4 {
            turned.turn();
            let upright = turned.uprightness();
            let offsets = self.offsets(&turned, image);
            readings
                .extend(offsets.into_iter().map(|offset| (upright, self.read(&turned, offset))));
        }
        if readings.is_empty() {
            return ChartSearch::NotFound(self.why_not(&turned));
        }
        readings.sort_by(|a, b| b.0.total_cmp(&a.0));
        ChartSearch::Found(readings.into_iter().map(|(_, reading)| reading).collect())
    }

    /// Where the found points' first row and column can be on the chart.
    fn offsets(&self, found: &Found, image: &GrayImage) -> Vec<(i32, i32)> {
        let (width, height) = found.size();
        let (columns, rows) = (self.columns as i32, self.rows as i32);
        if width > columns || height > rows {
            return Vec::new();
        }
        let ends = |side| found.ends_in_picture(side, image);
        let (left, right, top, bottom) =
            (ends(Side::Left), ends(Side::Right), ends(Side::Top), ends(Side::Bottom));
        let along_columns =
            (0..=columns - width).filter(|at| !(*at > 0 && left || *at + width < columns && right));
        along_columns
            .flat_map(|column| (0..=rows - height).map(move |row| (column, row)))
            .filter(|(_, at)| !(*at > 0 && top || *at + height < rows && bottom))
            .filter(|(column, row)| match found.first_square {
                Some(square) => (square.0 + square.1 + column + row).rem_euclid(2) == 0,
                None => true,
            })
            .collect()
    }

    fn read(&self, found: &Found, (columns, rows): (i32, i32)) -> Detection {
        let id = |(column, row): &(i32, i32)| {
            (row + rows) as usize * self.columns + (column + columns) as usize
        };
        let mut points: Vec<_> =
            found.points.iter().map(|(label, pixel)| (id(label), *pixel)).collect();
        points.sort_unstable_by_key(|(id, _)| *id);
        Detection { points, ..Detection::default() }
    }

    fn why_not(&self, found: &Found) -> String {
        let (width, height) = found.size();
        let (width, height) = (width.max(height), width.min(height));
        let declared = (self.columns.max(self.rows), self.columns.min(self.rows));
        if (width as usize, height as usize) == declared {
            return format!(
                "found {width} x {height} points, but their black and white pattern is that of another chart"
            );
        }
        let (long, short) = declared;
        if width as usize > long || height as usize > short {
            return format!(
                "found {width} x {height} points, more than the {long} x {short} of the chart"
            );
        }
        format!(
            "found {width} x {height} of the {long} x {short} points of the chart, and the others should be inside the picture"
        )
    }
}

/// The smallest count of found points, by the longer and the shorter side, that `why` mentions:
/// what a mistaken count of columns and rows can be told by.
#[must_use]
pub fn size_in_reason(why: &str) -> Option<(usize, usize)> {
    let mut words = why.strip_prefix("found ")?.split(' ');
    let width = words.next()?.parse().ok()?;
    let height = words.nth(1)?.parse().ok()?;
    Some((width, height))
}

/// A side of the found points.
#[derive(Clone, Copy)]
enum Side {
    Left,
    Right,
    Top,
    Bottom,
}

/// Found points under labels that begin at 0, x label rightwards of y label by a quarter turn.
struct Found {
    points: BTreeMap<(i32, i32), Pixel>,
    first_square: Option<(i32, i32)>,
}

impl Found {
    fn new(found: &[Labelled], first_square: Option<(i32, i32)>) -> Self {
        let points = found.iter().map(|point| ((point.column, point.row), point.pixel)).collect();
        let mut own = Self { points, first_square };
        let (along, down) = (own.direction((1, 0)), own.direction((0, 1)));
        // A chart is seen from its face: y turns from x as in the picture, or the labels are exchanged.
        if along.perp(&down) < 0.0 {
            own.relabel(|(column, row)| (row, column), |(column, row)| (row, column));
        }
        own
    }

    /// Turns the labels by a quarter.
    fn turn(&mut self) {
        // A square is named by its lowest labels, which belong to another of its corners afterwards.
        self.relabel(|(column, row)| (-row, column), |(column, row)| (-row - 1, column));
    }

    fn relabel(
        &mut self,
        point: impl Fn((i32, i32)) -> (i32, i32),
        square: impl Fn((i32, i32)) -> (i32, i32),
    ) {
        let points: BTreeMap<_, _> =
            self.points.iter().map(|(label, pixel)| (point(*label), *pixel)).collect();
        let column = points.keys().map(|label| label.0).min().unwrap_or(0);
        let row = points.keys().map(|label| label.1).min().unwrap_or(0);
        let shift = |label: (i32, i32)| (label.0 - column, label.1 - row);
        self.points = points.into_iter().map(|(label, pixel)| (shift(label), pixel)).collect();
        self.first_square = self.first_square.map(|label| shift(square(label)));
    }

    fn size(&self) -> (i32, i32) {
        let most = |pick: fn(&(i32, i32)) -> i32| self.points.keys().map(pick).max().unwrap_or(-1);
        (most(|label| label.0) + 1, most(|label| label.1) + 1)
    }

    /// Mean step in the picture from a point to its neighbour.
    fn direction(&self, step: (i32, i32)) -> nalgebra::Vector2<f64> {
        let steps: Vec<_> = self
            .points
            .iter()
            .filter_map(|(label, pixel)| {
                self.points.get(&(label.0 + step.0, label.1 + step.1)).map(|next| next - pixel)
            })
            .collect();
        steps.iter().sum::<nalgebra::Vector2<f64>>() / steps.len().max(1) as f64
    }

    /// Cosine of the angle from the picture's x axis to the x labels' direction.
    fn uprightness(&self) -> f64 {
        let along = self.direction((1, 0));
        along.x / along.norm().max(f64::MIN_POSITIVE)
    }

    /// Whether the next row or column beyond this side would lie in the picture. Nothing was found
    /// there, so the chart ends here.
    fn ends_in_picture(&self, side: Side, image: &GrayImage) -> bool {
        let (width, height) = self.size();
        let inward = match side {
            Side::Left => (1, 0),
            Side::Right => (-1, 0),
            Side::Top => (0, 1),
            Side::Bottom => (0, -1),
        };
        let on_side = |label: &(i32, i32)| match side {
            Side::Left => label.0 == 0,
            Side::Right => label.0 == width - 1,
            Side::Top => label.1 == 0,
            Side::Bottom => label.1 == height - 1,
        };
        let at = |label: &(i32, i32), steps: i32| {
            self.points.get(&(label.0 + steps * inward.0, label.1 + steps * inward.1))
        };
        let (mut asked, mut inside) = (0, 0);
        for (label, here) in self.points.iter().filter(|(label, _)| on_side(label)) {
            let Some(next) = at(label, 1) else { continue };
            let step = here - next;
            // Perspective and lens make steps grow or shrink steadily.
            let change =
                at(label, 2).map_or(nalgebra::Vector2::zeros(), |third| step - (next - third));
            let beyond = here + step + change;
            asked += 1;
            // Nearer than this to the border a crossing has too little around it to be found.
            inside += usize::from(image.contains(beyond, 0.4 * step.norm()));
        }
        // A few may be hidden or hard to see.
        inside * 5 > asked
    }
}
