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
pub use gradient::Sweep;

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

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(n: usize, width: usize, random: &mut Random) -> Vec<Vec<f64>> {
        (0..n).map(|_| (0..width).map(|_| random.uniform(0.0, 1.0)).collect()).collect()
    }

    #[test]
    fn gradient_agrees_with_differences_for_every_shape() {
        let shapes: [&[usize]; 4] = [&[4, 8, 8, 3], &[6, 5, 3], &[2, 1], &[4, 3, 2, 5, 1]];
        for (seed, sizes) in shapes.into_iter().enumerate() {
            for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
                let mut random = Random::new(seed as u64);
                let mut net = Perceptron::nguyen_widrow(sizes, 1.3, output, &mut random);
                // 37 samples: two full blocks and one that is padded.
                let inputs = rows(37, sizes[0], &mut random);
                let targets = rows(37, sizes[sizes.len() - 1], &mut random);
                let batch = Batch::new(&inputs, &targets);
                let mut work = Workspace::new(sizes);
                let mut gradient = vec![0.0; net.weights().len()];
                net.mean_square_error(&batch, &mut gradient, &mut work);
                let weights = net.weights().to_vec();
                let mut error_at = |index: usize, step: f64| {
                    let mut moved = weights.clone();
                    moved[index] += step;
                    net.set_weights(&moved);
                    let squares = inputs.iter().zip(&targets).flat_map(|(x, t)| {
                        net.evaluate(x).into_iter().zip(t.clone()).map(|(o, t)| (o - t) * (o - t))
                    });
                    squares.sum::<f64>() / (37 * sizes[sizes.len() - 1]) as f64
                };
                for (index, slope) in gradient.iter().enumerate() {
                    let step = 1e-5;
                    let difference =
                        (error_at(index, step) - error_at(index, -step)) / (2.0 * step);
                    assert!(
                        (slope - difference).abs() < 1e-8,
                        "{sizes:?} {output:?} weight {index}: {slope} against {difference}"
                    );
                }
            }
        }
    }

    #[test]
    fn batch_error_is_the_reference_error() {
        let mut random = Random::new(3);
        let net =
            Perceptron::nguyen_widrow(&[4, 8, 8, 3], 1.0, OutputActivation::Linear, &mut random);
        let (inputs, targets) = (rows(50, 4, &mut random), rows(50, 3, &mut random));
        let mut gradient = vec![0.0; net.weights().len()];
        let error = net.mean_square_error(
            &Batch::new(&inputs, &targets),
            &mut gradient,
            &mut Workspace::new(net.sizes()),
        );
        let reference = inputs
            .iter()
            .zip(&targets)
            .flat_map(|(x, t)| net.evaluate(x).into_iter().zip(t.clone()))
            .map(|(o, t)| (o - t) * (o - t))
            .sum::<f64>()
            / 150.0;
        assert!((error - reference).abs() < 1e-14 * reference);
    }

    #[test]
    fn nguyen_widrow_spreads_the_active_ranges_over_the_inputs() {
        let mut random = Random::new(5);
        let net = Perceptron::nguyen_widrow(&[1, 9, 1], 1.0, OutputActivation::Linear, &mut random);
        // Each unit is at one half somewhere; those places must reach across 0..1.
        let (weights, biases) = (&net.weights()[..9], &net.weights()[9..18]);
        let centres: Vec<f64> = weights.iter().zip(biases).map(|(w, b)| -b / w).collect();
        assert!(centres.iter().all(|c| (-0.01..=1.01).contains(c)), "{centres:?}");
        let spread = centres.iter().fold(0.0_f64, |most, c| most.max((c - 0.5).abs()));
        assert!(spread > 0.4, "{centres:?}");
    }
}
