//! Methods judged on what they have not seen: each is fitted without one view (or slab of space)
//! after the other, and located points of the view left out are compared with their known places.

use super::{
    Budget, Evaluation, HeldOut, PointError, Reference,
    cross_validation::{FoldScore, Judged, Outcome, chosen_by, fold_scores, pooled, run_all},
    floor,
};
use crate::{
    Error, Result,
    camera::PosedCamera,
    dataset::{
        Dataset,
        split::{Fold, FoldKind, folds},
    },
    error::{Hint, Remedy},
    method::{
        AnyMethod, Fit,
        auto::{self, Score},
        depth_is_observable,
    },
};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;
use wheatstone_numeric::progress::{Muted, Progress};

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
    /// Wall time of the fit to all points.
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

impl MethodScore {
    /// Without the time of a fit, and the floor.
    fn new(method: &AnyMethod, outcomes: &[Outcome], (data, folds): (&Dataset, &[Fold])) -> Self {
        let all = pooled(outcomes, &data.unit).ok();
        let all = all.as_ref();
        Self {
            method: method.name().into(),
            rms: all.map(|all| all.rms),
            median: all.map(|all| all.median),
            p95: all.map(|all| all.p95),
            mean_percent: all.map(|all| all.mean_percent),
            rms_xyz: all.map(|all| all.rms_xyz),
            n: outcomes.iter().map(|outcome| outcome.points).sum(),
            located: outcomes.iter().map(|outcome| outcome.errors.len()).sum(),
            fit_seconds: 0.0,
            folds: fold_scores(folds, outcomes),
            ratio_to_floor: None,
            problem: outcomes.iter().find_map(|outcome| outcome.problem.clone()),
        }
    }
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
    let wholes: Vec<(Result<Fit>, f64)> = methods
        .par_iter()
        .map(|method| {
            let start = Instant::now();
            let whole = method.fit_checked(data, seed, &Muted(progress));
            (whole, start.elapsed().as_secs_f64())
        })
        .collect();
    progress.check()?;
    let judged: Vec<Judged> = methods
        .iter()
        .zip(&wholes)
        .map(|(method, (whole, _))| {
            Ok((chosen_by(method, whole.as_ref().ok())?, whole.as_ref().ok()))
        })
        .collect::<Result<_>>()?;
    let outcomes = run_all(&judged, data, &folds, seed, progress)?;
    let row = |((method, outcomes), (_, seconds)): ((&AnyMethod, &Vec<Outcome>), &(_, f64))| {
        let row = MethodScore::new(method, outcomes, (data, &folds));
        let ratio_to_floor = row.rms.zip(floor.as_ref()).map(|(rms, floor)| rms / floor.rms);
        MethodScore { fit_seconds: *seconds, ratio_to_floor, ..row }
    };
    let rows: Vec<MethodScore> = methods.iter().zip(&outcomes).zip(&wholes).map(row).collect();
    let chosen = choose(&rows, data);
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
            let whole = Fit::of(fitted.cameras().clone());
            let (method, folds) = ([(AnyMethod::named(REFERENCE)?, Some(&whole))], folds(data));
            let mut outcomes = run_all(&method, data, &folds, seed, progress)?;
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

/// By `auto`'s own rule, among the others: the simplest whose error is nearly the least, of those with honest error bars.
fn choose(rows: &[MethodScore], data: &Dataset) -> Option<String> {
    let rank = |row: &&MethodScore| auto::BY_SIMPLICITY.iter().position(|name| *name == row.method);
    let is_judged = |row: &&MethodScore| rank(row).is_some() && auto::may_choose(&row.method, data);
    let mut single: Vec<&MethodScore> = rows.iter().filter(is_judged).collect();
    single.sort_by_key(rank);
    let scores: Vec<Score> = single
        .into_iter()
        .filter_map(|row| {
            let folds: Option<Vec<f64>> = row.folds.iter().map(|fold| fold.rms).collect();
            let (method, located) = (row.method.as_str(), row.located);
            // Only errors are compared here, not what the error bars say of them.
            Some(Score { method, folds: folds?, rms: row.rms?, surprise: 1.0, located })
        })
        .collect();
    auto::simplest_near_best(&scores).map(String::from)
}
