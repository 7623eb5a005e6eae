//! Where the second camera may see what the first one observes: a curve for each pixel, taken from the
//! calibration whatever its method.

use super::curve::{Curve, Waypoint};
use crate::Ground;
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use wheatstone_core::{
    Calibration, Error, Result,
    geometry::{Pixel, Point3},
    method::{AnyMethod, AnyReconstructor},
};
use wheatstone_numeric::{progress::Progress, statistics::root_mean_square};

/// Distances ahead between which anything is sought, in centimetres: nearer than the floor that is
/// seen, and farther than the walls.
const NEAR: f64 = 20.0;
const FAR: f64 = 700.0;

/// Places on a curve, evenly in inverse distance: some four pixels apart, over which it is straight.
const LEVELS: usize = 32;

/// Pixels between the places of the first picture that have curves of their own: lenses bend little
/// over so few.
const STEP: usize = 16;

/// The curves of a raster of pixels of the first picture.
pub struct EpipolarCurves {
    columns: usize,
    rows: usize,
    /// Row by row, column by column, near to far.
    waypoints: Vec<Option<Waypoint>>,
}

impl EpipolarCurves {
    /// From a calibration of two cameras with pictures of this size.
    ///
    /// # Errors
    ///
    /// Those of a fit of the neural camera, for methods that only say where pairs of pixels meet: it
    /// then learns from the same points where single ones look. [`Error::Degenerate`] where nothing
    /// is seen by both.
    pub fn new(
        calibration: &Calibration,
        [width, height]: [usize; 2],
        progress: &dyn Progress,
    ) -> Result<Self> {
        let guide = if calibration.reconstructor.has_projection() {
            calibration.reconstructor.clone()
        } else {
            let data = calibration.data.restored();
            AnyMethod::named("neural-camera")?.fit_checked(&data, 0, progress)?.reconstructor
        };
        let (columns, rows) = (width.div_ceil(STEP) + 1, height.div_ceil(STEP) + 1);
        let node = |index: usize| {
            let [x, y] = [index % columns, index / columns].map(|at| (at * STEP) as f64);
            curve(&guide, Pixel::new(x, y))
        };
        let waypoints: Vec<Option<Waypoint>> =
            (0..columns * rows).into_par_iter().flat_map_iter(node).collect();
        if waypoints.iter().flatten().count() < LEVELS {
            return Err(Error::Degenerate {
                problem: "the calibration gives no epipolar curve for any pixel".into(),
                hint: "calibrate with another method".into(),
            });
        }
        Ok(Self { columns, rows, waypoints })
    }

    /// The curve of a pixel.
    #[must_use]
    pub fn curve(&self, pixel: Pixel) -> Curve {
        let place = [pixel.x / STEP as f64, pixel.y / STEP as f64];
        let cell = [
            (place[0].max(0.0) as usize).min(self.columns - 2),
            (place[1].max(0.0) as usize).min(self.rows - 2),
        ];
        let [u, v] = [place[0] - cell[0] as f64, place[1] - cell[1] as f64];
        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let starts = [0, 1, self.columns, self.columns + 1]
            .map(|beside| (cell[1] * self.columns + cell[0] + beside) * LEVELS);
        let at = |level: usize| {
            let (mut other, mut point) = (Vector2::zeros(), nalgebra::Vector3::zeros());
            for (start, weight) in starts.iter().zip(weights) {
                let node = self.waypoints[start + level]?;
                other += node.other.coords * weight;
                point += node.point.coords * weight;
            }
            Some(Waypoint { other: other.into(), point: point.into() })
        };
        Curve::new((0..LEVELS).filter_map(at).collect())
    }

    /// How far from the chart's own points the lines of sight put them, root mean square, in centimetres.
    #[must_use]
    pub(super) fn own_error(&self, calibration: &Calibration) -> f64 {
        let data = calibration.data.restored();
        let off = data.known().filter_map(|(world, row)| {
            let [Some(first), Some(second)] = row.pixels[..] else { return None };
            Some((self.curve(first).point_near(second)? - world).norm())
        });
        root_mean_square(&off.collect::<Vec<f64>>())
    }

    /// Where a pixel of the first picture observes the floor.
    #[must_use]
    pub fn floor(&self, pixel: Pixel) -> Option<Ground> {
        let (_, Waypoint { point, .. }) = self.curve(pixel).floor()?;
        Some(Ground::new(point.x, point.z))
    }
}

/// The waypoints of one pixel.
fn curve(guide: &AnyReconstructor, pixel: Pixel) -> Vec<Option<Waypoint>> {
    let mut found = vec![None; LEVELS];
    // From the middle of what was shown, where the map is surest, outwards.
    const FIRST: f64 = 95.0;
    let depth = |level: usize| {
        let share = level as f64 / (LEVELS - 1) as f64;
        1.0 / (1.0 / NEAR + share * (1.0 / FAR - 1.0 / NEAR))
    };
    let middle = (0..LEVELS)
        .min_by(|a, b| (depth(*a) - FIRST).abs().total_cmp(&(depth(*b) - FIRST).abs()))
        .unwrap_or(0);
    let Some(start) = point_at(guide, pixel, Point3::new(0.0, -15.0, depth(middle))) else {
        return found;
    };
    let outwards: [Vec<usize>; 2] = [(middle..LEVELS).collect(), (0..=middle).rev().collect()];
    for levels in outwards {
        let mut last = start;
        let mut before: Option<Point3> = None;
        for level in levels {
            let z = depth(level);
            // Lines of sight are straight or nearly so.
            let guess = match before {
                Some(before) if (last.z - before.z).abs() > 1e-9 => {
                    last + (last - before) * ((z - last.z) / (last.z - before.z))
                }
                _ => Point3::new(last.x, last.y, z),
            };
            let Some(point) = point_at(guide, pixel, guess) else { break };
            found[level] = guide.project(1, point).map(|other| Waypoint { other, point });
            if (point.z - last.z).abs() > 1e-9 {
                before = Some(last);
            }
            last = point;
        }
    }
    found
}

/// The point at the distance of `guess` that the first camera observes at `pixel`.
fn point_at(guide: &AnyReconstructor, pixel: Pixel, guess: Point3) -> Option<Point3> {
    let mut point = guess;
    // Newton's steps; sight lines that do not come near within so many are no sight lines.
    for _ in 0..12 {
        let seen = guide.project(0, point)?;
        let off = pixel - seen;
        if off.norm() < 1e-3 {
            return Some(point);
        }
        let step = 1e-3 * point.z;
        let slope = |by: Point3| guide.project(0, by).map(|at| (at - seen) / step);
        let across = slope(Point3::new(point.x + step, point.y, point.z))?;
        let down = slope(Point3::new(point.x, point.y + step, point.z))?;
        let by = Matrix2::from_columns(&[across, down]).try_inverse()? * off;
        // No farther at once than the picture is wide.
        let by = by * (0.5 * point.z / by.norm().max(0.5 * point.z));
        point.x += by.x;
        point.y += by.y;
    }
    None
}
