//! Errors that are linear in the coordinates: those of frames that are stretched or sheared against each other.
//!
//! Cameras that fit their chart at wrong places fit a world that is off. A wrong pitch stretches it, a stage that moves
//! obliquely to its chart shears it, a camera that drifts while planes are shown in order does so too. No other lens mends
//! that.

use super::{Coverage, point_errors};
use crate::{dataset::Dataset, geometry::Vector3, method::Reconstructor};
use serde::Serialize;
use wheatstone_numeric::{least_squares::solve, statistics::median};

/// The part of errors that is linear in the coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LinearError {
    /// By how much X, Y and Z are off (rows) for each unit of X, Y and Z (columns).
    pub slopes: [[f64; 3]; 3],
    /// Its share of the squared error, 0 to 1.
    pub share: f64,
}

/// Of fewer points twelve numbers take up a tenth of the noise.
const LEAST_POINTS: usize = 50;

/// Its least share: errors of lenses and noise leave less.
const MOST_OF_IT: f64 = 0.7;

/// Errors of so many times the median are gross ones.
const GROSS: f64 = 5.0;

/// The share of points in their 95 % ellipsoids above which nothing is to be explained.
const HOLD: f64 = 0.85;

impl LinearError {
    /// Of points whose error bars do not hold; `None` where they do, or where the errors are not linear.
    #[must_use]
    pub fn fit(map: &dyn Reconstructor, data: &Dataset, held: Option<Coverage>) -> Option<Self> {
        if held.is_some_and(|held| held.p95 > HOLD) {
            return None;
        }
        let errors = point_errors(map, data, None);
        let size = median(&errors.iter().map(|e| e.difference.norm()).collect::<Vec<_>>());
        let pairs: Vec<(Vector3, Vector3)> = errors
            .iter()
            .filter(|error| error.difference.norm() < GROSS * size)
            .filter_map(|e| Some((data.correspondences[e.row].world?.coords, e.difference)))
            .collect();
        let middle = pairs.iter().map(|(at, _)| at).sum::<Vector3>() / pairs.len() as f64;
        let terms: Vec<f64> =
            pairs.iter().flat_map(|(at, _)| <[f64; 4]>::from((at - middle).push(1.0))).collect();
        let right: Vec<f64> = pairs.iter().flat_map(|(_, by)| [by.x, by.y, by.z]).collect();
        let found = solve(&terms, 4, &right, 3)?;
        let explained = |at: &Vector3| found.transpose() * (at - middle).push(1.0);
        let left = pairs.iter().map(|(at, by)| (by - explained(at)).norm_squared()).sum::<f64>();
        let share = 1.0 - left / pairs.iter().map(|(_, by)| by.norm_squared()).sum::<f64>();
        let slopes = [0, 1, 2].map(|of| [0, 1, 2].map(|by| found[(by, of)]));
        (pairs.len() >= LEAST_POINTS && share > MOST_OF_IT).then_some(Self { slopes, share })
    }
}
