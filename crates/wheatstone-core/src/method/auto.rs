//! The method that chooses a method: each candidate is fitted without one view (or slab of space)
//! after the other, and the one whose located points lie nearest to their places is fitted to all.
//!
//! Nearly equal candidates are told apart by simplicity: fewer freedoms have fewer ways to go wrong
//! where there was no exam.

mod scores;

pub use scores::{Score, simplest_near_best};

use self::scores::{Folds, MARGIN, TILTED, Tried, best, candidate, scores};
use super::{AnyMethod, AnyReconstructor, Choice, Fit, Method, depth_is_observable, only_default};
use crate::{
    Error, Result,
    dataset::{
        Dataset,
        split::{Fold, fewest_layers, folds, folds_across, sample},
    },
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::{Muted, Progress};

/// There is nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Auto {}

/// The candidates, the simplest first.
const CANDIDATES: [&str; 5] = ["dlt", "brown", "kannala-brandt", "soloff", "neural-camera"];

/// Those of them whose rays need not be straight. Where points lie in few layers, they can say between
/// the layers what nothing contradicts.
const BENT: [&str; 1] = ["soloff"];

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

/// Errors this many times those that a method's own error bars predict ask for a second opinion.
const HONEST: f64 = 1.25;

/// With fewer views or layers than this, leaving one out says more of their lack than of the method:
/// slabs across the views are then left out too, and only methods with straight rays are tried.
const FEW: usize = 5;

/// Pixels beyond which methods are compared on a part of the points: more do not tell methods apart any better, and
/// each candidate is fitted a dozen times.
const COMPARED: usize = 200_000;

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

/// Whether [`Auto`] may choose the method of this name for such data. Charts whose poses were estimated with too long a
/// focal length stand too far away, and so do views left out: their errors do not show it, so the error bars must.
pub(crate) fn may_choose(method: &str, data: &Dataset) -> bool {
    let includes = || candidate(method).is_ok_and(|method| method.includes_pose_uncertainty());
    !data.has_estimated_poses() || includes()
}

/// Groups of views that are left out together where one comparison of two methods is enough.
const GROUPS: usize = 6;

/// Whether `simple` locates points of views left out as well as `other` does, by [`simplest_near_best`]. Not so where
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
        let (every, part) = sample(train, COMPARED, seed);
        let on_part = compared(&part, seed, progress)?;
        let Some(mut choice) = on_part.choice.clone().filter(|_| every > 1) else {
            return Ok(on_part);
        };
        choice.reason += &format!("; compared on one point of {every}, as there are many");
        let fit = choice.method()?.fit(train, seed, progress)?;
        Ok(Fit { choice: Some(choice), ..fit })
    }

    fn includes_pose_uncertainty(&self) -> bool {
        true
    }

    fn summary(&self) -> &'static str {
        "cross-validates the other methods and takes the simplest of the best"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

/// The simplest of the best methods, fitted to all points.
fn compared(train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
    // What is left without a fold must still tell depth: without one wing of a V it does not.
    let tells_depth = |fold: &Fold| depth_is_observable(&fold.divide(train).0).is_ok();
    // A view that one camera alone saw examines nothing.
    let examines = |fold: &Fold| fold.divide(train).1.known().any(|(_, row)| row.seen_by() >= 2);
    let views: Vec<Fold> = folds(train).into_iter().filter(examines).collect();
    let few = views.len() < FEW || fewest_layers(train).is_some_and(|count| count < FEW);
    let mut all: Vec<Fold> = views.into_iter().filter(tells_depth).collect();
    let views = all.len();
    if few {
        all.extend(folds_across(train).into_iter().filter(tells_depth));
    }
    let folds = Folds { all, views };
    let mut candidates = CANDIDATES.to_vec();
    candidates.retain(|name| !(few && BENT.contains(name)) && may_choose(name, train));
    let mut tried = if folds.all.len() < 2 {
        Vec::new()
    } else {
        scores(&candidates, train, &folds, (seed, progress))?
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
    if sigma * MARGIN >= upright || !is_clear(train, upright / sigma) {
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

/// Whether errors that are so many times smaller speak for two angles more of each camera: of few points, chance makes
/// them smaller by more than [`MARGIN`].
fn is_clear(train: &Dataset, ratio: f64) -> bool {
    /// Standard deviations of a chi-square.
    const CLEARLY: f64 = 5.0;
    let coordinates: usize = train.known().map(|(_, row)| 2 * row.seen_by()).sum();
    let gain = coordinates as f64 * (ratio * ratio - 1.0);
    let angles = 2.0 * train.cameras as f64;
    gain > angles + CLEARLY * (2.0 * angles).sqrt()
}

/// Why `chosen` was, in one sentence.
fn reason(chosen: &str, held_out: &[(&str, f64)], unit: &str) -> String {
    let own = held_out.iter().find(|score| score.0 == chosen).map_or(f64::NAN, |score| score.1);
    let others = held_out.iter().filter(|score| score.0 != chosen);
    match others.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((other, rms)) if *rms * MARGIN < own => format!(
            "held-out error {own:.4} {unit} rms, the simplest of the best view by view; {other} has {rms:.4} over all views, where those with the largest errors decide"
        ),
        Some((other, rms)) => format!(
            "held-out error {own:.4} {unit} rms, the simplest of the best; {other} has {rms:.4}"
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
