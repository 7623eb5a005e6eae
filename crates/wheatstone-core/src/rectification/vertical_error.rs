//! What is left of vertical differences, and of the places that rectified pixels tell.

use super::{ErrorSummary, Rectification};
use crate::{
    dataset::{Dataset, SavedDataset},
    geometry::{Pixel, Point3},
};
use rayon::prelude::*;
use serde::Serialize;

/// Vertical differences within a slice of the space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AtDepth {
    /// The slice's middle, from the virtual cameras, in world units.
    pub depth: f64,
    /// Vertical differences in pixels.
    pub vertical: ErrorSummary,
}

/// What is left between the two rectified pictures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerticalErrors {
    /// Vertical differences between where the two show a point, in pixels of the rectified pictures.
    pub vertical: ErrorSummary,
    /// The same by depth, from near to far.
    pub by_depth: Vec<AtDepth>,
    /// How far from its known place a point lies that is told by its rectified pixels and `Q`, in world
    /// units; none where no place is known.
    pub place: Option<ErrorSummary>,
    /// Least and largest disparity (left x less right x), in pixels.
    pub disparity: [f64; 2],
}

/// What is left in the space that a model was shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VerticalError {
    /// At random places of the space, as the model observes them: what no pinholes can do, without noise. Of
    /// what the model itself has wrong it knows nothing.
    pub model: Option<VerticalErrors>,
    /// Of the measured pixels of the points that the model was fitted to: with their noise, and with what
    /// the model has wrong.
    pub measured: Option<VerticalErrors>,
    /// How far from the pixels of a model without a map to pixels, such as a network, the map lies that was
    /// learned from it, in pixels.
    pub followed: Option<ErrorSummary>,
}

/// Slices of equal depth: enough to see a course.
const SLICES: usize = 5;

/// One point.
struct PointError {
    depth: f64,
    vertical: f64,
    disparity: f64,
    miss: Option<f64>,
}

impl VerticalError {
    pub(super) fn of(made: &Rectification, data: &SavedDataset) -> Self {
        let seen = |place: &Point3| {
            let pixel = |side: usize| made.maps.project(side, *place);
            made.seen([pixel(0)?, pixel(1)?], Some(*place))
        };
        Self {
            model: judged(&made.places.par_iter().filter_map(seen).collect::<Vec<_>>()),
            measured: made.judge(&data.restored()),
            followed: made.maps.followed,
        }
    }
}

impl Rectification<'_> {
    /// Judges the pair on points that the model's two cameras saw and both rectified pictures show (`data` holds all of the
    /// model's cameras). `None` where there are none.
    #[must_use]
    pub fn judge(&self, data: &Dataset) -> Option<VerticalErrors> {
        let seen = |row: &crate::dataset::Correspondence| {
            let pixel = |side: usize| *row.pixels.get(self.pair.cameras[side])?;
            self.seen([pixel(0)?, pixel(1)?], row.world)
        };
        judged(&data.correspondences.par_iter().filter_map(seen).collect::<Vec<_>>())
    }

    fn seen(&self, pixels: [Pixel; 2], world: Option<Point3>) -> Option<PointError> {
        let (left, right) = (self.rectified(0, pixels[0])?, self.rectified(1, pixels[1])?);
        if ![left, right].iter().all(|at| self.pair.holds(*at)) {
            return None;
        }
        let told = self.meet(left, right);
        let known = world.map(|world| self.pair.rectified_from_world.transform(world));
        Some(PointError {
            depth: known.or(told)?.z,
            vertical: (left.y - right.y).abs(),
            disparity: left.x - right.x,
            // A point that is told to lie behind the cameras is as far off as can be.
            miss: known.map(|known| told.map_or(f64::INFINITY, |told| (told - known).norm())),
        })
    }
}

fn judged(all: &[PointError]) -> Option<VerticalErrors> {
    let low = |of: fn(&PointError) -> f64| all.iter().map(of).fold(f64::INFINITY, f64::min);
    let high = |of: fn(&PointError) -> f64| all.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
    let near = low(|seen| seen.depth);
    let thick = (high(|seen| seen.depth) - near) / SLICES as f64;
    let slice = |index: usize| {
        let begins = near + thick * index as f64;
        let last = index + 1 == SLICES;
        let within =
            |seen: &&PointError| seen.depth >= begins && (last || seen.depth < begins + thick);
        let vertical = all.iter().filter(within).map(|seen| seen.vertical).collect();
        Some(AtDepth { depth: begins + thick / 2.0, vertical: ErrorSummary::of(vertical)? })
    };
    Some(VerticalErrors {
        vertical: ErrorSummary::of(all.iter().map(|seen| seen.vertical).collect())?,
        by_depth: (0..SLICES).filter_map(slice).collect(),
        place: ErrorSummary::of(all.iter().filter_map(|seen| seen.miss).collect()),
        disparity: [low(|seen| seen.disparity), high(|seen| seen.disparity)],
    })
}
