//! Nonlinear least squares by Levenberg's and Marquardt's damped Gauss-Newton steps: one search, and a trait
//! for the problems that it solves.
//!
//! A problem says how a step is computed, so that its structure stays its own: dense normal equations
//! ([`minimise`]), charts eliminated from a bundle by Schur's complement, three unknowns of a point.
//!
//! Source: Marquardt 1963 (doi:10.1137/0111030); the damping rule is Nielsen's (Madsen, Nielsen &
//! Tingleff 2004, "Methods for non-linear least squares problems", section 3.2).

mod dense;

pub use dense::{Minimum, NormalEquations, minimise};

use crate::Result;
use crate::progress::Progress;

/// A least-squares problem.
pub trait Problem {
    /// The unknowns.
    type State;
    /// Residuals and derivatives at a state, as far as steps need them.
    type Equations;
    /// A change of the unknowns.
    type Step;

    /// The problem linearised at a state; `None` where residuals do not exist (a point behind a camera).
    fn linearise(&self, state: &Self::State) -> Option<Self::Equations>;

    /// The step for this damping, and how much of the cost it takes away if the equations hold for it;
    /// `None` where they determine none.
    fn step(&self, equations: &Self::Equations, damping: f64) -> Option<(Self::Step, f64)>;

    /// The state after a step.
    fn moved(&self, state: &Self::State, step: &Self::Step) -> Self::State;

    /// Half the weighted sum of squared residuals.
    fn cost(&self, equations: &Self::Equations) -> f64;

    /// How much lower the cost is after a step; a step that lowers nothing is not taken. Problems whose weights
    /// depend on the state compare both by the weights of the first.
    fn gain(&self, before: &Self::Equations, after: &Self::Equations) -> f64 {
        self.cost(before) - self.cost(after)
    }

    /// Whether a step changes the residuals by no more than rounding does: the last one.
    fn is_negligible(&self, _: &Self::Equations, _: &Self::Step) -> bool {
        false
    }
}

/// How strongly steps are held back: the multiple of the normal matrix's diagonal that is added to it.
#[derive(Clone, Copy, Debug)]
pub struct Damping {
    /// The multiple.
    pub value: f64,
    /// What a failed step multiplies it by.
    rise: f64,
    /// The least that a good step multiplies it by.
    fall: f64,
    /// The least after a good step, and after a failed one.
    least: [f64; 2],
    /// Whether both factors depend on how the steps went.
    follows_gain: bool,
}

impl Damping {
    /// By Nielsen's rule: the better a step kept its promise the more it falls, to no less than this share, and it
    /// rises the faster the more steps fail in a row.
    #[must_use]
    pub fn nielsen(value: f64, fall: f64) -> Self {
        Self { value, rise: 2.0, fall, least: [LEAST_DAMPING; 2], follows_gain: true }
    }

    /// By fixed factors, as Marquardt's: for robust costs, which promise too little.
    #[must_use]
    pub fn marquardt(value: f64) -> Self {
        Self { value, rise: 10.0, fall: 0.2, least: [LEAST_DAMPING; 2], follows_gain: false }
    }

    /// None until a step fails, as in Gauss's and Newton's method; then by fixed factors.
    #[must_use]
    pub fn undamped() -> Self {
        Self { value: 0.0, rise: 10.0, fall: 0.1, least: [0.0, 1e-3], follows_gain: false }
    }

    /// After a step that gained this share of what was promised.
    pub fn accept(&mut self, quality: f64) {
        let off = 2.0 * quality - 1.0;
        let share = if self.follows_gain { 1.0 - off * off * off } else { self.fall };
        self.value = (self.value * share.clamp(self.fall, 2.0)).max(self.least[0]);
        if self.follows_gain {
            self.rise = 2.0;
        }
    }

    /// After a step that led nowhere.
    pub fn reject(&mut self) {
        self.value = (self.value * self.rise).max(self.least[1]);
        if self.follows_gain {
            self.rise *= 2.0;
        }
    }
}

/// Less leads to no other step, and takes longer to recover from.
const LEAST_DAMPING: f64 = 1e-12;

/// More leaves steps that move nothing.
const MOST_DAMPING: f64 = 1e16;

/// When a search ends.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Most steps, those that are not taken among them.
    pub steps: usize,
    /// A step that lowers the cost by less than this share of it is the last.
    pub least_gain: f64,
}

impl Default for Patience {
    fn default() -> Self {
        Self { steps: 200, least_gain: 1e-12 }
    }
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub struct Found<P: Problem> {
    /// The unknowns.
    pub state: P::State,
    /// The problem linearised there.
    pub equations: P::Equations,
    /// Damping of the next step.
    pub damping: Damping,
}

/// Looks for the least cost from `start`, with this damping of the first step. `None` where the residuals do
/// not exist at the start.
///
/// # Errors
///
/// [`crate::Error::Cancelled`].
pub fn search<P: Problem>(
    problem: &P,
    start: P::State,
    (patience, mut damping): (Patience, Damping),
    progress: &dyn Progress,
) -> Result<Option<Found<P>>> {
    let mut state = start;
    let Some(mut equations) = problem.linearise(&state) else { return Ok(None) };
    for _ in 0..patience.steps {
        if damping.value > MOST_DAMPING {
            break;
        }
        progress.check()?;
        let Some((step, promised)) = problem.step(&equations, damping.value) else {
            damping.reject();
            continue;
        };
        let last = problem.is_negligible(&equations, &step);
        let moved = problem.moved(&state, &step);
        // Most steps are good ones: what the next one needs is worked out with the cost.
        let after =
            problem.linearise(&moved).map(|after| (problem.gain(&equations, &after), after));
        if let Some((gain, after)) = after.filter(|(gain, _)| *gain > 0.0) {
            damping.accept(gain / promised.max(f64::MIN_POSITIVE));
            let done = last || gain <= patience.least_gain * problem.cost(&after);
            (state, equations) = (moved, after);
            if done {
                break;
            }
        } else if last {
            break;
        } else {
            damping.reject();
        }
    }
    Ok(Some(Found { state, equations, damping }))
}
