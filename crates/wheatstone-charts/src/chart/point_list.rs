//! The point list: any rigid object with marks at known places, in three dimensions.

mod file;

use super::{
    Chart, ChartSearch, PictureOf, PointId, Shape, refused,
    rigid::{self, MarkKind},
};
use crate::imaging::GrayImage;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use wheatstone_core::{
    Result,
    geometry::{Pixel, Point3},
};

/// Marks at listed places. The points are the marks' centres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointList {
    /// A table with columns `X,Y,Z` and, where points have names, `id`, in the user's unit; beside the
    /// capture's file unless the path is absolute.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The points where no file is given, `[X, Y, Z]` each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 3]>,
    /// A table with columns `id,x1,y1,x2,y2,…`: some points, and where each camera observes them to some pixels,
    /// empty where it does not; with a column `view`, those of one view only. Four or more points lead the
    /// search, one tells apart what looks alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<PathBuf>,
    /// What the marks are: `patches` (dots, squares), or `corners` of chessboards, which may meet at edges.
    #[serde(default, skip_serializing_if = "is_patches")]
    pub marks: MarkKind,
    /// Of a mark, in the user's unit; 0.4 of the least distance where it is left out. Used for drawing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diameter: Option<f64>,
    /// The points' names, in the order of their ids, as the file has them.
    #[serde(skip)]
    names: Vec<String>,
    /// What the start file says.
    #[serde(skip)]
    named: Vec<file::Named>,
}

fn is_patches(kind: &MarkKind) -> bool {
    *kind == MarkKind::Patches
}

impl Default for PointList {
    /// A plate with a corner cut off, so that it looks the same from one side only.
    fn default() -> Self {
        let places = (0..8).flat_map(|row| (0..10).map(move |column| (column, row)));
        let points = places
            .filter(|(column, row)| column + row > 3)
            .map(|(column, row)| [f64::from(column) * 20.0, f64::from(row) * 20.0, 0.0])
            .collect();
        Self::new(points)
    }
}

impl PointList {
    /// A list of these points.
    #[must_use]
    pub fn new(points: Vec<[f64; 3]>) -> Self {
        Self {
            file: None,
            points,
            start: None,
            marks: MarkKind::Patches,
            diameter: None,
            names: Vec::new(),
            named: Vec::new(),
        }
    }

    /// Adds a point that a camera is known to see about `pixel`; in one view, or in all.
    #[must_use]
    pub fn with_start(
        mut self,
        camera: usize,
        view: Option<&str>,
        point: (PointId, Pixel),
    ) -> Self {
        let view = view.map(String::from);
        self.named.push(file::Named { camera, view, id: point.0, pixel: point.1 });
        self
    }

    fn radius(&self) -> f64 {
        let least = || {
            let points = self.points();
            let pairs = points.iter().enumerate().flat_map(|(index, one)| {
                points[..index].iter().map(move |other| (other - one).norm())
            });
            pairs.fold(f64::INFINITY, f64::min)
        };
        self.diameter.unwrap_or_else(|| 0.4 * least()) / 2.0
    }
}

impl Chart for PointList {
    fn points(&self) -> Vec<Point3> {
        self.points.iter().map(|point| Point3::from(*point)).collect()
    }

    fn name(&self, id: PointId) -> String {
        self.names.get(id).cloned().unwrap_or_else(|| id.to_string())
    }

    fn load(&mut self, folder: &Path) -> Result<()> {
        if let Some(path) = &self.file {
            let listed = file::read_points(&folder.join(path))?;
            self.points = listed.points;
            self.names = listed.names;
        }
        if let Some(path) = &self.start {
            self.named = file::read_start(&folder.join(path), |name| {
                (0..self.points.len()).find(|id| self.name(*id) == name)
            })?;
        }
        Ok(())
    }

    fn shapes(&self) -> Vec<Shape> {
        let radius = self.radius();
        self.points.iter().map(|[x, y, _]| Shape::Disc([*x, *y], radius)).collect()
    }

    fn board(&self) -> [f64; 4] {
        let margin = 2.0 * self.radius();
        let edge = |axis: usize, sign: f64| {
            let values = self.points.iter().map(|point| sign * point[axis]);
            sign * (values.fold(f64::MIN, f64::max) + margin)
        };
        [edge(0, -1.0), edge(1, -1.0), edge(0, 1.0), edge(1, 1.0)]
    }

    fn reflectance(&self, [x, y]: [f64; 2], size: [f64; 2]) -> Option<f64> {
        let [left, top, right, bottom] = self.board();
        if x < left || x > right || y < top || y > bottom {
            return None;
        }
        let radius = self.radius();
        let far = radius + size[0].max(size[1]);
        let ink: f64 = self
            .points
            .iter()
            .map(|place| [x - place[0], y - place[1]])
            .filter(|from| from[0].abs() < far && from[1].abs() < far)
            .map(|from| super::dot_grid::covered(from, size, radius))
            .sum();
        Some(1.0 - ink)
    }

    fn detect(&self, image: &GrayImage) -> ChartSearch {
        rigid::find(&self.points(), self.marks, image, &[])
    }

    fn detect_in(&self, image: &GrayImage, of: PictureOf) -> ChartSearch {
        let named = self.named_in(of);
        let points = self.points();
        let found = rigid::find(&points, self.marks, image, &named);
        let has_views = self.named.iter().any(|it| it.view.is_some());
        if matches!(found, ChartSearch::Found(_)) || named.is_empty() || has_views {
            return found;
        }
        // Points of no view lie where they do in one picture, and lead nowhere in others.
        match rigid::find(&points, self.marks, image, &[]) {
            ChartSearch::Found(readings) => ChartSearch::Found(readings),
            ChartSearch::NotFound(_) => found,
        }
    }

    fn named_in(&self, of: PictureOf) -> Vec<(PointId, Pixel)> {
        let here = |named: &&file::Named| {
            named.camera == of.camera && named.view.as_deref().is_none_or(|view| view == of.view)
        };
        self.named.iter().filter(here).map(|named| (named.id, named.pixel)).collect()
    }

    fn validate(&self) -> Result<()> {
        if self.file.is_some() && self.points.is_empty() {
            // Not read yet.
            return Ok(());
        }
        if !(4..=MOST_POINTS).contains(&self.points.len()) {
            let need = "4 to 5000 points, in `file` or in `points`";
            return Err(refused("points", self.points.len(), need));
        }
        if let Some(point) = self.points.iter().find(|point| !point.iter().all(|it| it.is_finite()))
        {
            return Err(refused("points", format!("{point:?}"), "three finite numbers per point"));
        }
        let mut sorted = self.points.clone();
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(refused("points", format!("{:?} twice", pair[0]), "each point only once"));
        }
        Ok(())
    }
}

/// Distances of all pairs are looked at, which takes a second for ten times as many.
const MOST_POINTS: usize = 5_000;
