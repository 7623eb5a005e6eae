//! One camera alone, judged in pixels: it locates no point, but it says where one falls.
//!
//! Where the chart stood in a view that the fit did not see is found from half of the view's points (their
//! places on the chart and a least-squares resection), and the other half is judged; then the halves change
//! places. Points of known place are judged as they are.

use super::{CrossValidation, Evaluation, FoldScore, PointError, summarise};
use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset, split::folds},
    geometry::{Pixel, Point3, Pose, Vector3, planar_pose},
    method::{AnyMethod, Reconstructor},
};
use nalgebra::{Matrix3, Matrix6, Vector6};
use rayon::prelude::*;
use wheatstone_numeric::{
    progress::{Muted, Progress},
    statistics::root_mean_square,
};

/// The unit of these errors.
const UNIT: &str = "px";

/// Steps of the resection; four to six are the rule from a place by the map between planes.
const STEPS: usize = 20;

/// A point with its pixel, and its row in the data.
type Observation = (usize, Point3, Pixel);

/// Judges a camera on points of known place, or on charts: any half of a view predicts the other.
///
/// # Errors
///
/// [`Error::Mismatch`] for a map or data of several cameras, [`Error::Degenerate`] where no point could be
/// judged.
pub fn evaluate_one_camera(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
) -> Result<Evaluation> {
    for (what, cameras) in [("model", reconstructor.cameras()), ("data", data.cameras)] {
        if cameras != 1 {
            return Err(Error::Mismatch {
                what: "number of cameras",
                model: format!("1, as only pixels are evaluated (the {what} has {cameras})"),
                data: data.cameras.to_string(),
            });
        }
    }
    summarise(&errors(reconstructor, data), data.correspondences.len(), UNIT)
}

/// Judges a camera on the points that it was fitted to, at the places that it was fitted to.
///
/// # Errors
///
/// [`Error::Degenerate`] where it observes none of them.
pub(crate) fn on_its_own_points(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
) -> Result<Evaluation> {
    let seen = seen_in(data, |row| row.world);
    let errors: Vec<PointError> =
        seen.iter().filter_map(|seen| error(reconstructor, *seen)).collect();
    summarise(&errors, seen.len(), UNIT)
}

/// A method fitted without one view after the other, and judged on it; `None` where the data have only one
/// view or no fit was possible.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub(crate) fn hold_out_one_camera(
    method: &AnyMethod,
    data: &Dataset,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Option<CrossValidation>> {
    let folds = folds(data);
    if folds.len() < 2 {
        return Ok(None);
    }
    progress.report("validating", 0, folds.len() as u64);
    let judged: Vec<(usize, Vec<PointError>)> = folds
        .par_iter()
        .map(|fold| {
            let (train, exam) = fold.divide(data);
            let fit = method.fit_checked(&train, seed, &Muted(progress));
            let found = fit.map(|fit| errors(&*fit.reconstructor, &exam)).unwrap_or_default();
            (exam.correspondences.len(), found)
        })
        .collect();
    progress.check()?;
    let rms = |errors: &[PointError]| {
        let sizes: Vec<f64> = errors.iter().map(|error| error.difference.norm()).collect();
        (!sizes.is_empty()).then(|| root_mean_square(&sizes))
    };
    let score = |(fold, (_, errors)): (&crate::dataset::split::Fold, &(usize, Vec<PointError>))| {
        let (view, kind) = (fold.view.clone(), fold.kind);
        FoldScore { view, kind, located: errors.len(), rms: rms(errors) }
    };
    let scores = folds.iter().zip(&judged).map(score).collect();
    let n = judged.iter().map(|(n, _)| n).sum();
    let all: Vec<PointError> = judged.into_iter().flat_map(|(_, errors)| errors).collect();
    Ok(summarise(&all, n, UNIT).ok().map(|all| CrossValidation { all, folds: scores }))
}

/// Rows that have a pixel and such a place.
fn seen_in(data: &Dataset, place: impl Fn(&Correspondence) -> Option<Point3>) -> Vec<Observation> {
    let rows = data.correspondences.iter().enumerate();
    rows.filter_map(|(index, row)| Some((index, place(row)?, (*row.pixels.first()?)?))).collect()
}

fn errors(camera: &dyn Reconstructor, data: &Dataset) -> Vec<PointError> {
    let known = seen_in(data, |row| row.world.filter(|_| row.board.is_none()));
    let mut errors: Vec<PointError> =
        known.iter().filter_map(|seen| error(camera, *seen)).collect();
    for view in 0..data.views.len().max(1) {
        let of_view = |row: &Correspondence| {
            let [x, y] = row.board.filter(|_| row.view == view)?;
            Some(Point3::new(x, y, 0.0))
        };
        let seen = seen_in(data, of_view);
        for judged in 0..2 {
            let half = |wanted: usize| {
                let all = seen.iter().enumerate();
                all.filter(move |(place, _)| place % 2 == wanted).map(|(_, seen)| *seen)
            };
            let guide: Vec<Observation> = half(1 - judged).collect();
            let Some(pose) = resected(camera, &guide) else { continue };
            let moved = half(judged).map(|(row, place, pixel)| (row, pose.transform(place), pixel));
            errors.extend(moved.filter_map(|seen| error(camera, seen)));
        }
    }
    errors
}

/// How far a point's pixel lies from where the camera observes it. The distance beside it is counted in pixels
/// too, so that a share of it is that of an error across the line of sight.
fn error(camera: &dyn Reconstructor, (row, world, pixel): Observation) -> Option<PointError> {
    let (at, slopes) = camera.project(0, world)?;
    let centre = camera.unproject(0, at)?.origin;
    let scale = slopes.norm() * std::f64::consts::FRAC_1_SQRT_2;
    let difference = Vector3::new(at.x - pixel.x, at.y - pixel.y, 0.0);
    Some(PointError { row, difference, working_distance: scale * (world - centre).norm() })
}

/// World from chart, of a chart whose points the camera saw so.
fn resected(camera: &dyn Reconstructor, seen: &[Observation]) -> Option<Pose> {
    let mut pose = first_place(camera, seen)?;
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for (_, place, pixel) in seen {
            let (at, slopes) = camera.project(0, pose.transform(*place))?;
            let arm = pose.rotation * place.coords;
            for axis in 0..2 {
                let along = slopes.row(axis).transpose();
                let turn = arm.cross(&along);
                let row = Vector6::new(turn.x, turn.y, turn.z, along.x, along.y, along.z);
                normal += row * row.transpose();
                right += row * (pixel - at)[axis];
            }
        }
        let step = normal.cholesky()?.solve(&right);
        let turn = Vector3::new(step[0], step[1], step[2]);
        pose.rotation = Pose::from_rotation_vector(Vector3::zeros(), turn).rotation * pose.rotation;
        pose.translation += Vector3::new(step[3], step[4], step[5]);
        // A thousandth of what any detector observes.
        if step.dot(&(normal * step)) < 1e-6 {
            break;
        }
    }
    Some(pose)
}

/// Where the chart about stands, by the map between it and a plane before the camera.
fn first_place(camera: &dyn Reconstructor, seen: &[Observation]) -> Option<Pose> {
    let rays: Vec<_> = seen
        .iter()
        .filter_map(|(_, place, pixel)| Some((place, camera.unproject(0, *pixel)?)))
        .collect();
    let forward = rays.iter().map(|(_, ray)| ray.direction).sum::<Vector3>().try_normalize(0.0)?;
    let aside = if forward.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let down = forward.cross(&aside).normalize();
    let rotation = Matrix3::from_rows(&[
        down.cross(&forward).transpose(),
        down.transpose(),
        forward.transpose(),
    ]);
    let flat = rays.iter().filter_map(|(place, ray)| {
        let at = rotation * ray.direction;
        let on_plane = Pixel::new(at.x / at.z, at.y / at.z);
        (at.z > 0.0).then_some((Pixel::new(place.x, place.y), on_plane))
    });
    let centre = rays.first()?.1.origin.coords;
    let frame_from_world = Pose { rotation, translation: -(rotation * centre) };
    Some(frame_from_world.inverse().after(&planar_pose(&flat.collect::<Vec<_>>())?))
}
