//! How good a map is: errors in the user's unit on points that it has not seen, comparison of
//! methods, the floor that pixel noise sets, and error ellipsoids that hold.

mod boards;
mod budget;
pub mod camera_motion;
mod compare;
mod coverage;
mod cross_validation;
mod floor;
mod linear_error;
mod one_camera;

pub use boards::{BoardEvaluation, BoardView, Deviation, Lengths, evaluate_boards};
pub use budget::{Budget, HeldOut, Part, Reference};
pub use camera_motion::{CameraChange, CameraMotion, camera_motion};
pub use compare::{Comparison, MethodScore, compare, divide};
pub use coverage::{Coverage, Distance, Ellipsoids, coverage, mahalanobis2};
pub(crate) use cross_validation::hold_out_of;
pub use cross_validation::{CrossValidation, FoldScore, cross_validate, hold_out};
pub use floor::floor;
pub use linear_error::LinearError;
pub use one_camera::evaluate_one_camera;
pub(crate) use one_camera::{hold_out_one_camera, on_its_own_points};

use crate::{
    Error, Result,
    dataset::Dataset,
    error::{Hint, Remedy},
    geometry::{Point3, Pose, ProjectionMatrix, Vector3},
    method::Reconstructor,
    unit,
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::statistics::{mean, median, percentile, root_mean_square};

/// `data` with its known places moved as a whole to where the map puts them: what is left is the map's
/// own error, whatever the two frames are. `None` where too few points are located, or all on a line.
#[must_use]
pub fn aligned(reconstructor: &dyn Reconstructor, data: &Dataset) -> Option<Dataset> {
    let pairs: Vec<(Point3, Point3)> = data
        .known()
        .filter_map(|(world, row)| Some((world, reconstructor.locate(&row.pixels)?.point)))
        .collect();
    let motion = Pose::aligning(&pairs)?;
    let mut moved = data.clone();
    for row in &mut moved.correspondences {
        row.world = row.world.map(|world| motion.transform(world));
    }
    Some(moved)
}

/// Errors of located points against known ones, in the unit of the world; of one camera alone, those of
/// its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    /// The unit of the lengths below.
    pub unit: String,
    /// Points with a known place that at least two cameras saw.
    pub n: usize,
    /// Those of them that were located.
    pub located: usize,
    /// Root mean square distance.
    pub rms: f64,
    /// Mean distance.
    pub mean: f64,
    /// Median distance.
    pub median: f64,
    /// The distance that 95 % of the points stay below.
    pub p95: f64,
    /// Mean of the distance as a percentage of the point's distance from the cameras.
    pub mean_percent: f64,
    /// Root mean square along X, Y and Z.
    pub rms_xyz: [f64; 3],
}

/// One located point beside its true place.
#[derive(Clone, Copy, Debug)]
pub struct PointError {
    /// The point's place among the dataset's correspondences.
    pub row: usize,
    /// Located minus true.
    pub difference: Vector3,
    /// From the cameras to the true place.
    pub working_distance: f64,
}

/// The middle of the cameras, from the points that each of them saw: their centres follow in closed
/// form from the direct linear transformation, wherever the world's origin is. `None` where they do
/// not (too few points, all on a plane).
#[must_use]
pub fn viewpoint(data: &Dataset) -> Option<Point3> {
    let centres: Option<Vec<Point3>> = (0..data.cameras)
        .map(|camera| ProjectionMatrix::fit(&data.seen_by_camera(camera))?.centre())
        .collect();
    let centres = centres?;
    let sum: Vector3 = centres.iter().map(|centre| centre.coords).sum();
    Some(Point3::from(sum / centres.len() as f64))
}

/// The points of `data` that can be judged: place known, seen by two cameras or more.
#[must_use]
pub fn judged(data: &Dataset) -> usize {
    data.known().filter(|(_, row)| row.seen_by() >= 2).count()
}

/// The error of each point that is located.
#[must_use]
pub fn point_errors(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
    viewpoint: Option<Point3>,
) -> Vec<PointError> {
    let from = viewpoint.unwrap_or(Point3::origin());
    data.correspondences
        .iter()
        .enumerate()
        .filter_map(|(index, row)| {
            let world = row.world?;
            let point = reconstructor.locate_point(&row.pixels)?;
            Some(PointError {
                row: index,
                difference: point - world,
                working_distance: (world - from).norm(),
            })
        })
        .collect()
}

/// The unit that lengths of `data` seem to be in, where that is not the `given` one, for which they were taken: located
/// points are spread as widely once it is put right, and lie ten times as near about their middle.
#[must_use]
fn mistaken_unit(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
    given: &str,
) -> Option<&'static str> {
    let errors = point_errors(reconstructor, data, None);
    let world = |error: &PointError| data.correspondences[error.row].world;
    let pairs: Vec<(Point3, Point3)> =
        errors.iter().filter_map(|e| world(e).map(|at| (at, at + e.difference))).collect();
    let count = pairs.len() as f64;
    let sums = pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |(at, found), pair| {
        (at + pair.0.coords, found + pair.1.coords)
    });
    let from_middle: Vec<(Vector3, Vector3)> = pairs
        .iter()
        .map(|(at, found)| (at.coords - sums.0 / count, found.coords - sums.1 / count))
        .collect();
    let true_spread = mean(&from_middle.iter().map(|(at, _)| at.norm()).collect::<Vec<_>>());
    let found_spread = mean(&from_middle.iter().map(|(_, found)| found.norm()).collect::<Vec<_>>());
    let unit = unit::mistaken(given, found_spread / true_spread)?;
    let factor = unit::factor(unit, given)?;
    let off = |scale: f64| {
        let apart = from_middle.iter().map(|(at, found)| (found - at * scale).norm());
        median(&apart.collect::<Vec<_>>())
    };
    (off(factor) < 0.1 * off(1.0)).then_some(unit)
}

/// Refuses places that seem to be in another unit than the `given` one; `data` are converted from that.
///
/// # Errors
///
/// [`Error::Faulty`], with the unit.
pub fn refuse_mistaken_unit(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
    given: &str,
) -> Result<()> {
    mistaken_unit(reconstructor, data, given).map_or(Ok(()), |unit| {
        Err(Error::Faulty {
            code: "unit".into(),
            problem: format!("these lengths look like {unit}, but were read as {given}"),
            hint: Hint::new(format!("say that the points are in {unit}"), Remedy::Unit),
        })
    })
}

/// Sums errors up; `n` is how many points there were to locate.
///
/// # Errors
///
/// [`Error::Degenerate`] where none was located.
pub fn summarise(errors: &[PointError], n: usize, unit: &str) -> Result<Evaluation> {
    if errors.is_empty() {
        return Err(Error::Degenerate {
            problem: format!("none of {n} points with known coordinates could be located"),
            hint: "at least two cameras must see each point; the network needs all of them".into(),
        });
    }
    let distances: Vec<f64> = errors.iter().map(|error| error.difference.norm()).collect();
    let percents: Vec<f64> = errors
        .iter()
        .zip(&distances)
        .map(|(error, distance)| 100.0 * distance / error.working_distance)
        .collect();
    let along = |axis: usize| {
        root_mean_square(&errors.iter().map(|error| error.difference[axis]).collect::<Vec<_>>())
    };
    Ok(Evaluation {
        unit: unit.into(),
        n,
        located: errors.len(),
        rms: root_mean_square(&distances),
        mean: mean(&distances),
        median: median(&distances),
        p95: percentile(&distances, 0.95),
        mean_percent: mean(&percents),
        rms_xyz: [along(0), along(1), along(2)],
    })
}

/// Judges a map on points whose places are known.
///
/// # Errors
///
/// [`Error::Mismatch`] where the numbers of cameras differ, [`Error::Degenerate`] where no point
/// could be located.
pub fn evaluate(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
    viewpoint: Option<Point3>,
) -> Result<Evaluation> {
    if reconstructor.cameras() != data.cameras {
        return Err(Error::Mismatch {
            what: "number of cameras",
            model: reconstructor.cameras().to_string(),
            data: data.cameras.to_string(),
        });
    }
    summarise(&point_errors(reconstructor, data, viewpoint), judged(data), &data.unit)
}
