//! The multilayer perceptron: fully connected layers of log-sigmoids, linear or sigmoid outputs.
//!
//! [`Perceptron::evaluate`] is the plain reference; a [`Batch`] holds many samples side by side and
//! is what training goes through, tested against the reference.

mod batch;
mod curvature;
mod forward;
mod jacobian;
mod packed;
mod gradient;

pub use batch::{Batch, LANES, Lane, Workspace};
pub use curvature::Curvature;
pub use forward::Forward;
pub use forward::{Samples, TOGETHER};
pub use gradient::GradientPass;

use super::{random::Random, sigmoid::sigmoid};
use serde::{Deserialize, Serialize};

/// What the last layer does to its weighted sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutputActivation {
    /// Nothing.
    #[default]
    Linear,
    /// The same log-sigmoid as the hidden layers; it cannot leave 0..1.
    Sigmoid,
}

/// A feed-forward network; hidden units are `1 / (1 + exp(-gain * z))`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perceptron {
    /// Units a layer, inputs first, outputs last.
    sizes: Vec<usize>,
    /// Slope of the log-sigmoid.
    gain: f64,
    /// The last layer's activation.
    output: OutputActivation,
    /// Layer by layer: weights `(outputs, inputs)` row by row, then biases.
    weights: Vec<f64>,
}

impl Perceptron {
    /// A network with Nguyen & Widrow's initial weights (doi:10.1109/IJCNN.1990.137819) for inputs
    /// in 0..1: each hidden unit's active range covers its share of the inputs' range.
    #[must_use]
    pub fn nguyen_widrow(
        sizes: &[usize],
        gain: f64,
        output: OutputActivation,
        random: &mut Random,
    ) -> Self {
        let mut weights = Vec::with_capacity(weight_count(sizes));
        let layers = sizes.len() - 1;
        for (layer, pair) in sizes.windows(2).enumerate() {
            let (inputs, outputs) = (pair[0], pair[1]);
            if layer + 1 == layers {
                weights.extend((0..(inputs + 1) * outputs).map(|_| random.uniform(-1.0, 1.0)));
            } else {
                hidden_layer(inputs, outputs, gain, random, &mut weights);
            }
        }
        Self { sizes: sizes.to_vec(), gain, output, weights }
    }

    /// Units a layer, inputs first, outputs last.
    #[must_use]
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Every weight and bias, see [`Perceptron::set_weights`] for their order.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Replaces the weights: layer by layer, `(outputs, inputs)` row by row, then the biases.
    /// Numbers beyond those of the network are ignored.
    pub fn set_weights(&mut self, weights: &[f64]) {
        for (own, new) in self.weights.iter_mut().zip(weights) {
            *own = *new;
        }
    }

    /// Whether the parts fit together: a saved network may come from anywhere.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.sizes.len() >= 2
            && self.sizes.iter().all(|size| *size > 0)
            && self.gain.is_finite()
            && self.weights.len() == weight_count(&self.sizes)
            && self.weights.iter().all(|weight| weight.is_finite())
    }

    /// The outputs for one sample of inputs.
    #[must_use]
    pub fn evaluate(&self, inputs: &[f64]) -> Vec<f64> {
        self.activations(inputs).pop().unwrap_or_default()
    }

    /// Every layer's activations for one sample, the inputs first.
    fn activations(&self, inputs: &[f64]) -> Vec<Vec<f64>> {
        let mut all = vec![inputs.to_vec()];
        let mut weights = self.weights.as_slice();
        for layer in 1..self.sizes.len() {
            let (below, here) = (&all[layer - 1], self.sizes[layer]);
            let (rows, rest) = weights.split_at(below.len() * here);
            let (biases, rest) = rest.split_at(here);
            weights = rest;
            let squash = layer + 1 < self.sizes.len() || self.output == OutputActivation::Sigmoid;
            let next = rows.chunks_exact(below.len()).zip(biases).map(|(row, bias)| {
                let sum = bias + row.iter().zip(below).map(|(w, a)| w * a).sum::<f64>();
                if squash { sigmoid(self.gain * sum) } else { sum }
            });
            let next = next.collect();
            all.push(next);
        }
        all
    }

    /// Whether the activations of `layer` (1 = first hidden) go through the sigmoid.
    fn squashes(&self, layer: usize) -> bool {
        layer + 1 < self.sizes.len() || self.output == OutputActivation::Sigmoid
    }
}

/// Weights and biases of a network with these layers.
#[must_use]
pub fn weight_count(sizes: &[usize]) -> usize {
    sizes.windows(2).map(|pair| (pair[0] + 1) * pair[1]).sum()
}

/// Appends one hidden layer's weights and biases.
fn hidden_layer(
    inputs: usize,
    outputs: usize,
    gain: f64,
    random: &mut Random,
    into: &mut Vec<f64>,
) {
    // Nguyen & Widrow: length of the weight vectors for inputs in -1..1 and units active in -1..1.
    let length = 0.7 * libm::pow(outputs as f64, 1.0 / inputs as f64);
    // A log-sigmoid is active for arguments in -4..4, and inputs are in 0..1, not -1..1.
    let active = 4.0 / gain;
    let mut biases = Vec::with_capacity(outputs);
    for unit in 0..outputs {
        let direction: Vec<f64> = (0..inputs).map(|_| random.uniform(-1.0, 1.0)).collect();
        let norm = direction.iter().map(|d| d * d).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let row: Vec<f64> = direction.iter().map(|d| d / norm * length * active * 2.0).collect();
        let place = if outputs > 1 {
            length * (2.0 * unit as f64 / (outputs - 1) as f64 - 1.0)
        } else {
            0.0
        };
        let sign = if direction[0] >= 0.0 { 1.0 } else { -1.0 };
        biases.push(active * place * sign - row.iter().sum::<f64>() / 2.0);
        into.extend(row);
    }
    into.extend(biases);
}
