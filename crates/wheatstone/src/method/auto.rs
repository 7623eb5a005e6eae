//! The method that chooses a method: each candidate is fitted without one view (or slab of space)
//! after the other, and the one whose located points lie nearest to their places is fitted to all.
//!
//! Nearly equal candidates are told apart by simplicity: fewer freedoms have fewer ways to go wrong
//! where there was no exam.

use super::{AnyMethod, Choice, Fit, Method, only_default};
use crate::{
    Error, Result,
    dataset::{
        Dataset,
        split::{Fold, folds},
    },
    progress::{Muted, Progress},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// There is nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Auto {}

/// The candidates that are always tried, the simplest first.
const CANDIDATES: [&str; 5] = ["dlt", "brown", "kannala-brandt", "soloff", "neural-camera"];

/// Every method that a comparison can speak for, the simplest first.
pub const BY_SIMPLICITY: [&str; 8] = [
    "dlt",
    "tsai",
    "brown",
    "kannala-brandt",
    "soloff",
    "neural-camera",
    "network",
    "interpolation",
];

/// Tried beside them where even the best errs by more than it says: it takes ten times as long.
const SECOND_OPINION: &str = "network";

/// A simpler method is taken when its error is within this factor of the least. The errors of two
/// sound methods on the same few hundred points differ by one percent by chance.
const MARGIN: f64 = 1.02;

/// Errors this many times those that a method's own error bars predict ask for a second opinion.
const HONEST: f64 = 1.25;

/// How a candidate did on the views left out.
#[derive(Clone, Copy, Debug)]
struct Score {
    /// Root mean square error, in world units.
    rms: f64,
    /// Root mean square of the errors over what the error bars predict.
    surprise: f64,
    /// Points located.
    located: usize,
}

/// Sums over the points of one fold.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    squares: f64,
    surprise: f64,
    located: usize,
}

/// Fits without the fold, and adds up the errors on it.
fn examine(
    method: &AnyMethod,
    data: &Dataset,
    fold: &Fold,
    (seed, progress): (u64, &dyn Progress),
) -> Result<Tally> {
    let mut left_out = vec![false; data.correspondences.len()];
    for index in &fold.held_out {
        left_out[*index] = true;
    }
    let fit = method.fit_checked(&data.subset(|index, _| !left_out[index]), seed, progress)?;
    let mut tally = Tally::default();
    for index in &fold.held_out {
        let row = &data.correspondences[*index];
        let (Some(world), Some(found)) = (row.world, fit.reconstructor.locate(&row.pixels)) else {
            continue;
        };
        let error = found.point - world;
        tally.squares += error.norm_squared();
        if let Some(inverse) = found.covariance.try_inverse() {
            tally.surprise += error.dot(&(inverse * error)) / 3.0;
        }
        tally.located += 1;
    }
    Ok(tally)
}

/// How each candidate does; none for one that cannot be fitted without some fold.
fn scores(
    methods: &[AnyMethod],
    data: &Dataset,
    folds: &[Fold],
    (seed, progress): (u64, &dyn Progress),
) -> Result<Vec<Option<Score>>> {
    let tallies: Vec<Result<Tally>> = (0..methods.len() * folds.len())
        .into_par_iter()
        .map(|task| {
            let (method, fold) = (&methods[task / folds.len()], &folds[task % folds.len()]);
            examine(method, data, fold, (seed, &Muted(progress)))
        })
        .collect();
    progress.check()?;
    let total = |tallies: &[Result<Tally>]| {
        let mut sum = Tally::default();
        for tally in tallies {
            let tally = tally.as_ref().ok()?;
            sum.squares += tally.squares;
            sum.surprise += tally.surprise;
            sum.located += tally.located;
        }
        let count = sum.located as f64;
        (sum.located > 0).then(|| Score {
            rms: (sum.squares / count).sqrt(),
            surprise: (sum.surprise / count).sqrt(),
            located: sum.located,
        })
    };
    Ok(tallies.chunks(folds.len().max(1)).map(total).collect())
}

/// The simplest of those that are nearly best, of `(name, rms, located)` ordered by simplicity; those
/// that leave out more than a hundredth of the points that others locate are not considered.
#[must_use]
pub fn simplest_near_best<'a>(scores: &[(&'a str, f64, usize)]) -> Option<&'a str> {
    let most = scores.iter().map(|score| score.2).max()?;
    let whole = || scores.iter().filter(move |score| 100 * score.2 >= 99 * most);
    let least = whole().map(|score| score.1).fold(f64::INFINITY, f64::min);
    whole().find(|score| score.1 <= MARGIN * least).map(|score| score.0)
}

impl Method for Auto {
    fn fit(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
        let folds = folds(train);
        let mut tried: Vec<(&str, Score)> = Vec::new();
        let named = |names: &[&'static str]| -> Result<Vec<AnyMethod>> {
            names.iter().map(|name| AnyMethod::named(name)).collect()
        };
        if folds.len() >= 2 {
            let found = scores(&named(&CANDIDATES)?, train, &folds, (seed, progress))?;
            tried.extend(CANDIDATES.into_iter().zip(found).filter_map(|(n, s)| Some((n, s?))));
            let least = tried.iter().map(|(_, score)| score).min_by(|a, b| a.rms.total_cmp(&b.rms));
            if least.is_none_or(|score| score.surprise > HONEST) {
                let found = scores(&named(&[SECOND_OPINION])?, train, &folds, (seed, progress))?;
                tried.extend(found[0].map(|score| (SECOND_OPINION, score)));
            }
        }
        let plain: Vec<(&str, f64, usize)> =
            tried.iter().map(|(name, score)| (*name, score.rms, score.located)).collect();
        let Some(chosen) = simplest_near_best(&plain) else {
            return without_an_exam(train, seed, progress);
        };
        let mut fit = AnyMethod::named(chosen)?.fit(train, seed, progress)?;
        fit.choice = Some(Choice {
            chosen: chosen.into(),
            reason: reason(chosen, &plain, &train.unit),
            held_out_rms: plain.iter().map(|(name, rms, _)| ((*name).into(), *rms)).collect(),
        });
        Ok(fit)
    }

    fn summary(&self) -> &'static str {
        "tries the others on views left out and takes the simplest of the best"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

/// Why `chosen` was, in one sentence.
fn reason(chosen: &str, tried: &[(&str, f64, usize)], unit: &str) -> String {
    let own = tried.iter().find(|score| score.0 == chosen).map_or(f64::NAN, |score| score.1);
    let best = tried.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let runner_up =
        tried.iter().filter(|score| score.0 != chosen).min_by(|a, b| a.1.total_cmp(&b.1));
    match (best, runner_up) {
        (Some(best), _) if best.0 != chosen => format!(
            "{own:.4} {unit} rms on views left out; {} reaches {:.4}, which its freedom does not pay for",
            best.0, best.1
        ),
        (_, Some(next)) => format!(
            "{own:.4} {unit} rms on views left out, the least; next comes {} with {:.4}",
            next.0, next.1
        ),
        _ => format!("{own:.4} {unit} rms on views left out; nothing else could be fitted"),
    }
}

/// Too few views to leave one out: the most general method that can be fitted at all, of those that
/// keep straight rays where there are no points.
fn without_an_exam(train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
    let mut last = Error::Cancelled;
    for name in ["brown", "dlt"] {
        progress.check()?;
        match AnyMethod::named(name)?.fit(train, seed, progress) {
            Ok(mut fit) => {
                fit.choice = Some(Choice {
                    chosen: name.into(),
                    reason: "there are too few views to leave one out, so nothing was compared"
                        .into(),
                    held_out_rms: Vec::new(),
                });
                return Ok(fit);
            }
            Err(e) => last = e,
        }
    }
    Err(last)
}

#[cfg(test)]
mod tests {
    use super::simplest_near_best;

    #[test]
    fn simplicity_wins_ties_and_completeness_comes_first() {
        let scores = [("dlt", 1.5, 100), ("brown", 1.01, 100), ("neural-camera", 1.0, 100)];
        assert_eq!(simplest_near_best(&scores), Some("brown"));
        let scores = [("dlt", 1.5, 100), ("brown", 1.05, 100), ("neural-camera", 1.0, 100)];
        assert_eq!(simplest_near_best(&scores), Some("neural-camera"));
        let scores = [("dlt", 1.5, 100), ("network", 0.5, 60)];
        assert_eq!(simplest_near_best(&scores), Some("dlt"));
        assert_eq!(simplest_near_best(&[]), None);
    }
}
