//! The search for a camera's settings: those of greatest evidence, from several starts.

use super::{
    correction_basis::Field,
    evidence::{Posterior, Search, Sums},
    settings::{DISTORTION, LENGTH, NOISE, PARALLAX, PUPIL, Settings, WAVES},
};
use crate::Result;
use wheatstone_numeric::progress::Progress;

/// Lengths of the waves, in units of the field, from which searches begin: the evidence may have two hills, of short
/// waves and of long ones.
const FIRST_LENGTHS: [f64; 2] = [0.25, 0.8];

/// A gain in log evidence that is strong (Kass & Raftery 1995, doi:10.1080/01621459.1995.10476572). By distortion nearly all
/// cameras before a round tank gain 2 to 24, others rarely more than 3; by a pupil that moves those before a mirror gain 5 to 16
/// where charts fill their pictures, others without parallax less than 1. What is let in for less makes points beyond the
/// charts err by more.
const CONVINCING: f64 = 3.0;

/// How far a pupil moves, in units of its setting, from where the search for that begins.
const FIRST_PUPIL: f64 = 0.01;

/// The settings of greatest evidence, from those of a camera without correction. Distortion and pupils that move are
/// for cameras of which it is certain where their charts stand.
pub(super) fn chosen(
    sums: &Sums,
    field: &Field,
    (bare, is_certain): (Settings, bool),
    progress: &dyn Progress,
) -> Result<Option<Posterior>> {
    let plain = plain(sums, field, bare, progress)?;
    progress.check()?;
    Ok(plain
        .map(|plain| if is_certain { with_distortion_or_pupil(sums, field, plain) } else { plain }))
}

/// Those without distortion and with a pupil that stays, from those of a camera without correction.
fn plain(
    sums: &Sums,
    field: &Field,
    bare: Settings,
    progress: &dyn Progress,
) -> Result<Option<Posterior>> {
    let mut best: Option<Posterior> = None;
    for length in FIRST_LENGTHS {
        progress.check()?;
        let mut start = bare;
        start.logs[WAVES] = bare.logs[NOISE];
        start.logs[PARALLAX] = bare.logs[NOISE];
        start.logs[LENGTH] = libm::log(length);
        let is_greater =
            |found: &Posterior| best.as_ref().is_none_or(|other| found.evidence > other.evidence);
        if let Some(found) = sums.climb(field, start, Search::ALL).filter(is_greater) {
            best = Some(found);
        }
    }
    Ok(best)
}

/// Those with distortion where the points ask for it; else with a pupil that moves, where they ask for that; else `plain`.
fn with_distortion_or_pupil(sums: &Sums, field: &Field, plain: Posterior) -> Posterior {
    let noise = plain.settings.logs[NOISE];
    // Behind ports parallax has what the pupil does already. With both, views beyond the depths of the others err by more.
    let mut tried = vec![(DISTORTION, noise)];
    if plain.settings.logs[PARALLAX] <= noise {
        tried.push((PUPIL, libm::log(FIRST_PUPIL)));
    }
    for (setting, value) in tried {
        let mut start = plain.settings;
        start.logs[setting] = value;
        let is_asked_for = |with: &Posterior| with.evidence - plain.evidence > CONVINCING;
        if let Some(found) = sums.climb(field, start, Search::ALL).filter(is_asked_for) {
            return found;
        }
    }
    plain
}
