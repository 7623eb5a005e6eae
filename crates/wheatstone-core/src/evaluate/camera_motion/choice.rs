//! Which motions explain what was seen: the fewest that leave nothing to explain.

use super::{
    rows::{COLUMNS, Rig, SHIFT, TURN, ZOOM},
    solution::{ChiSquare, Solution, pseudo_inverse},
};
use crate::{Result, method::FitErrors};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use wheatstone_numeric::progress::Progress;

/// What changed about a camera, or about the whole rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// It turned about its own centre.
    Turn,
    /// It was shifted without a turn.
    Shift,
    /// It turned and was shifted.
    TurnAndShift,
    /// Its pictures grew or shrank: the focal length changed.
    FocalLength,
}

impl Change {
    const ALL: [Self; 4] = [Self::Turn, Self::Shift, Self::TurnAndShift, Self::FocalLength];

    fn columns(self) -> std::ops::Range<usize> {
        match self {
            Self::Turn => TURN,
            Self::Shift => SHIFT,
            Self::TurnAndShift => TURN.start..SHIFT.end,
            Self::FocalLength => ZOOM,
        }
    }
}

/// One thing that may have changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    /// None for the given places, or what is the same, all cameras together.
    pub(super) camera: Option<usize>,
    pub(super) change: Change,
}

impl Candidate {
    pub(super) fn columns(self, rig: &Rig<'_>) -> Vec<usize> {
        let first = COLUMNS * self.camera.unwrap_or(rig.frames.len());
        self.change.columns().map(|column| first + column).collect()
    }
}

/// A change that was found.
pub(super) struct Choice {
    /// The simplest that explains it.
    pub(super) best: Candidate,
    /// The others, with the probability of each given that one of them happened.
    pub(super) shares: Vec<(Candidate, f64)>,
}

/// Whose changes are looked for.
pub(super) struct Search<'a, 'b> {
    pub(super) rig: &'a Rig<'b>,
    pub(super) errors: Option<&'a FitErrors<'b>>,
    /// Of the pixels, in units of what the map expects.
    pub(super) variance: f64,
    /// How much larger covariances are than noise and fit make them.
    pub(super) widened: f64,
    /// Chance makes more with this probability at most.
    pub(super) rate: f64,
    pub(super) progress: &'a dyn Progress,
}

impl Search<'_, '_> {
    /// The covariance of gradients at a solution.
    pub(super) fn noise(&self, solution: &Solution) -> Option<DMatrix<f64>> {
        Some(solution.noise(self.rig, self.variance, self.errors)? * self.widened)
    }

    fn judged(&self, solution: &Solution) -> Option<ChiSquare> {
        solution.against(&self.noise(solution)?)
    }

    /// How far the last change of a solution is from none.
    fn size(&self, solution: &Solution, last: Candidate) -> Option<ChiSquare> {
        let values = solution.state.values(last.camera);
        let own = DVector::from_iterator(
            last.change.columns().len(),
            last.change.columns().map(|column| values[column]),
        );
        let covariance = solution.covariance(&self.noise(solution)?)?;
        let first = covariance.nrows().checked_sub(own.len())?;
        let last = covariance.view((first, first), (own.len(), own.len())).into_owned();
        let (inverse, freedom) = pseudo_inverse(last)?;
        Some(ChiSquare { value: own.dot(&(inverse * &own)), freedom })
    }

    /// Adds changes to `solution` until nothing is left to explain, or none is left. Where no place is given one
    /// camera stays: only motions against each other can be seen.
    pub(super) fn run(&self, mut solution: Solution) -> Result<(Solution, Vec<Choice>)> {
        let cameras = self.rig.frames.len();
        let most = if self.rig.middle.is_some() { cameras } else { cameras.saturating_sub(1) };
        let mut chosen: Vec<Choice> = Vec::new();
        while chosen.len() < most
            && self.judged(&solution).is_some_and(|left| left.chance() < self.rate)
        {
            let Some((next, choice)) = self.next(&solution, &chosen)? else { break };
            // What no motion explains is none.
            if self.size(&next, choice.best).is_none_or(|size| size.chance() > self.rate) {
                break;
            }
            solution = next;
            chosen.push(choice);
        }
        Ok((solution, chosen))
    }

    fn next(&self, from: &Solution, chosen: &[Choice]) -> Result<Option<(Solution, Choice)>> {
        let is_free = |camera: Option<usize>| chosen.iter().all(|c| c.best.camera != camera);
        let cameras = (0..self.rig.frames.len()).map(Some);
        let all = cameras.chain(self.rig.middle.is_some().then_some(None));
        let candidates = all.filter(|camera| is_free(*camera)).flat_map(|camera| {
            // The places given do not grow; that they were only turned is as likely as any other motion.
            let may = move |change: &Change| camera.is_some() || *change == Change::TurnAndShift;
            Change::ALL.into_iter().filter(may).map(move |change| Candidate { camera, change })
        });
        let penalty = libm::log(from.squares().1.max(2) as f64);
        let mut tried = Vec::new();
        for candidate in candidates {
            let own = candidate.columns(self.rig);
            let columns = from.columns.iter().copied().chain(own.clone()).collect();
            let start = from.state.clone();
            let Some(found) = Solution::of(self.rig, start, columns, self.progress)? else {
                continue;
            };
            let Some(left) = self.judged(&found) else { continue };
            // Schwarz's criterion.
            tried.push((left.value + penalty * own.len() as f64, candidate, found));
        }
        let least = tried.iter().map(|(cost, ..)| *cost).fold(f64::INFINITY, f64::min);
        let weight = |cost: f64| libm::exp(-0.5 * (cost - least));
        let sum: f64 = tried.iter().map(|(cost, ..)| weight(*cost)).sum();
        let shares = tried.iter().map(|(cost, candidate, _)| (*candidate, weight(*cost) / sum));
        let shares = shares.collect();
        let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        Ok(best.map(|(_, best, solution)| (solution, Choice { best, shares })))
    }
}
