//! Every point located by a fit that has not seen it.

use super::sections::{LocatedFigures, PointFigures, ViewFigures};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};
use wheatstone_core::{
    Calibration, Result,
    dataset::{Correspondence, Dataset, SavedDataset, split::folds},
    evaluate::FoldScore,
    geometry::{Pixel, Point3, ProjectionMatrix, Vector3},
    method::{
        AnyMethod, AnyReconstructor, CalibratedMap, CovarianceScale, Fit, PointNoise,
        Reconstructor,
        network::{Network, Training},
    },
};
use wheatstone_numeric::{
    progress::{Muted, Progress},
    statistics::root_mean_square,
};

/// Which points errors are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Validation {
    /// Each point was located by a fit that had not seen its view.
    HeldOut,
    /// The fit has seen the points: its errors on new ones are larger.
    Fitted,
    /// There are no points.
    Nothing,
}

/// The points in the form in which methods take them.
pub(super) fn dataset(saved: &SavedDataset) -> Dataset {
    let row = |index: usize| Correspondence {
        view: saved.view[index],
        id: saved.id[index].clone(),
        pixels: saved.pixels[index].iter().map(|p| p.map(Pixel::from)).collect(),
        world: saved.world[index].map(Point3::from),
        board: None,
    };
    // The lists of a damaged file may differ in length.
    let lengths = [saved.id.len(), saved.pixels.len(), saved.world.len()];
    let count = lengths.into_iter().fold(saved.view.len(), usize::min);
    Dataset {
        unit: saved.unit.clone(),
        cameras: saved.pixels.first().map_or(0, Vec::len),
        views: saved.views.clone(),
        correspondences: (0..count).map(row).collect(),
    }
}

/// Passes over the points that a training by back-propagation may take for each held-out view: more
/// are minutes on two cores (4e7 take 15 s).
const MOST_PASSES: f64 = 5e6;

fn is_quick(method: &AnyMethod, data: &Dataset) -> bool {
    match method {
        AnyMethod::Network(Network { training: Training::Backpropagation(training), .. }) => {
            training.epochs as f64 * data.correspondences.len() as f64 <= MOST_PASSES
        }
        _ => true,
    }
}

/// What all points are seen against.
pub(super) struct Scene<'a> {
    pub(super) data: &'a Dataset,
    /// The middle of the cameras, and where they look; none where the points do not tell.
    pub(super) viewpoint: Option<Point3>,
    pub(super) forward: Option<Vector3>,
    /// What scales the covariances of maps.
    uncertainty: (Option<PointNoise>, Option<CovarianceScale>),
    /// The linear cameras.
    matrices: Vec<Option<ProjectionMatrix>>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(data: &'a Dataset, model: &Calibration, forward: Option<Vector3>) -> Self {
        let matrix = |camera| ProjectionMatrix::fit(&data.seen_by_camera(camera));
        let matrices = (0..data.cameras).map(matrix).collect();
        let (viewpoint, uncertainty) =
            (model.viewpoint, (model.point_noise, model.covariance_scale));
        Self { data, viewpoint, forward, uncertainty, matrices }
    }

    /// How far before the cameras a point lies.
    pub(super) fn depth(&self, point: Point3) -> f64 {
        let from = point - self.viewpoint.unwrap_or(Point3::origin());
        self.forward.map_or(from.norm(), |forward| from.dot(&forward))
    }

    /// From where each camera saw a point to where it was expected; for methods without cameras,
    /// from where its true place falls to where the located one falls, by the linear cameras.
    fn misses(
        &self,
        map: &AnyReconstructor,
        row: &Correspondence,
        located: Point3,
    ) -> Vec<Option<[f64; 2]>> {
        let miss = |camera: usize| {
            let (seen, world) = (row.pixels[camera]?, row.world?);
            let by = match map.project(camera, world) {
                Some(pixel) => pixel - seen,
                None => {
                    let matrix = self.matrices[camera].as_ref()?;
                    matrix.project(located)? - matrix.project(world)?
                }
            };
            by.iter().all(|value| value.is_finite()).then(|| by.into())
        };
        (0..row.pixels.len()).map(miss).collect()
    }

    fn locate(&self, map: &AnyReconstructor, row: &Correspondence) -> Option<LocatedFigures> {
        if row.pixels.len() != map.cameras() {
            return None;
        }
        let (noise, scale) = self.uncertainty;
        let calibrated = CalibratedMap::new(&**map).with_uncertainty(noise, scale, None);
        let found = calibrated.locate(&row.pixels)?;
        let c = found.covariance;
        let covariance = [c[(0, 0)], c[(0, 1)], c[(0, 2)], c[(1, 1)], c[(1, 2)], c[(2, 2)]];
        let all_finite = found.point.iter().chain(&covariance).all(|value| value.is_finite());
        Some(LocatedFigures {
            point: found.point.into(),
            covariance: all_finite.then_some(covariance),
            residual: found.residual.map(|residual| residual.rms).filter(|rms| rms.is_finite()),
            misses: self.misses(map, row, found.point),
            depth: self.depth(row.world.unwrap_or(found.point)),
        })
    }
}

/// Every point with where it was located, and what the views come to.
pub(super) struct EvaluatedPoints {
    pub(super) judgement: Validation,
    pub(super) points: Vec<PointFigures>,
    pub(super) views: Vec<ViewFigures>,
}

/// What a fit without one fold says of it.
struct HeldOut {
    rows: Vec<usize>,
    located: Vec<Option<LocatedFigures>>,
    view: ViewFigures,
}

/// Locates every point: those of each view by a fit without it, where `held_out` asks for that and
/// it can be done in seconds, the others by the model itself.
///
/// # Errors
///
/// [`wheatstone_core::Error::Cancelled`].
pub(super) fn judge(
    model: &Calibration,
    scene: &Scene,
    held_out: bool,
    progress: &dyn Progress,
) -> Result<EvaluatedPoints> {
    let data = scene.data;
    let mut points: Vec<PointFigures> = data.correspondences.iter().map(unlocated).collect();
    let fitted = model.fitted()?;
    let mut views = Vec::new();
    if held_out && is_quick(&fitted.0, data) {
        for fold in held_out_folds(&fitted, model.seed, scene, progress)? {
            for (row, located) in fold.rows.into_iter().zip(fold.located) {
                points[row].located = located;
            }
            views.push(fold.view);
        }
    }
    let any = points.iter().any(|point| point.error().is_some());
    let judgement = if any { Validation::HeldOut } else { Validation::Fitted };
    if !any {
        views.clear();
    }
    // Points that could be held out stay as they are: a failure is a result.
    let own = |point: &PointFigures| !any || point.world.is_none();
    let own: Vec<usize> = (0..points.len()).filter(|row| own(&points[*row])).collect();
    let found: Vec<Option<LocatedFigures>> = own
        .par_iter()
        .map(|row| scene.locate(&model.reconstructor, &data.correspondences[*row]))
        .collect();
    for (row, located) in own.into_iter().zip(found) {
        points[row].located = located;
    }
    if !any {
        views = model
            .validation
            .as_ref()
            .map_or_else(|| by_view(data, &points), |validation| remembered(&validation.folds));
    }
    Ok(EvaluatedPoints { judgement, points, views })
}

fn unlocated(row: &Correspondence) -> PointFigures {
    PointFigures {
        view: row.view,
        id: row.id.clone(),
        pixels: row.pixels.iter().map(|p| p.map(Into::into)).collect(),
        world: row.world.map(Into::into),
        located: None,
    }
}

/// The method's fits without each view, made as they are for the held-out error of the model.
fn held_out_folds(
    (method, whole): &(AnyMethod, Fit),
    seed: u64,
    scene: &Scene,
    progress: &dyn Progress,
) -> Result<Vec<HeldOut>> {
    let folds = folds(scene.data);
    if folds.len() < 2 {
        return Ok(Vec::new());
    }
    let (done, total) = (AtomicU64::new(0), folds.len() as u64);
    let all: Vec<Result<HeldOut>> = folds
        .into_par_iter()
        .map(|fold| {
            progress.check()?;
            let (train, _) = fold.divide(scene.data);
            let fit = method.fit_fold_checked(&train, Some(whole), seed, &Muted(progress));
            progress.check()?;
            let row = |index: &usize| &scene.data.correspondences[*index];
            let located: Vec<Option<LocatedFigures>> = fold
                .held_out
                .iter()
                .map(|index| scene.locate(&fit.as_ref().ok()?.reconstructor, row(index)))
                .collect();
            let points = fold.held_out.iter().zip(&located);
            let points: Vec<PointFigures> = points
                .map(|(index, found)| PointFigures {
                    located: found.clone(),
                    ..unlocated(row(index))
                })
                .collect();
            let mut view = summed_up(&fold.view, &points.iter().collect::<Vec<_>>());
            view.kind = Some(fold.kind);
            view.problem = fit.as_ref().err().map(ToString::to_string);
            progress.report("holding out views", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            Ok(HeldOut { rows: fold.held_out, located, view })
        })
        .collect();
    all.into_iter().collect()
}

fn summed_up(name: &str, points: &[&PointFigures]) -> ViewFigures {
    let errors: Vec<f64> = points.iter().filter_map(|point| point.error()).collect();
    let predicted: Vec<f64> =
        points.iter().filter(|p| p.error().is_some()).filter_map(|p| p.predicted()).collect();
    ViewFigures {
        name: name.into(),
        kind: None,
        points: points.iter().filter(|point| point.world.is_some()).count(),
        located: errors.len(),
        rms: (!errors.is_empty()).then(|| root_mean_square(&errors)),
        predicted_rms: (!predicted.is_empty()).then(|| root_mean_square(&predicted)),
        problem: None,
    }
}

/// What is remembered of views that were held out.
pub(super) fn remembered(folds: &[FoldScore]) -> Vec<ViewFigures> {
    let view = |fold: &FoldScore| ViewFigures {
        name: fold.view.clone(),
        kind: Some(fold.kind),
        points: fold.located,
        located: fold.located,
        rms: fold.rms,
        predicted_rms: None,
        problem: None,
    };
    folds.iter().map(view).collect()
}

/// The errors of a fit on its own points, view by view.
fn by_view(data: &Dataset, points: &[PointFigures]) -> Vec<ViewFigures> {
    let of = |(view, name): (usize, &String)| {
        let points: Vec<&PointFigures> = points.iter().filter(|point| point.view == view).collect();
        summed_up(name, &points)
    };
    data.views.iter().enumerate().map(of).filter(|view| view.points > 0).collect()
}
