//! Second-order training of a perceptron whose weight decay the data choose: Levenberg-Marquardt
//! steps, and after each the decay and the noise that make the data most probable.
//!
//! Sources: MacKay 1992, "A practical Bayesian framework for backpropagation networks"
//! (doi:10.1162/neco.1992.4.3.448); Foresee & Hagan 1997, "Gauss-Newton approximation to Bayesian
//! learning" (doi:10.1109/ICNN.1997.614194); Hagan & Menhaj 1994 (doi:10.1109/72.329697) for
//! Levenberg-Marquardt on networks. Each output has its own noise, each layer its own decay.

mod posterior;

use super::{
    cholesky::Cholesky,
    perceptron::{Batch, Curvature, Perceptron, Sweep},
};
use crate::{Error, Result, progress::Progress};
use nalgebra::DMatrix;
use posterior::{Decay, Posterior, misfit};
use serde::{Deserialize, Serialize};

/// Settings of the training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Evidence {
    /// Starts from which it is trained.
    pub starts: u64,
    /// Steps from each start; the one with the most evidence then goes on.
    pub first_steps: u64,
    /// Most steps from there.
    pub steps: u64,
    /// Training ends when the log evidence has risen by less than this over ten steps.
    pub least_gain: f64,
}

impl Default for Evidence {
    fn default() -> Self {
        Self { starts: 4, first_steps: 60, steps: 400, least_gain: 0.1 }
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

/// The quadratic model of the misfit about the present weights, and what it takes to work it out.
struct Expansion {
    curvature: Curvature,
    sweep: Sweep<f64>,
    /// Half the weighted Hessian, by outer products, without decay: its lower triangle.
    hessian: DMatrix<f64>,
    /// Half the weighted gradient, without decay.
    gradient: Vec<f64>,
}

impl Expansion {
    fn new(network: &Perceptron, batch: &Batch) -> Self {
        let count = network.weights().len();
        Self {
            curvature: Curvature::new(network, batch),
            sweep: Sweep::new(network, batch),
            hessian: DMatrix::zeros(count, count),
            gradient: vec![0.0; count],
        }
    }

    /// Expands about these weights.
    fn at(&mut self, weights: &[f64], noise: &[f64]) {
        self.curvature.hessian(weights, noise, &mut self.hessian);
        self.squared_errors(weights, noise);
    }

    /// The sum of squared errors of each output; leaves the gradient behind.
    fn squared_errors(&mut self, weights: &[f64], noise: &[f64]) -> &[f64] {
        let factors: Vec<f64> = noise.iter().map(|variance| 1.0 / variance).collect();
        self.sweep.pass(weights, &factors, &mut self.gradient)
    }
}

/// A training under way: one start, or what became of it.
pub struct Course {
    network: Perceptron,
    decay: Decay,
    noise: Vec<f64>,
    errors: Vec<f64>,
    damping: f64,
    /// Sum of squared errors, each over its noise, and log evidence, step by step.
    history: Vec<(f64, f64)>,
    settled: bool,
}

impl Course {
    /// Begins from the weights of `network`.
    #[must_use]
    pub fn new(network: Perceptron, batch: &Batch) -> Self {
        let mut unused = vec![0.0; network.weights().len()];
        let ones = vec![1.0; network.sizes().last().map_or(0, |outputs| *outputs)];
        let mut sweep = Sweep::<f64>::new(&network, batch);
        let errors = sweep.pass(network.weights(), &ones, &mut unused).to_vec();
        let count = batch.samples() as f64;
        Self {
            decay: Decay::new(network.sizes(), FIRST_DECAY),
            noise: errors.iter().map(|sum| (FIRST_NOISE * sum / count).max(1e-30)).collect(),
            errors,
            network,
            damping: 1e-2,
            history: Vec::new(),
            settled: false,
        }
    }

    /// The log evidence reached.
    #[must_use]
    pub fn log_evidence(&self) -> f64 {
        self.history.last().map_or(f64::NEG_INFINITY, |last| last.1)
    }

    /// Goes on for at most `steps` steps, or until the evidence rises by less than `least_gain` over
    /// ten.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`], [`Error::Degenerate`] where no step can be computed.
    pub fn go_on(
        &mut self,
        batch: &Batch,
        (steps, least_gain): (u64, f64),
        progress: &dyn Progress,
    ) -> Result<()> {
        let count = batch.samples() as f64;
        let mut expansion = Expansion::new(&self.network, batch);
        for step in 0..steps {
            if self.settled {
                break;
            }
            progress.check()?;
            let weights = self.network.weights().to_vec();
            expansion.at(&weights, &self.noise);
            let square = misfit(&self.errors, &self.noise);
            self.history.push((square, f64::NEG_INFINITY));
            // Nobody asks for the evidence of the first steps, unless one of them is the last.
            let early = self.history.len() <= WARM_UP && step + 1 < steps;
            if early {
                self.step(&mut expansion);
                if !self.settled {
                    continue;
                }
            }
            let state = Posterior::new(&expansion.hessian, &self.decay).ok_or_else(singular)?;
            let evidence =
                state.log_evidence(&self.decay, (&self.noise, &self.errors, count), &weights);
            if let Some(last) = self.history.last_mut() {
                last.1 = evidence;
            }
            if early {
                break;
            }
            let ten_ago = self.history.len().checked_sub(11).map(|place| self.history[place].1);
            let warm = self.history.len() > 2 * WARM_UP;
            self.settled = warm && ten_ago.is_some_and(|before| evidence - before < least_gain);
            if self.history.len() > WARM_UP {
                state.update(&mut self.decay, &mut self.noise, (&weights, &self.errors, count));
            }
            self.step(&mut expansion);
        }
        Ok(())
    }

    /// What was found.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] where the weights have no covariance.
    pub fn finish(self, batch: &Batch) -> Result<(Perceptron, Trained)> {
        let mut expansion = Expansion::new(&self.network, batch);
        expansion.at(self.network.weights(), &self.noise);
        let state = Posterior::new(&expansion.hessian, &self.decay).ok_or_else(singular)?;
        let mut precision = expansion.hessian;
        precision.fill_upper_triangle_with_lower_triangle();
        for index in 0..precision.nrows() {
            precision[(index, index)] += self.decay.of(index);
        }
        let trained = Trained {
            log_evidence: self.log_evidence(),
            effective_parameters: state.effective,
            noise: self.noise,
            covariance: precision.cholesky().ok_or_else(singular)?.inverse(),
            curve: self.history.iter().map(|(square, _)| *square).collect(),
        };
        Ok((self.network, trained))
    }

    /// One Levenberg-Marquardt step that lowers the regularised misfit, if there is one.
    fn step(&mut self, expansion: &mut Expansion) {
        let start = self.network.weights().to_vec();
        let before = misfit(&self.errors, &self.noise) + self.decay.penalty(&start);
        let slopes = expansion.gradient.iter().zip(&start).enumerate();
        let slopes: Vec<f64> = slopes.map(|(i, (g, w))| g + self.decay.of(i) * w).collect();
        let mut moved = start.clone();
        for _ in 0..30 {
            let damp = |index: usize| {
                self.decay.of(index) + self.damping * (1.0 + expansion.hessian[(index, index)])
            };
            if let Some(factors) = Cholesky::new(&expansion.hessian, damp) {
                let by = factors.solve(&slopes);
                for ((moved, start), by) in moved.iter_mut().zip(&start).zip(by) {
                    *moved = start - by;
                }
                let errors = expansion.squared_errors(&moved, &self.noise);
                if misfit(errors, &self.noise) + self.decay.penalty(&moved) < before {
                    self.damping = (self.damping / 5.0).max(1e-12);
                    self.errors.copy_from_slice(errors);
                    self.network.set_weights(&moved);
                    return;
                }
            }
            self.damping *= 4.0;
        }
        self.settled = true;
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

fn singular() -> Error {
    Error::Degenerate {
        problem: "the network's training met a singular matrix".into(),
        hint: "check the points for gross errors".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        numeric::{perceptron::OutputActivation, random::Random},
        progress::Silent,
    };
    use nalgebra::DVector;

    /// 200 samples of a smooth curve and of a straight line, each with its own noise.
    fn lesson(random: &mut Random) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        (0..200)
            .map(|_| {
                let x = random.uniform(-2.0, 2.0);
                let curve = libm::sin(2.0 * x) + 0.1 * random.normal();
                (vec![x], vec![curve, 0.5 * x + 0.02 * random.normal()])
            })
            .unzip()
    }

    fn start(random: &mut Random) -> Perceptron {
        Perceptron::nguyen_widrow(&[1, 12, 2], 1.0, OutputActivation::Linear, random)
    }

    #[test]
    fn finds_each_outputs_noise_and_leaves_weights_that_the_data_do_not_need() {
        let mut random = Random::new(3);
        let (inputs, targets) = lesson(&mut random);
        let batch = Batch::new(&inputs, &targets);
        let mut course = Course::new(start(&mut random), &batch);
        course.go_on(&batch, (300, 0.01), &Silent).unwrap();
        let (network, trained) = course.finish(&batch).unwrap();
        // Two hundred samples tell a standard deviation to a twentieth.
        assert!((trained.noise[0].sqrt() / 0.1 - 1.0).abs() < 0.15, "{:?}", trained.noise);
        assert!((trained.noise[1].sqrt() / 0.02 - 1.0).abs() < 0.15, "{:?}", trained.noise);
        assert!(trained.effective_parameters < 0.8 * network.weights().len() as f64);
        for x in [-1.5, 0.3, 1.2] {
            let out = network.evaluate(&[x]);
            assert!((out[0] - libm::sin(2.0 * x)).abs() < 0.06 && (out[1] - 0.5 * x).abs() < 0.012);
        }
    }

    #[test]
    fn the_expansion_is_that_of_the_jacobian() {
        let mut random = Random::new(5);
        let (inputs, targets) = lesson(&mut random);
        let (inputs, targets) = (&inputs[..37], &targets[..37]);
        let network = start(&mut random);
        let (count, noise) = (network.weights().len(), [0.5, 2.0]);
        let batch = Batch::new(inputs, targets);
        let mut found = Expansion::new(&network, &batch);
        found.at(network.weights(), &noise);
        let mut hessian = DMatrix::zeros(count, count);
        let mut gradient = DVector::zeros(count);
        let mut rows = vec![0.0; 2 * count];
        for (input, target) in inputs.iter().zip(targets) {
            let out = network.jacobian(input, &mut rows);
            for output in 0..2 {
                let row = DVector::from_column_slice(&rows[output * count..][..count]);
                hessian += &row * row.transpose() / noise[output];
                gradient += row * ((out[output] - target[output]) / noise[output]);
            }
        }
        let found_gradient = DVector::from_vec(found.gradient);
        assert!((found.hessian - hessian.lower_triangle()).norm() < 1e-12 * hessian.norm());
        assert!((found_gradient - &gradient).norm() < 1e-12 * gradient.norm());
    }
}
