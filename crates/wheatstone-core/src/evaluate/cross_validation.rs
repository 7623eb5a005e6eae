//! Cross-validation: a method is fitted without one view (or slab of space) after the other, and located points of
//! what was left out are compared with their known places.

use super::{Distance, Evaluation, PointError, mahalanobis2, point_errors, summarise, viewpoint};
use crate::{
    Error, Result,
    dataset::{
        Dataset,
        split::{Fold, FoldKind, folds, grouped, sample},
    },
    geometry::Point3,
    method::{AnyMethod, CalibratedMap, Fit},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU64, Ordering};
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

impl CrossValidation {
    /// What was left out at a time, in words.
    #[must_use]
    pub fn scheme(&self) -> String {
        match grouped(self.folds.iter().map(|fold| fold.view.as_str())) {
            Some([views, groups]) => {
                format!("leave-one-group-out, {views} views in {groups} groups")
            }
            None => "leave-one-view-out".into(),
        }
    }
}

/// What one fit without one fold came to.
pub(super) struct Outcome {
    pub(super) errors: Vec<PointError>,
    distances: Vec<Distance>,
    pub(super) points: usize,
    pub(super) problem: Option<String>,
}

fn run(
    method: &AnyMethod,
    data: &Dataset,
    fold: &Fold,
    (seed, whole, from): (u64, Option<&Fit>, Option<Point3>),
    progress: &dyn Progress,
) -> Result<Outcome> {
    let (train, exam) = fold.divide(data);
    let fitted = method.fit_fold_checked(&train, whole, seed, progress);
    progress.check()?;
    let points = super::judged(&exam);
    Ok(match fitted {
        Ok(fit) => Outcome {
            errors: in_whole(fold, point_errors(&*fit.reconstructor, &exam, from)),
            distances: mahalanobis2(
                &CalibratedMap::new(&*fit.reconstructor)
                    .with_noise_of(&train)
                    .with_scale_of(&train),
                &exam,
            )
            .into_iter()
            .map(|distance2| Distance { kind: fold.kind, distance2 })
            .collect(),
            points,
            problem: None,
        },
        Err(e) => {
            let problem = Some(format!("without `{}`: {e}", fold.view));
            Outcome { errors: Vec::new(), distances: Vec::new(), points, problem }
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

/// A method, and its fit to all points where there is one.
pub(super) type Judged<'a> = (AnyMethod, Option<&'a Fit>);

/// Each fold's outcome for each method, all in parallel.
pub(super) fn run_all(
    methods: &[Judged<'_>],
    data: &Dataset,
    folds: &[Fold],
    seed: u64,
    progress: &dyn Progress,
) -> Result<Vec<Vec<Outcome>>> {
    let of_fits =
        || methods.iter().find_map(|(_, whole)| whole.as_ref()?.reconstructor.viewpoint());
    let from = viewpoint(data).or_else(of_fits);
    let total = (methods.len() * folds.len()) as u64;
    let done = AtomicU64::new(0);
    progress.report("validating", 0, total);
    let outcomes: Vec<Result<Outcome>> = (0..methods.len() * folds.len())
        .into_par_iter()
        .map(|task| {
            let ((method, whole), fold) =
                (&methods[task / folds.len()], &folds[task % folds.len()]);
            let outcome = run(method, data, fold, (seed, *whole, from), &Muted(progress));
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

pub(super) fn fold_scores(folds: &[Fold], outcomes: &[Outcome]) -> Vec<FoldScore> {
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

pub(super) fn pooled(outcomes: &[Outcome], unit: &str) -> Result<Evaluation> {
    let errors: Vec<PointError> = outcomes.iter().flat_map(|o| o.errors.clone()).collect();
    summarise(&errors, outcomes.iter().map(|o| o.points).sum(), unit)
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

/// [`cross_validate`], with how far each point held out lies from its place by its own error bars, with noise
/// that differs from point to point in them: what [`super::Ellipsoids::estimate`] asks for.
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
    let whole = match method.fit_checked(data, seed, &Muted(progress)) {
        Err(Error::Cancelled) => return Err(Error::Cancelled),
        whole => whole.ok(),
    };
    hold_out_of(method, data, (seed, whole.as_ref()), progress)
}

/// What is judged where a method chose another for all points: the one that it chose, since it is that one whose
/// points are handed over. Otherwise the error would be that of the choice as well, made anew for each view.
pub(super) fn chosen_by(method: &AnyMethod, whole: Option<&Fit>) -> Result<AnyMethod> {
    match whole.and_then(|whole| whole.choice.as_ref()) {
        Some(choice) => choice.method(),
        None => Ok(method.clone()),
    }
}

/// Pixels beyond which a part of the points is judged, and fitted to for that: the score says how many they are.
const MOST_JUDGED: usize = 500_000;

/// [`hold_out`] beside the fit to all of the data.
pub(crate) fn hold_out_of(
    method: &AnyMethod,
    data: &Dataset,
    (seed, whole): (u64, Option<&Fit>),
    progress: &dyn Progress,
) -> Result<Option<(CrossValidation, Vec<Distance>)>> {
    let (_, data) = sample(data, MOST_JUDGED, seed);
    let folds = folds(&data);
    if folds.len() < 2 {
        return Ok(None);
    }
    let judged = [(chosen_by(method, whole)?, whole)];
    let outcomes = run_all(&judged, &data, &folds, seed, progress)?;
    let outcomes = outcomes.first().map_or(&[][..], Vec::as_slice);
    let Ok(all) = pooled(outcomes, &data.unit) else { return Ok(None) };
    let distances = outcomes.iter().flat_map(|outcome| outcome.distances.clone()).collect();
    Ok(Some((CrossValidation { all, folds: fold_scores(&folds, outcomes) }, distances)))
}
