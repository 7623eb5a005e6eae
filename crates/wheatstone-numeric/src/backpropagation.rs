//! Back-propagation with an adaptive rate: batch gradient descent whose rate grows while the error
//! falls, and shrinks, the step taken back, when the error rises.
//!
//! Source: Vogl, Mangis, Rigler, Zink & Alkon 1988, "Accelerating the convergence of the
//! back-propagation method" (doi:10.1007/BF00332914), whose constants are the defaults.

use super::{
    perceptron::{Batch, GradientPass, Perceptron},
    simd::Real,
};
use crate::progress::Progress;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// How many digits the passes over the samples keep. The weights themselves, and the steps, always have
/// sixteen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// Sixteen.
    #[default]
    Double,
    /// Seven: enough for errors down to a millionth of the range, in a third of the time.
    Single,
}

/// Settings of the training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Backpropagation {
    /// Passes over the whole batch.
    pub epochs: u64,
    /// First learning rate.
    pub rate: f64,
    /// The rate's factor after a step that lowered the error.
    pub increase: f64,
    /// The rate's factor after a step that was taken back.
    pub decrease: f64,
    /// A step is taken back when the error grows by more than this factor.
    pub tolerated_growth: f64,
    /// Share of the last step that goes on; 0 is plain gradient descent.
    pub momentum: f64,
    /// How many digits the passes over the samples keep.
    #[serde(skip_serializing_if = "is_double")]
    pub precision: Precision,
}

impl Default for Backpropagation {
    fn default() -> Self {
        Self {
            epochs: 100_000,
            rate: 0.01,
            increase: 1.05,
            decrease: 0.7,
            tolerated_growth: 1.04,
            momentum: 0.0,
            precision: Precision::Double,
        }
    }
}

/// Settings that leave the precision alone are saved as they always were.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_double(precision: &Precision) -> bool {
    *precision == Precision::Double
}

/// One point of the learning curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CurvePoint {
    /// Epochs done.
    pub epoch: u64,
    /// Mean squared error of the scaled outputs.
    pub mean_square_error: f64,
}

/// Points on a learning curve, beside the first.
const CURVE_POINTS: u64 = 200;

/// A few hundredths of a second of work: one who asks to stop does not notice the wait.
const EPOCHS_BETWEEN_REPORTS: u64 = 256;

/// The mean over samples and outputs of the squared error, and its gradient.
struct MeanSquareError<T> {
    pass: GradientPass<T>,
    factors: Vec<f64>,
    count: f64,
}

impl<T: Real> MeanSquareError<T> {
    fn new(network: &Perceptron, batch: &Batch) -> Self {
        let outputs = network.sizes().last().map_or(0, |outputs| *outputs);
        let count = (batch.samples() * outputs) as f64;
        Self { pass: GradientPass::new(network, batch), factors: vec![2.0 / count; outputs], count }
    }

    fn at(&mut self, weights: &[f64], gradient: &mut [f64]) -> f64 {
        self.pass.run(weights, &self.factors, gradient).iter().sum::<f64>() / self.count
    }
}

impl Backpropagation {
    /// Trains `network` in place; it ends with the weights of the least error met, which is what the
    /// learning curve shows. `observe` is called with every point of the learning curve and
    /// the network as it then is.
    ///
    /// # Errors
    ///
    /// [`Error::Cancelled`] where `progress` asks for it, [`Error::Degenerate`] where the error
    /// stops being a number.
    pub fn train(
        &self,
        network: &mut Perceptron,
        batch: &Batch,
        progress: &dyn Progress,
        observe: &mut dyn FnMut(CurvePoint, &Perceptron),
    ) -> Result<()> {
        match self.precision {
            Precision::Double => self.descend::<f64>((network, batch), progress, observe),
            Precision::Single => self.descend::<f32>((network, batch), progress, observe),
        }
    }

    /// [`Backpropagation::train`], with passes in the precision of `T`.
    fn descend<T: Real>(
        &self,
        (network, batch): (&mut Perceptron, &Batch),
        progress: &dyn Progress,
        observe: &mut dyn FnMut(CurvePoint, &Perceptron),
    ) -> Result<()> {
        let mut slopes = MeanSquareError::<T>::new(network, batch);
        let count = network.weights().len();
        let (mut gradient, mut next_gradient) = (vec![0.0; count], vec![0.0; count]);
        let (mut weights, mut step) = (network.weights().to_vec(), vec![0.0; count]);
        let mut moved = weights.clone();
        let mut error = slopes.at(&weights, &mut gradient);
        let mut rate = self.rate;
        let (mut best, mut best_error) = (weights.clone(), error);
        let stride = (self.epochs / CURVE_POINTS).max(1);
        observe(CurvePoint { epoch: 0, mean_square_error: error }, network);
        for epoch in 1..=self.epochs {
            for index in 0..count {
                step[index] =
                    self.momentum * step[index] - (1.0 - self.momentum) * rate * gradient[index];
                moved[index] = weights[index] + step[index];
            }
            let next = slopes.at(&moved, &mut next_gradient);
            if next > self.tolerated_growth * error || next.is_nan() {
                rate *= self.decrease;
                step.fill(0.0);
            } else {
                if next < error {
                    rate *= self.increase;
                }
                error = next;
                std::mem::swap(&mut weights, &mut moved);
                std::mem::swap(&mut gradient, &mut next_gradient);
                if error < best_error {
                    best_error = error;
                    best.copy_from_slice(&weights);
                }
            }
            if epoch % EPOCHS_BETWEEN_REPORTS == 0 {
                progress.check()?;
                progress.report("training", epoch, self.epochs);
            }
            if epoch % stride == 0 || epoch == self.epochs {
                network.set_weights(&best);
                observe(CurvePoint { epoch, mean_square_error: best_error }, network);
            }
        }
        network.set_weights(&best);
        if !best_error.is_finite() {
            return Err(Error::Degenerate {
                problem: "training diverged: the error is not a number".into(),
                hint: "lower the learning rate".into(),
            });
        }
        Ok(())
    }
}
