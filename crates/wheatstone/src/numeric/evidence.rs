//! Second-order training of a perceptron whose weight decay the data choose: Levenberg-Marquardt
//! steps, and after each the decay and the noise that make the data most probable.
//!
//! Sources: MacKay 1992, "A practical Bayesian framework for backpropagation networks"
//! (doi:10.1162/neco.1992.4.3.448); Foresee & Hagan 1997, "Gauss-Newton approximation to Bayesian
//! learning" (doi:10.1109/ICNN.1997.614194); Hagan & Menhaj 1994 (doi:10.1109/72.329697) for
//! Levenberg-Marquardt on networks. Each output has its own noise, each layer its own decay.

use super::perceptron::{Batch, Lane, Perceptron, Workspace};
use crate::{Error, Result, progress::Progress};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
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

/// The quadratic model of the misfit about the present weights.
struct Expansion {
    /// Half the weighted Hessian, by outer products, without decay.
    hessian: DMatrix<f64>,
    /// Half the weighted gradient, without decay.
    gradient: DVector<f64>,
}

/// One decay a class of weights: a layer's weights, and its biases.
struct Decay {
    /// The class of each weight.
    class: Vec<usize>,
    /// The decay of each class.
    rate: Vec<f64>,
}

impl Decay {
    fn new(sizes: &[usize], rate: f64) -> Self {
        let mut class = Vec::new();
        for (layer, pair) in sizes.windows(2).enumerate() {
            class.extend(std::iter::repeat_n(2 * layer, pair[0] * pair[1]));
            class.extend(std::iter::repeat_n(2 * layer + 1, pair[1]));
        }
        Self { rate: vec![rate; 2 * (sizes.len() - 1)], class }
    }

    fn of(&self, weight: usize) -> f64 {
        self.rate[self.class[weight]]
    }

    fn penalty(&self, weights: &[f64]) -> f64 {
        0.5 * weights.iter().enumerate().map(|(i, w)| self.of(i) * w * w).sum::<f64>()
    }
}

fn misfit(squares: &[f64], noise: &[f64]) -> f64 {
    0.5 * squares.iter().zip(noise).map(|(sum, variance)| sum / variance).sum::<f64>()
}

fn expand(network: &Perceptron, batch: &Batch, noise: &[f64], work: &mut Workspace) -> Expansion {
    let count = network.weights().len();
    let mut hessian = DMatrix::zeros(count, count);
    let mut gradient = DVector::zeros(count);
    let deviations: Vec<f64> = noise.iter().map(|variance| variance.sqrt()).collect();
    let outputs = noise.len();
    network.each_jacobian_block(batch, &deviations, work, |columns, errors| {
        for (slope, column) in gradient.iter_mut().zip(columns.chunks_exact(outputs)) {
            *slope += product(column, errors);
        }
        add_products(columns, outputs, &mut hessian);
    });
    hessian.fill_upper_triangle_with_lower_triangle();
    Expansion { hessian, gradient }
}

/// Partial sums of a product: as many as keep the sums' latency hidden.
const PARTIAL: usize = 4;

/// Scalar product, in a fixed order of summation.
#[inline(always)]
fn product(a: &[Lane], b: &[Lane]) -> f64 {
    let mut sums = [0.0; PARTIAL];
    for (a, b) in a.iter().zip(b) {
        for (a, b) in a.chunks_exact(PARTIAL).zip(b.chunks_exact(PARTIAL)) {
            for part in 0..PARTIAL {
                sums[part] += a[part] * b[part];
            }
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// Adds the products of all pairs of columns, each `height` lanes high, to the lower triangle.
fn add_products(columns: &[Lane], height: usize, into: &mut DMatrix<f64>) {
    let count = columns.len() / height;
    let column = |index: usize| &columns[index * height..(index + 1) * height];
    for first in 0..count {
        let own = &mut into.as_mut_slice()[first * count..(first + 1) * count];
        let a = column(first);
        let mut second = first;
        while second + 2 <= count {
            let sums = two_products(a, column(second), column(second + 1));
            own[second] += sums[0];
            own[second + 1] += sums[1];
            second += 2;
        }
        if second < count {
            own[second] += product(a, column(second));
        }
    }
}

/// Scalar products of one column with two: each of its numbers is then loaded once for both.
#[inline(always)]
fn two_products(a: &[Lane], b: &[Lane], c: &[Lane]) -> [f64; 2] {
    let mut sums = [[0.0; PARTIAL]; 2];
    for ((a, b), c) in a.iter().zip(b).zip(c) {
        let parts =
            a.chunks_exact(PARTIAL).zip(b.chunks_exact(PARTIAL)).zip(c.chunks_exact(PARTIAL));
        for ((a, b), c) in parts {
            for part in 0..PARTIAL {
                sums[0][part] += a[part] * b[part];
                sums[1][part] += a[part] * c[part];
            }
        }
    }
    sums.map(|s| (s[0] + s[2]) + (s[1] + s[3]))
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
        let errors = network.squared_errors(batch, &mut Workspace::new(network.sizes()));
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
        let mut work = Workspace::new(self.network.sizes());
        for _ in 0..steps {
            if self.settled {
                break;
            }
            progress.check()?;
            let expansion = expand(&self.network, batch, &self.noise, &mut work);
            let weights = self.network.weights().to_vec();
            let state = Posterior::new(&expansion, &self.decay, &weights).ok_or_else(singular)?;
            let evidence =
                state.log_evidence(&self.decay, (&self.noise, &self.errors, count), &weights);
            self.history.push((misfit(&self.errors, &self.noise), evidence));
            let ten_ago = self.history.len().checked_sub(11).map(|place| self.history[place].1);
            let warm = self.history.len() > 2 * WARM_UP;
            self.settled = warm && ten_ago.is_some_and(|before| evidence - before < least_gain);
            if self.history.len() > WARM_UP {
                state.update(&mut self.decay, &mut self.noise, (&weights, &self.errors, count));
            }
            self.step(batch, &expansion, &mut work);
        }
        Ok(())
    }

    /// What was found.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] where the weights have no covariance.
    pub fn finish(self, batch: &Batch) -> Result<(Perceptron, Trained)> {
        let mut work = Workspace::new(self.network.sizes());
        let expansion = expand(&self.network, batch, &self.noise, &mut work);
        let state =
            Posterior::new(&expansion, &self.decay, self.network.weights()).ok_or_else(singular)?;
        let trained = Trained {
            log_evidence: self.log_evidence(),
            effective_parameters: state.effective,
            noise: self.noise,
            covariance: state.factors.inverse(),
            curve: self.history.iter().map(|(square, _)| *square).collect(),
        };
        Ok((self.network, trained))
    }

    /// One Levenberg-Marquardt step that lowers the regularised misfit, if there is one.
    fn step(&mut self, batch: &Batch, expansion: &Expansion, work: &mut Workspace) {
        let start = self.network.weights().to_vec();
        let before = misfit(&self.errors, &self.noise) + self.decay.penalty(&start);
        let slope = DVector::from_fn(start.len(), |i, _| {
            expansion.gradient[i] + self.decay.of(i) * start[i]
        });
        for _ in 0..30 {
            let mut matrix = expansion.hessian.clone();
            for index in 0..start.len() {
                let diagonal = matrix[(index, index)];
                matrix[(index, index)] += self.decay.of(index) + self.damping * (1.0 + diagonal);
            }
            if let Some(factors) = matrix.cholesky() {
                let by = factors.solve(&slope);
                let moved: Vec<f64> = start.iter().zip(by.iter()).map(|(w, s)| w - s).collect();
                self.network.set_weights(&moved);
                let errors = self.network.squared_errors(batch, work);
                if misfit(&errors, &self.noise) + self.decay.penalty(&moved) < before {
                    self.damping = (self.damping / 5.0).max(1e-12);
                    self.errors = errors;
                    return;
                }
            }
            self.damping *= 4.0;
        }
        self.network.set_weights(&start);
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

/// What the data say of the weights, in Laplace's approximation.
struct Posterior {
    factors: Cholesky<f64, Dyn>,
    log_determinant: f64,
    /// Weights that the data determine, in all and class by class.
    effective: f64,
    effective_of_class: Vec<f64>,
}

impl Posterior {
    fn new(expansion: &Expansion, decay: &Decay, weights: &[f64]) -> Option<Self> {
        let mut matrix = expansion.hessian.clone();
        for index in 0..weights.len() {
            matrix[(index, index)] += decay.of(index);
        }
        let factors = matrix.cholesky()?;
        let lower = factors.l();
        let log_determinant = 2.0 * lower.diagonal().iter().map(|d| libm::log(*d)).sum::<f64>();
        let variances = diagonal_of_inverse(&lower);
        let mut effective_of_class = vec![0.0; decay.rate.len()];
        for (index, variance) in variances.into_iter().enumerate() {
            effective_of_class[decay.class[index]] += 1.0 - decay.of(index) * variance;
        }
        let effective = effective_of_class.iter().sum();
        Some(Self { factors, log_determinant, effective, effective_of_class })
    }

    fn log_evidence(
        &self,
        decay: &Decay,
        (noise, errors, count): (&[f64], &[f64], f64),
        weights: &[f64],
    ) -> f64 {
        let prior: f64 = (0..weights.len()).map(|i| 0.5 * libm::log(decay.of(i))).sum();
        let likelihood: f64 = noise.iter().map(|v| -0.5 * count * libm::log(*v)).sum();
        prior + likelihood
            - misfit(errors, noise)
            - decay.penalty(weights)
            - 0.5 * self.log_determinant
    }

    /// MacKay's re-estimates.
    fn update(
        &self,
        decay: &mut Decay,
        noise: &mut [f64],
        (weights, errors, count): (&[f64], &[f64], f64),
    ) {
        let mut sizes = vec![0.0; decay.rate.len()];
        for (weight, class) in weights.iter().zip(&decay.class) {
            sizes[*class] += weight * weight;
        }
        for ((rate, size), determined) in
            decay.rate.iter_mut().zip(sizes).zip(&self.effective_of_class)
        {
            *rate = (determined.max(1e-3) / f64::max(size, 1e-12)).clamp(1e-6, 1e6);
        }
        let share = self.effective / noise.len() as f64;
        for (variance, sum) in noise.iter_mut().zip(errors) {
            *variance = (sum / (count - share).max(1.0)).max(1e-30);
        }
    }
}

/// The diagonal of `(L L')^-1`: the squared lengths of the columns of `L^-1`.
fn diagonal_of_inverse(lower: &DMatrix<f64>) -> Vec<f64> {
    let count = lower.nrows();
    let mut column = vec![0.0; count];
    (0..count)
        .map(|start| {
            column[start..].fill(0.0);
            column[start] = 1.0;
            let mut sum = 0.0;
            for pivot in start..count {
                let below = &lower.as_slice()[pivot * count..(pivot + 1) * count];
                let value = column[pivot] / below[pivot];
                sum += value * value;
                for (entry, factor) in column[pivot + 1..].iter_mut().zip(&below[pivot + 1..]) {
                    *entry -= value * factor;
                }
            }
            sum
        })
        .collect()
}
