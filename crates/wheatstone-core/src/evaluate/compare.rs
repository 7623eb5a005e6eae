//! Methods judged on what they have not seen: each is fitted without one view (or slab of space)
//! after the other, and located points of the view left out are compared with their known places.

use super::{
    Budget, Distance, Evaluation, HeldOut, PointError, Reference, floor, mahalanobis2,
    point_errors, summarise, viewpoint,
};
use crate::{
    Error, Result,
    camera::PosedCamera,
    dataset::{
        Dataset,
        split::{Fold, FoldKind, folds},
    },
    error::{Hint, Remedy},
    geometry::Point3,
    method::{
        AnyMethod, Fit,
        auto::{self, Score},
        depth_is_observable,
    },
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};
use wheatstone_numeric::{
    progress::{Muted, Progress},
    statistics::root_mean_square,
};

/// The error on one view that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct FoldScore {
    /// The view, or the slab's bounds.
    pub view: String,
    /// Whether it lies among those that were fitted.
    pub kind: FoldKind,
    /// Points of it that were located.
    pub located: usize,
    /// Root mean square error; none where the fit failed or nothing was located.
    pub rms: Option<f64>,
}

/// A method's error over all views, each left out once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct CrossValidation {
    /// Over all points.
    pub all: Evaluation,
    /// View by view.
    pub folds: Vec<FoldScore>,
}

/// One row of a comparison.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct MethodScore {
    /// The method.
    pub method: String,
    /// Root mean square error over all held-out points; the figures are absent where no fit worked.
    pub rms: Option<f64>,
    /// Median error.
    pub median: Option<f64>,
    /// The error that 95 % of the points stay below.
    pub p95: Option<f64>,
    /// Mean error as a percentage of the working distance.
    pub mean_percent: Option<f64>,
    /// Root mean square along X, Y, Z.
    pub rms_xyz: Option<[f64; 3]>,
    /// Points to locate, over all folds.
    pub n: usize,
    /// Points located.
    pub located: usize,
    /// Wall time of one fit, mean over the folds.
    pub fit_seconds: f64,
    /// View by view.
    pub folds: Vec<FoldScore>,
    /// `rms` over what the pixel noise allows, where the true cameras are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ratio_to_floor: Option<f64>,
    /// Why fits failed, if any did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// Methods side by side.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// The unit of all lengths.
    pub unit: String,
    /// One row a method, in the order given.
    pub methods: Vec<MethodScore>,
    /// The method that this comparison speaks for: the simplest whose error is nearly the least.
    pub chosen: Option<String>,
    /// What the pixel noise allows, where the true cameras are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub floor: Option<Evaluation>,
    /// What the chosen method's error is made of, where the data tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<Budget>,
}

/// What one fit without one fold came to.
struct Outcome {
    errors: Vec<PointError>,
    distances: Vec<Distance>,
    points: usize,
    seconds: f64,
    problem: Option<String>,
}

fn run(
    method: &AnyMethod,
    data: &Dataset,
    fold: &Fold,
    (seed, whole, from): (u64, Option<&Fit>, Option<Point3>),
    progress: &dyn Progress,
) -> Result<Outcome> {
    let (train, exam) = fold.divide(data);
    let start = Instant::now();
    let fitted = method.fit_fold_checked(&train, whole, seed, progress);
    let seconds = start.elapsed().as_secs_f64();
    progress.check()?;
    let points = super::judged(&exam);
    Ok(match fitted {
        Ok(fit) => Outcome {
            errors: in_whole(fold, point_errors(&*fit.reconstructor, &exam, from)),
            distances: mahalanobis2(&*fit.reconstructor, &exam)
                .into_iter()
                .map(|distance2| Distance { kind: fold.kind, distance2 })
                .collect(),
            points,
            seconds,
            problem: None,
        },
        Err(e) => {
            let problem = Some(format!("without `{}`: {e}", fold.view));
            Outcome { errors: Vec::new(), distances: Vec::new(), points, seconds, problem }
        }
    })
}

/// The errors on a fold with their places in the whole dataset.
fn in_whole(fold: &Fold, mut errors: Vec<PointError>) -> Vec<PointError> {
    // The exam keeps the order of the whole dataset.
    let mut rows = fold.held_out.clone();
    rows.sort_unstable();
    errors.retain_mut(|error| match rows.get(error.row) {
        Some(row) => {
            error.row = *row;
            true
        }
        None => false,
    });
    errors
}

/// Each fold's outcome for each method, all in parallel; `whole` is the fit to all points, where there is
/// one method and it was made.
fn run_all(
    methods: &[AnyMethod],
    data: &Dataset,
    folds: &[Fold],
    (seed, whole): (u64, Option<&Fit>),
    progress: &dyn Progress,
) -> Result<Vec<Vec<Outcome>>> {
    let from = viewpoint(data);
    let total = (methods.len() * folds.len()) as u64;
    let done = AtomicU64::new(0);
    progress.report("validating", 0, total);
    let outcomes: Vec<Result<Outcome>> = (0..methods.len() * folds.len())
        .into_par_iter()
        .map(|task| {
            let (method, fold) = (&methods[task / folds.len()], &folds[task % folds.len()]);
            let outcome = run(method, data, fold, (seed, whole, from), &Muted(progress));
            progress.report("validating", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            outcome
        })
        .collect();
    let mut rows: Vec<Vec<Outcome>> = methods.iter().map(|_| Vec::new()).collect();
    for (task, outcome) in outcomes.into_iter().enumerate() {
        rows[task / folds.len()].push(outcome?);
    }
    Ok(rows)
}

fn fold_scores(folds: &[Fold], outcomes: &[Outcome]) -> Vec<FoldScore> {
    let score = |(fold, outcome): (&Fold, &Outcome)| {
        let errors: Vec<f64> = outcome.errors.iter().map(|e| e.difference.norm()).collect();
        FoldScore {
            view: fold.view.clone(),
            kind: fold.kind,
            located: errors.len(),
            rms: (!errors.is_empty()).then(|| root_mean_square(&errors)),
        }
    };
    folds.iter().zip(outcomes).map(score).collect()
}

fn pooled(outcomes: &[Outcome], unit: &str) -> Result<Evaluation> {
    let errors: Vec<PointError> = outcomes.iter().flat_map(|o| o.errors.clone()).collect();
    summarise(&errors, outcomes.iter().map(|o| o.points).sum(), unit)
}

/// Judges methods on `data`, each view (or slab) left out once. `truth` holds the true cameras where
/// they are known.
///
/// # Errors
///
/// [`crate::Error::Degenerate`] or [`crate::Error::TooFew`] where no method could be fitted to all of
/// the data, [`crate::Error::Cancelled`]. A method that cannot be fitted is a row with a `problem`.
pub fn compare(
    methods: &[AnyMethod],
    data: &Dataset,
    truth: Option<&[PosedCamera]>,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Comparison> {
    depth_is_observable(data)?;
    if data.cameras == 1 {
        return Err(Error::Degenerate {
            problem:
                "methods are compared by triangulation error, and a single camera cannot triangulate"
                    .into(),
            hint: Hint::new(
                "fitting one camera reports its held-out reprojection error in pixels",
                Remedy::Fit,
            ),
        });
    }
    let folds = folds(data);
    let floor = truth.and_then(|cameras| floor(cameras, data).ok());
    let outcomes = run_all(methods, data, &folds, (seed, None), progress)?;
    let rows: Vec<MethodScore> = methods
        .iter()
        .zip(&outcomes)
        .map(|(method, outcomes)| {
            let all = pooled(outcomes, &data.unit).ok();
            let seconds: f64 = outcomes.iter().map(|o| o.seconds).sum();
            MethodScore {
                method: method.name().into(),
                rms: all.as_ref().map(|all| all.rms),
                median: all.as_ref().map(|all| all.median),
                p95: all.as_ref().map(|all| all.p95),
                mean_percent: all.as_ref().map(|all| all.mean_percent),
                rms_xyz: all.as_ref().map(|all| all.rms_xyz),
                n: outcomes.iter().map(|o| o.points).sum(),
                located: outcomes.iter().map(|o| o.errors.len()).sum(),
                fit_seconds: seconds / outcomes.len().max(1) as f64,
                folds: fold_scores(&folds, outcomes),
                ratio_to_floor: all
                    .as_ref()
                    .zip(floor.as_ref())
                    .map(|(all, floor)| all.rms / floor.rms),
                problem: outcomes.iter().find_map(|o| o.problem.clone()),
            }
        })
        .collect();
    let chosen = choose(&rows);
    let named = |name: &str| methods.iter().position(|method| method.name() == name);
    let budget = match chosen.as_deref().and_then(named) {
        Some(chosen) => {
            let reference = named(REFERENCE).map(|place| held_out(&folds, &outcomes[place]));
            let errors = held_out(&folds, &outcomes[chosen]);
            divide(data, &errors, reference.as_deref(), (seed, progress))?
        }
        None => None,
    };
    Ok(Comparison { unit: data.unit.clone(), methods: rows, chosen, floor, budget })
}

/// The method whose errors say what all methods have in common.
const REFERENCE: &str = "neural-camera";

/// What the errors of a method are made of, each point of which was held out with its fold. The neural
/// camera's errors, held out alike, are found where `reference` does not give them; `None` where it
/// cannot be fitted.
///
/// # Errors
///
/// [`crate::Error::Cancelled`].
pub fn divide(
    data: &Dataset,
    errors: &[HeldOut],
    reference: Option<&[HeldOut]>,
    (seed, progress): (u64, &dyn Progress),
) -> Result<Option<Budget>> {
    let Ok(Some(fitted)) = Reference::fit(data, &Muted(progress)) else {
        progress.check()?;
        return Ok(None);
    };
    let found = match reference {
        Some(_) => Vec::new(),
        None => {
            let (method, folds) = ([AnyMethod::named(REFERENCE)?], folds(data));
            let mut outcomes = run_all(&method, data, &folds, (seed, None), progress)?;
            held_out(&folds, &outcomes.remove(0))
        }
    };
    Ok(Budget::of(data, errors, reference.unwrap_or(&found), &fitted))
}

fn held_out(folds: &[Fold], outcomes: &[Outcome]) -> Vec<HeldOut> {
    let of_fold = |(fold, outcome): (&Fold, &Outcome)| {
        let beyond = fold.kind == FoldKind::Extrapolation;
        let form = |e: &PointError| HeldOut { row: e.row, difference: e.difference, beyond };
        outcome.errors.iter().map(form).collect::<Vec<_>>()
    };
    folds.iter().zip(outcomes).flat_map(of_fold).collect()
}

/// By `auto`'s own rule, among the others: the simplest whose error is nearly the least.
fn choose(rows: &[MethodScore]) -> Option<String> {
    let rank = |row: &&MethodScore| auto::BY_SIMPLICITY.iter().position(|name| *name == row.method);
    let mut single: Vec<&MethodScore> = rows.iter().filter(|row| rank(row).is_some()).collect();
    single.sort_by_key(rank);
    let scores: Vec<Score> = single
        .into_iter()
        .filter_map(|row| {
            let folds: Option<Vec<f64>> = row.folds.iter().map(|fold| fold.rms).collect();
            let (method, located) = (row.method.as_str(), row.located);
            // Only errors are compared here, not what the error bars say of them.
            Some(Score { method, folds: folds?, surprise: 1.0, located })
        })
        .collect();
    auto::simplest_near_best(&scores).map(String::from)
}

/// One method's error over all views, each left out once; `None` where the data have only one view
/// or no fit without a view was possible.
///
/// # Errors
///
/// [`crate::Error::Cancelled`].
pub fn cross_validate(
    method: &AnyMethod,
    data: &Dataset,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Option<CrossValidation>> {
    Ok(hold_out(method, data, seed, progress)?.map(|(validation, _)| validation))
}

/// [`cross_validate`], with how far each point held out lies from its place by its own error bars:
/// what [`super::Ellipsoids::estimate`] asks for.
///
/// # Errors
///
/// [`crate::Error::Cancelled`].
pub fn hold_out(
    method: &AnyMethod,
    data: &Dataset,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Option<(CrossValidation, Vec<Distance>)>> {
    hold_out_of(method, data, (seed, None), progress)
}

/// [`hold_out`] beside the fit to all of the data.
pub(crate) fn hold_out_of(
    method: &AnyMethod,
    data: &Dataset,
    (seed, whole): (u64, Option<&Fit>),
    progress: &dyn Progress,
) -> Result<Option<(CrossValidation, Vec<Distance>)>> {
    let folds = folds(data);
    if folds.len() < 2 {
        return Ok(None);
    }
    let outcomes = run_all(std::slice::from_ref(method), data, &folds, (seed, whole), progress)?;
    let outcomes = outcomes.first().map_or(&[][..], Vec::as_slice);
    let Ok(all) = pooled(outcomes, &data.unit) else { return Ok(None) };
    let distances = outcomes.iter().flat_map(|outcome| outcome.distances.clone()).collect();
    Ok(Some((CrossValidation { all, folds: fold_scores(&folds, outcomes) }, distances)))
}
