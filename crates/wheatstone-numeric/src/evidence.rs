//! Second-order training of a perceptron whose weight decay the data choose: Levenberg-Marquardt
//! steps, and after every second the decay and the noise that make the data most probable.
//!
//! Sources: MacKay 1992, "A practical Bayesian framework for backpropagation networks"
//! (doi:10.1162/neco.1992.4.3.448); Foresee & Hagan 1997, "Gauss-Newton approximation to Bayesian
//! learning" (doi:10.1109/ICNN.1997.614194); Hagan & Menhaj 1994 (doi:10.1109/72.329697) for
//! Levenberg-Marquardt on networks; Transtrum & Sethna 2012, "Improvements to the Levenberg-Marquardt
//! algorithm for nonlinear least-squares minimization" (arXiv:1201.5885) for steps that bend. Each output
//! has its own noise, each layer its own decay.

mod expansion;
mod posterior;

use super::{
    levenberg_marquardt::Damping,
    perceptron::{Batch, Perceptron},
};
use crate::progress::Progress;
use crate::{Error, Result};
use expansion::Expansion;
use nalgebra::DMatrix;
use posterior::{Decay, Posterior, factors, misfit};
use serde::{Deserialize, Serialize, de::IgnoredAny};

/// Settings of the training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Stored")]
pub struct Evidence {
    /// Starts from which it is trained.
    pub starts: u64,
    /// Most steps from each start.
    pub steps: u64,
    /// Training ends when the log evidence has risen by less than this over six steps.
    pub least_gain: f64,
}

impl Default for Evidence {
    fn default() -> Self {
        Self { starts: 4, steps: 400, least_gain: 0.3 }
    }
}

/// Settings as files have them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Stored {
    starts: u64,
    steps: u64,
    least_gain: f64,
    /// Where files were written when all starts but one ended after so many steps.
    #[serde(rename = "first_steps")]
    _first_steps: IgnoredAny,
}

impl Default for Stored {
    fn default() -> Self {
        let Evidence { starts, steps, least_gain } = Evidence::default();
        Self { starts, steps, least_gain, _first_steps: IgnoredAny }
    }
}

impl From<Stored> for Evidence {
    fn from(Stored { starts, steps, least_gain, .. }: Stored) -> Self {
        Self { starts, steps, least_gain }
    }
}

/// What training found beside the weights.
#[derive(Clone, Debug)]
pub struct Trained {
    /// Logarithm of the data's probability given the network's form, up to a constant: the higher,
    /// the better the network will do on new data.
    pub log_evidence: f64,
    /// How many of the weights the data determine.
    pub effective_parameters: f64,
    /// Variance of each output's noise.
    pub noise: Vec<f64>,
    /// Covariance of the weights (Laplace's approximation).
    pub covariance: DMatrix<f64>,
    /// Sum of squared errors, each over its noise, step by step.
    pub curve: Vec<f64>,
}

/// A training under way: one start, or what became of it.
pub struct TrainingCurve {
    network: Perceptron,
    expansion: Expansion,
    samples: f64,
    decay: Decay,
    noise: Vec<f64>,
    errors: Vec<f64>,
    /// How many times its decay each weight is held back by in a step.
    damping: Damping,
    /// Noise and decay are no longer the first guesses.
    warm: bool,
    /// Sum of squared errors, each over its noise, and log evidence, step by step.
    history: Vec<(f64, f64)>,
    settled: bool,
}

impl TrainingCurve {
    /// Begins from the weights of `network`.
    #[must_use]
    pub fn new(network: Perceptron, batch: &Batch) -> Self {
        let mut expansion = Expansion::new(&network, batch);
        let ones = vec![1.0; network.sizes().last().map_or(0, |outputs| *outputs)];
        let errors = expansion.squared_errors(network.weights(), &ones).to_vec();
        let samples = batch.samples() as f64;
        Self {
            decay: Decay::new(network.sizes(), FIRST_DECAY),
            noise: errors.iter().map(|sum| (FIRST_NOISE * sum / samples).max(1e-30)).collect(),
            errors,
            network,
            expansion,
            samples,
            damping: first_damping(),
            warm: false,
            history: Vec::new(),
            settled: false,
        }
    }

    /// The log evidence when it was last asked for; minus infinity before.
    #[must_use]
    pub fn log_evidence(&self) -> f64 {
        self.history.last().map_or(f64::NEG_INFINITY, |last| last.1)
    }

    /// By how much it rose in the last so many steps; infinity where it was not asked for before them.
    #[must_use]
    pub fn gain(&self, steps: usize) -> f64 {
        let place = self.history.len().checked_sub(steps + 1);
        let before = place.map(|place| self.history[place].1).filter(|before| before.is_finite());
        before.map_or(f64::INFINITY, |before| self.log_evidence() - before)
    }

    /// Whether there is nothing left to train.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.settled
    }

    /// Steps taken.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.history.len() as u64
    }

    /// Goes on for at most `steps` steps, or until the evidence rises by less than `least_gain` over
    /// six.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`], [`Error::Degenerate`] where no step can be computed.
    pub fn go_on(
        &mut self,
        (steps, least_gain): (u64, f64),
        progress: &dyn Progress,
    ) -> Result<()> {
        for _ in 0..steps {
            if self.settled {
                break;
            }
            progress.check()?;
            self.expansion.at(self.network.weights(), &self.noise);
            let square = misfit(&self.errors, &self.noise);
            self.history.push((square, self.log_evidence()));
            if !self.is_judged() {
                if self.step() {
                    continue;
                }
                (self.damping, self.warm) = (first_damping(), true);
            }
            self.warm |= self.history.len() > WARM_UP;
            if self.judge(least_gain)? {
                self.settled |= !self.step();
            }
        }
        Ok(())
    }

    /// Whether the evidence is asked for after the present step: not of the first, whose noise and decay are
    /// guesses, and then of every second, so that the weights follow what it chose before it chooses again.
    fn is_judged(&self) -> bool {
        let past = self.history.len();
        (self.warm || past > WARM_UP) && past.is_multiple_of(2)
    }

    /// Asks for the evidence, and once warm takes the noise and the decay that it chooses; whether the expansion
    /// still serves for a step.
    fn judge(&mut self, least_gain: f64) -> Result<bool> {
        let state = self.posterior()?;
        let evidence = self.evidence_of(&state);
        if let Some(last) = self.history.last_mut() {
            last.1 = evidence;
        }
        let long = self.history.len() > 2 * WARM_UP;
        self.settled = long && self.gain(STANDSTILL) < least_gain;
        if !self.warm {
            return Ok(true);
        }
        let noise = self.noise.clone();
        let found = (self.network.weights(), &*self.errors, self.samples);
        state.update(&mut self.decay, &mut self.noise, found);
        // The expansion holds for the noise it was made with: its step would lead astray.
        let mut ratios = noise.iter().zip(&self.noise).map(|(old, new)| old / new);
        Ok(ratios.all(|ratio| (1.0 / JUMP..JUMP).contains(&ratio)))
    }

    fn posterior(&self) -> Result<Posterior> {
        Posterior::new(&self.expansion.hessian, &self.decay).ok_or_else(singular)
    }

    fn evidence_of(&self, state: &Posterior) -> f64 {
        let left = (&*self.noise, &*self.errors, self.samples);
        state.log_evidence(&self.decay, left, self.network.weights())
    }

    /// What was found.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] where the weights have no covariance.
    pub fn finish(mut self) -> Result<(Perceptron, Trained)> {
        self.expansion.at(self.network.weights(), &self.noise);
        let state = self.posterior()?;
        let log_evidence = self.evidence_of(&state);
        let factors = factors(&self.expansion.hessian, &self.decay);
        let trained = Trained {
            log_evidence,
            effective_parameters: state.effective,
            noise: self.noise,
            covariance: factors.ok_or_else(singular)?.inverse(),
            curve: self.history.iter().map(|(square, _)| *square).collect(),
        };
        Ok((self.network, trained))
    }

    /// One Levenberg-Marquardt step that lowers the regularised misfit; whether there is one.
    ///
    /// What holds a weight back is a multiple of its decay: the scale on which weights of its class vary, where
    /// Marquardt's, the curvature, would hold back the weights that matter most. Nielsen's rule says how much.
    fn step(&mut self) -> bool {
        let start = self.network.weights().to_vec();
        let before = misfit(&self.errors, &self.noise) + self.decay.penalty(&start);
        for _ in 0..MOST_TRIES {
            if let Some((moved, promised)) =
                self.expansion.step((&start, &self.noise), &self.decay, self.damping.value)
            {
                let errors = self.expansion.squared_errors(&moved, &self.noise);
                let gain = before - misfit(errors, &self.noise) - self.decay.penalty(&moved);
                if gain > 0.0 {
                    self.damping.accept(gain / promised.max(f64::MIN_POSITIVE));
                    self.errors.copy_from_slice(errors);
                    self.network.set_weights(&moved);
                    self.expansion.take(&self.noise);
                    return true;
                }
            }
            self.damping.reject();
        }
        false
    }
}

/// Weights of standardised data are of order one.
const FIRST_DECAY: f64 = 1.0;

/// Share of the targets' variance that is first taken for noise. Where it is taken for all of it, the
/// evidence can settle on a network that explains nothing.
const FIRST_NOISE: f64 = 1e-3;

/// Steps taken under the first guess of noise and decay, so that the network has something to show
/// before either is judged.
const WARM_UP: usize = 15;

/// Steps over which the evidence must rise for training to go on.
const STANDSTILL: usize = 6;

/// What holds weights back in the first step, in multiples of their decay.
fn first_damping() -> Damping {
    Damping::nielsen(1000.0, 0.2)
}

/// Tries of a step: the damping grows by 2 to the power of 120.
const MOST_TRIES: usize = 15;

/// A change of the noise, as a factor, after which the expansion no longer serves.
const JUMP: f64 = 2.0;

fn singular() -> Error {
    Error::Degenerate {
        problem: "the training of the network reached a singular matrix".into(),
        hint: "check the points for gross errors".into(),
    }
}
