//! The method that chooses a method: each candidate is fitted without one view (or slab of space)
//! after the other, and the one whose located points lie nearest to their places is fitted to all.
//!
//! Nearly equal candidates are told apart by simplicity: fewer freedoms have fewer ways to go wrong
//! where there was no exam.

use super::{AnyMethod, AnyReconstructor, Choice, Fit, Method, depth_is_observable, only_default};
use crate::{
    Error, Result,
    dataset::{
        Dataset,
        split::{Fold, fewest_layers, folds, folds_across},
    },
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::{Muted, Progress};

/// There is nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Auto {}

/// The candidates, the simplest first.
const CANDIDATES: [&str; 5] = ["dlt", "brown", "kannala-brandt", "soloff", "neural-camera"];

/// Those of them whose rays are straight. Where points lie in few layers, any other can say between
/// the layers what nothing contradicts.
const STRAIGHT: [&str; 4] = ["dlt", "brown", "kannala-brandt", "neural-camera"];

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

/// Tried beside them where it explains pixels better than the same lens on an upright sensor.
const TILTED: &str = "brown (tilt)";

/// Tried beside them where even the best errs by more than it says: it takes ten times as long.
const SECOND_OPINION: &str = "network";

/// A simpler method is taken when its error is within this factor of the least. The errors of two
/// sound methods on the same few hundred points differ by one percent by chance.
const MARGIN: f64 = 1.02;

/// Errors this many times those that a method's own error bars predict ask for a second opinion.
const HONEST: f64 = 1.25;

/// With fewer views or layers than this, leaving one out says more of their lack than of the method:
/// slabs across the views are then left out too, and only methods with straight rays are tried.
const FEW: usize = 5;

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

/// The candidate of this name.
fn candidate(name: &str) -> Result<AnyMethod> {
    if name == TILTED { AnyMethod::named("brown")?.preset("tilt") } else { AnyMethod::named(name) }
}

impl Choice {
    /// The method that was chosen, with its settings.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownName`] where it is none of this library's.
    pub fn method(&self) -> Result<AnyMethod> {
        candidate(&self.chosen)
    }
}

/// A method that was tried.
struct Tried {
    score: Score<'static>,
    /// Fitted to all points.
    whole: Fit,
}

impl Tried {
    fn named<'a>(tried: &'a [Self], name: &str) -> Option<&'a Self> {
        tried.iter().find(|tried| tried.score.method == name)
    }

    /// Standard deviation of a pixel coordinate about the lens model.
    fn pixel_sigma(&self) -> f64 {
        match &self.whole.reconstructor {
            AnyReconstructor::Brown(fitted) => fitted.pixel_sigma,
            _ => f64::NAN,
        }
    }
}

/// What is left out: views first, then slabs across them.
struct Folds {
    all: Vec<Fold>,
    views: usize,
}

/// How each candidate does; those that cannot be fitted, or not without some fold, are left out.
fn scores(
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
fn best(tried: &[Tried]) -> Option<&'static str> {
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

/// Groups of views that are left out together where one comparison of two methods is enough.
const GROUPS: usize = 6;

/// Whether `simple` locates points of views left out as well as `other` does, by the rule above. Not so where
/// there are too few views to leave any out.
pub(crate) fn does_as_well(
    simple: &'static str,
    other: &'static str,
    data: &Dataset,
    progress: &dyn Progress,
) -> Result<bool> {
    let mut groups: Vec<Fold> = Vec::new();
    for (index, fold) in folds(data).into_iter().enumerate() {
        match groups.get_mut(index % GROUPS) {
            Some(group) => group.held_out.extend(fold.held_out),
            None => groups.push(fold),
        }
    }
    groups.retain(|fold| depth_is_observable(&fold.divide(data).0).is_ok());
    if groups.len() < 2 {
        return Ok(false);
    }
    let folds = Folds { views: groups.len(), all: groups };
    let tried = scores(&[simple, other], data, &folds, (0, progress))?;
    Ok(best(&tried) == Some(simple))
}

impl Method for Auto {
    fn fit(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
        // What is left without a fold must still tell depth: without one wing of a V it does not.
        let tells_depth = |fold: &Fold| depth_is_observable(&fold.divide(train).0).is_ok();
        let views = folds(train);
        let few = views.len() < FEW || fewest_layers(train).is_some_and(|count| count < FEW);
        let mut all: Vec<Fold> = views.into_iter().filter(tells_depth).collect();
        let views = all.len();
        if few {
            all.extend(folds_across(train).into_iter().filter(tells_depth));
        }
        let folds = Folds { all, views };
        let candidates: &[&str] = if few { &STRAIGHT } else { &CANDIDATES };
        let mut tried = if folds.all.len() < 2 {
            Vec::new()
        } else {
            scores(candidates, train, &folds, (seed, progress))?
        };
        let chosen = best(&tried);
        let honest =
            |tried: &Tried| Some(tried.score.method) == chosen && tried.score.surprise < HONEST;
        if !few && !tried.is_empty() && !tried.iter().any(honest) {
            tried.extend(scores(&[SECOND_OPINION], train, &folds, (seed, progress))?);
        }
        try_tilted(&mut tried, (train, &folds), (seed, progress))?;
        let Some(chosen) = best(&tried) else {
            return without_an_exam(train, seed, progress);
        };
        let held_out: Vec<(&str, f64)> =
            tried.iter().map(|tried| (tried.score.method, tried.score.rms)).collect();
        let choice = Choice {
            chosen: chosen.into(),
            reason: reason(chosen, &held_out, &train.unit),
            held_out_rms: held_out.iter().map(|(name, rms)| ((*name).into(), *rms)).collect(),
        };
        let taken = tried.into_iter().find(|tried| tried.score.method == chosen);
        let whole = match taken {
            Some(taken) => taken.whole,
            None => candidate(chosen)?.fit(train, seed, progress)?,
        };
        Ok(Fit { choice: Some(choice), ..whole })
    }

    fn summary(&self) -> &'static str {
        "cross-validates the other methods and takes the simplest of the best"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

/// Tries the tilted sensor beside the upright one, where pixels say that sensors are tilted: by the margin by which
/// a method must be better. Optics that are no such lens may say so too, and are told by their errors.
fn try_tilted(
    tried: &mut Vec<Tried>,
    (train, folds): (&Dataset, &Folds),
    (seed, progress): (u64, &dyn Progress),
) -> Result<()> {
    let Some(upright) = Tried::named(tried, "brown").map(Tried::pixel_sigma) else { return Ok(()) };
    let sigma = match candidate(TILTED)?.fit_checked(train, seed, &Muted(progress)) {
        Ok(Fit { reconstructor: AnyReconstructor::Brown(fitted), .. }) => fitted.pixel_sigma,
        Err(Error::Cancelled) => return Err(Error::Cancelled),
        _ => return Ok(()),
    };
    if sigma * MARGIN >= upright {
        return Ok(());
    }
    let is_simpler = |tried: &&Tried| ["dlt", "brown"].contains(&tried.score.method);
    let place = tried.iter().take_while(is_simpler).count();
    tried.splice(place..place, scores(&[TILTED], train, folds, (seed, progress))?);
    if best(tried) != Some(TILTED) {
        tried.retain(|tried| tried.score.method != TILTED);
    }
    Ok(())
}

/// Why `chosen` was, in one sentence.
fn reason(chosen: &str, held_out: &[(&str, f64)], unit: &str) -> String {
    let own = held_out.iter().find(|score| score.0 == chosen).map_or(f64::NAN, |score| score.1);
    let others = held_out.iter().filter(|score| score.0 != chosen);
    match others.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((other, rms)) => format!(
            "held-out error {own:.4} {unit} rms, the simplest of the best fold by fold; {other} has {rms:.4}"
        ),
        None => format!("held-out error {own:.4} {unit} rms; no other method could be fitted"),
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
                    reason: "too few views for leave-one-out, so nothing was compared".into(),
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
