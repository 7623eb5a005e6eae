//! The plate of two levels that particle image velocimetry calibrates with: a grid of dots, and a second
//! one beside and behind it.

use super::{
    Chart, ChartSearch, PictureOf, PointId, Shape, lattice::Origin, length, point_list::PointList,
    refused,
};
use crate::imaging::GrayImage;
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use wheatstone_core::{
    Result,
    geometry::{Pixel, Point3},
};

/// Two equal grids of dots, the second moved. The points are the dots' centres, those of the first level
/// before those of the second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwoLevel {
    /// Dots a row of one level.
    pub columns: usize,
    /// Rows of one level.
    pub rows: usize,
    /// Distance of neighbours of one level, in the user's unit.
    pub pitch: f64,
    /// From a dot of the first level to that of the second with the same column and row, in the user's
    /// unit: x right, y down, z into the plate.
    pub second: [f64; 3],
    /// Rows of the second level, where it has another number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_rows: Option<usize>,
    /// Columns of the second level, where it has another number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second_columns: Option<usize>,
    /// Of a dot, in the user's unit; 0.3 of the pitch where it is left out. Used for drawing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter: Option<f64>,
    /// A table with columns `id,x1,y1,x2,y2,…`: some points, and where each camera observes them to some pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<PathBuf>,
    /// Where the chart's frame begins.
    #[serde(default)]
    pub origin: Origin,
    /// The same as a list of points.
    #[serde(skip)]
    list: Option<PointList>,
}

impl Default for TwoLevel {
    /// Half a pitch aside, with a column and a row less; both levels at one depth, as a print of them is.
    fn default() -> Self {
        Self {
            columns: 10,
            rows: 7,
            pitch: 20.0,
            second: [10.0, 10.0, 0.0],
            second_rows: Some(6),
            second_columns: Some(9),
            diameter: None,
            start: None,
            origin: Origin::Centre,
            list: None,
        }
    }
}

impl TwoLevel {
    fn counts(&self) -> [(usize, usize); 2] {
        let second =
            (self.second_columns.unwrap_or(self.columns), self.second_rows.unwrap_or(self.rows));
        [(self.columns, self.rows), second]
    }

    fn as_list(&self) -> PointList {
        if let Some(list) = &self.list {
            return list.clone();
        }
        let mut list = PointList::new(self.points().iter().map(|p| [p.x, p.y, p.z]).collect());
        list.diameter = Some(self.diameter.unwrap_or(0.3 * self.pitch));
        list.start.clone_from(&self.start);
        list
    }

    /// The readings in which the plate is seen from where its dots are. Of a plate so thin a picture hardly tells whether the
    /// second level lies before or behind the first, and its mirror image is what it would be from behind.
    fn seen_from_its_face(&self, search: ChartSearch) -> ChartSearch {
        let ChartSearch::Found(mut readings) = search else { return search };
        let points = self.points();
        readings.retain(|reading| {
            let count = reading.points.len().max(1) as f64;
            let pairs =
                || reading.points.iter().map(|(id, pixel)| (points[*id].coords.xy(), pixel.coords));
            let middle = pairs()
                .fold((Vector2::zeros(), Vector2::zeros()), |sum, (place, pixel)| {
                    (sum.0 + place / count, sum.1 + pixel / count)
                });
            let products =
                pairs().map(|(place, pixel)| (pixel - middle.1) * (place - middle.0).transpose());
            products.fold(Matrix2::zeros(), |sum, product| sum + product).determinant() > 0.0
        });
        if readings.is_empty() {
            return ChartSearch::NotFound(
                "the plate is seen as in a mirror: give `second` with x to the right and y down, as someone observes the plate's face, and turn pictures over that a mirror reverses".into(),
            );
        }
        ChartSearch::Found(readings)
    }

    /// Adds a point that a camera is known to see about `pixel`; in one view, or in all.
    #[must_use]
    pub fn with_start(mut self, camera: usize, view: Option<&str>, point: (usize, Pixel)) -> Self {
        self.list = Some(self.as_list().with_start(camera, view, point));
        self
    }
}

impl Chart for TwoLevel {
    fn points(&self) -> Vec<Point3> {
        let first = match self.origin {
            Origin::FirstPoint => [0.0, 0.0],
            Origin::Centre => {
                [self.columns, self.rows].map(|count| -(count as f64 - 1.0) / 2.0 * self.pitch)
            }
        };
        let mut points = Vec::new();
        for ((columns, rows), moved) in self.counts().into_iter().zip([[0.0; 3], self.second]) {
            for at in 0..columns * rows {
                let (row, column) = (at / columns, at % columns);
                points.push(Point3::new(
                    first[0] + column as f64 * self.pitch + moved[0],
                    first[1] + row as f64 * self.pitch + moved[1],
                    moved[2],
                ));
            }
        }
        points
    }

    fn load(&mut self, folder: &Path) -> Result<()> {
        let mut list = self.as_list();
        list.load(folder)?;
        self.list = Some(list);
        Ok(())
    }

    fn shapes(&self) -> Vec<Shape> {
        self.as_list().shapes()
    }

    fn label(&self, scale: f64) -> String {
        let pitch = length(scale * self.pitch);
        let [(columns, rows), (second_columns, second_rows)] = self.counts();
        format!(
            "{columns} columns x {rows} rows of dots and {second_columns} x {second_rows}, pitch {pitch} mm"
        )
    }

    fn size(&self) -> Option<(&'static str, f64)> {
        Some(("pitch", self.pitch))
    }

    fn board(&self) -> [f64; 4] {
        self.as_list().board()
    }

    fn reflectance(&self, place: [f64; 2], size: [f64; 2]) -> Option<f64> {
        self.as_list().reflectance(place, size)
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        self.seen_from_its_face(self.as_list().detect(image))
    }

    fn detect_in(&self, image: &GrayImage, of: PictureOf) -> ChartSearch {
        self.seen_from_its_face(self.as_list().detect_in(image, of))
    }

    fn named_in(&self, of: PictureOf) -> Vec<(PointId, Pixel)> {
        self.as_list().named_in(of)
    }

    fn validate(&self) -> Result<()> {
        for (columns, rows) in self.counts() {
            if columns < 2 || rows < 2 || columns * rows > 2_500 {
                let need = "2 or more each, and at most 2500 dots a level";
                return Err(refused("columns, rows", format!("{columns}, {rows}"), need));
            }
        }
        if !(self.pitch.is_finite() && self.pitch > 0.0) {
            return Err(refused("pitch", self.pitch, "a length above 0, in the capture's unit"));
        }
        self.as_list().validate()
    }
}
