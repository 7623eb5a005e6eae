//! Candidates fitted without one view or slab after the other, and which of them does best.

use crate::{
    Result,
    dataset::{Dataset, split::Fold},
    method::{AnyMethod, AnyReconstructor, Fit},
};
use rayon::prelude::*;
use wheatstone_numeric::progress::{Muted, Progress};

/// Tried beside the candidates where it explains pixels better than the same lens on an upright sensor.
pub(super) const TILTED: &str = "brown (tilt)";

/// A simpler method is taken when its error is within this factor of the least. The errors of two
/// sound methods on the same few hundred points differ by one percent by chance.
pub(super) const MARGIN: f64 = 1.02;

/// The candidate of this name.
pub(super) fn candidate(name: &str) -> Result<AnyMethod> {
    if name == TILTED { AnyMethod::named("brown")?.preset("tilt") } else { AnyMethod::named(name) }
}

/// How a candidate did on what was left out.
#[derive(Clone, Debug)]
pub struct Score<'a> {
    /// The candidate.
    pub method: &'a str,
    /// Root mean square error on each fold, in world units.
    pub folds: Vec<f64>,
    /// That over all points of views left out: the held-out error, as it is reported.
    pub rms: f64,
    /// Root mean square of the errors over what the error bars predict.
    pub surprise: f64,
    /// Points located.
    pub located: usize,
}

/// Sums over the points of one fold.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    squares: f64,
    surprise: f64,
    located: usize,
}

/// Fits without the fold, and adds up the errors on it; `whole` is the fit to all points.
fn examine(
    (method, whole): (&AnyMethod, &Fit),
    data: &Dataset,
    fold: &Fold,
    (seed, progress): (u64, &dyn Progress),
) -> Result<Tally> {
    let (train, exam) = fold.divide(data);
    let fit = method.fit_fold_checked(&train, Some(whole), seed, progress)?;
    let mut tally = Tally::default();
    for (world, row) in exam.known() {
        let Some(found) = fit.reconstructor.locate(&row.pixels) else { continue };
        let error = found.point - world;
        tally.squares += error.norm_squared();
        if let Some(inverse) = found.covariance.try_inverse() {
            tally.surprise += error.dot(&(inverse * error)) / 3.0;
        }
        tally.located += 1;
    }
    Ok(tally)
}

/// A method that was tried.
pub(super) struct Tried {
    pub(super) score: Score<'static>,
    /// Fitted to all points.
    pub(super) whole: Fit,
}

impl Tried {
    pub(super) fn named<'a>(tried: &'a [Self], name: &str) -> Option<&'a Self> {
        tried.iter().find(|tried| tried.score.method == name)
    }

    /// Standard deviation of a pixel coordinate about the lens model.
    pub(super) fn pixel_sigma(&self) -> f64 {
        match &self.whole.reconstructor {
            AnyReconstructor::Brown(fitted) => fitted.pixel_sigma,
            _ => f64::NAN,
        }
    }
}

/// What is left out: views first, then slabs across them.
pub(super) struct Folds {
    pub(super) all: Vec<Fold>,
    pub(super) views: usize,
}

/// How each candidate does; those that cannot be fitted, or not without some fold, are left out.
pub(super) fn scores(
    names: &[&'static str],
    data: &Dataset,
    folds: &Folds,
    (seed, progress): (u64, &dyn Progress),
) -> Result<Vec<Tried>> {
    let count = folds.all.len();
    let methods = names.iter().map(|name| candidate(name)).collect::<Result<Vec<AnyMethod>>>()?;
    let wholes: Vec<Result<Fit>> =
        methods.par_iter().map(|method| method.fit_checked(data, seed, &Muted(progress))).collect();
    progress.check()?;
    let tallies: Vec<Option<Tally>> = (0..methods.len() * count)
        .into_par_iter()
        .map(|task| {
            let (method, fold) = (task / count, &folds.all[task % count]);
            let fitted = (&methods[method], wholes[method].as_ref().ok()?);
            examine(fitted, data, fold, (seed, &Muted(progress))).ok()
        })
        .collect();
    progress.check()?;
    let tried = |((name, whole), tallies): ((&&'static str, Result<Fit>), &[Option<Tally>])| {
        let all = |tally: &Option<Tally>| tally.filter(|tally| tally.located > 0);
        let tallies: Vec<Tally> = tallies.iter().map(all).collect::<Option<_>>()?;
        let mean = |tallies: &[Tally], of: fn(&Tally) -> f64| {
            let located: usize = tallies.iter().map(|tally| tally.located).sum();
            (tallies.iter().map(of).sum::<f64>() / f64::max(located as f64, 1.0)).sqrt()
        };
        let views = if folds.views > 0 { &tallies[..folds.views] } else { &tallies };
        let score = Score {
            method: name,
            folds: tallies.iter().map(|t| (t.squares / t.located as f64).sqrt()).collect(),
            rms: mean(views, |tally| tally.squares),
            surprise: mean(&tallies, |tally| tally.surprise),
            located: tallies.iter().map(|tally| tally.located).sum(),
        };
        Some(Tried { score, whole: whole.ok()? })
    };
    Ok(names.iter().zip(wholes).zip(tallies.chunks(count)).filter_map(tried).collect())
}

/// By the rule for scores.
pub(super) fn best(tried: &[Tried]) -> Option<&'static str> {
    let scores: Vec<Score<'static>> = tried.iter().map(|tried| tried.score.clone()).collect();
    simplest_near_best(&scores)
}

/// The simplest of those that are nearly best, of scores on the same folds ordered by simplicity.
/// Errors are compared fold by fold, as ratios, so that far and near views count alike; methods that
/// leave out more than a hundredth of the points that others locate are not considered.
#[must_use]
pub fn simplest_near_best<'a>(scores: &[Score<'a>]) -> Option<&'a str> {
    let most = scores.iter().map(|score| score.located).max()?;
    let whole: Vec<&Score> =
        scores.iter().filter(|score| 100 * score.located >= 99 * most).collect();
    let least_of_fold = |fold: usize| {
        whole
            .iter()
            .filter_map(|score| score.folds.get(fold))
            .copied()
            .fold(f64::INFINITY, f64::min)
    };
    // Mean logarithm of the ratio to the best on each fold.
    let behind = |score: &Score| {
        let ratios = score.folds.iter().enumerate().map(|(fold, rms)| {
            libm::log(rms.max(f64::MIN_POSITIVE) / least_of_fold(fold).max(f64::MIN_POSITIVE))
        });
        ratios.sum::<f64>() / score.folds.len() as f64
    };
    let least = whole.iter().map(|score| behind(score)).fold(f64::INFINITY, f64::min);
    let near = |score: &&&Score| behind(score) <= least + libm::log(MARGIN);
    whole.iter().find(near).map(|score| score.method)
}

#[cfg(test)]
mod tests {
    use super::{Score, simplest_near_best};

    fn score(method: &str, folds: [f64; 2], located: usize) -> Score<'_> {
        Score { method, folds: folds.to_vec(), rms: folds[0], surprise: 1.0, located }
    }

    #[test]
    fn simplicity_wins_ties_and_completeness_comes_first() {
        let dlt = score("dlt", [1.5, 1.5], 100);
        let neural = score("neural-camera", [1.0, 1.0], 100);
        let near = [dlt.clone(), score("brown", [1.01, 1.02], 100), neural.clone()];
        assert_eq!(simplest_near_best(&near), Some("brown"));
        let behind = [dlt.clone(), score("brown", [1.0, 1.1], 100), neural];
        assert_eq!(simplest_near_best(&behind), Some("neural-camera"));
        let partial = [dlt, score("network", [0.5, 0.5], 60)];
        assert_eq!(simplest_near_best(&partial), Some("dlt"));
        assert_eq!(simplest_near_best(&[]), None);
    }

    #[test]
    fn a_distant_view_does_not_outvote_the_near_ones() {
        let scores = [score("dlt", [0.2, 10.0], 50), score("brown", [0.1, 10.1], 50)];
        assert_eq!(simplest_near_best(&scores), Some("brown"));
    }
}
