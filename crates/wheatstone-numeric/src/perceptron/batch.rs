//! The perceptron over many samples at once: forward pass, error and gradient, sixteen samples side
//! by side, nothing allocated on the way.

use super::{OutputActivation, Perceptron, weight_count};
use crate::{sigmoid::sigmoid, simd::Real};

/// Samples side by side in one vector register or a few: 16 doubles.
pub const LANES: usize = 16;
/// Partial sums kept apart for each weight's gradient, so that lanes add up in a fixed order.
const PARTIAL: usize = 4;

/// One number of each of [`LANES`] samples.
pub type Lane = [f64; LANES];

/// Inputs and targets of many samples, laid out for training, with the buffers it needs.
#[derive(Clone, Debug)]
pub struct Batch {
    pub(super) samples: usize,
    pub(super) outputs: usize,
    /// Block by block, input by input, [`LANES`] samples.
    pub(super) inputs: Vec<Lane>,
    /// Block by block, output by output.
    pub(super) targets: Vec<Lane>,
}

impl Batch {
    /// Lays out samples: `inputs` is `(n, inputs)` and `targets` `(n, outputs)`, row by row.
    #[must_use]
    pub fn new(inputs: &[Vec<f64>], targets: &[Vec<f64>]) -> Self {
        Self {
            samples: inputs.len(),
            outputs: targets.first().map_or(0, Vec::len),
            inputs: lay_out(inputs),
            targets: lay_out(targets),
        }
    }

    /// Samples in the batch.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// 1 for each sample, 0 for the padding of the last block.
    pub(super) fn present<T: Real>(&self) -> Vec<T> {
        let padded = self.samples.next_multiple_of(LANES);
        let present = (0..padded).map(|place| if place < self.samples { 1.0 } else { 0.0 });
        present.map(T::nearest).collect()
    }

    /// Inputs and targets in groups of so many samples, a multiple of [`LANES`]: group by group, column by
    /// column.
    pub(super) fn groups<T: Real>(&self, group: usize) -> [Vec<T>; 2] {
        let blocks = self.samples.div_ceil(LANES);
        [&self.inputs, &self.targets].map(|lanes| {
            let width = lanes.len() / blocks.max(1);
            let padded = self.samples.next_multiple_of(group);
            let mut groups = vec![T::default(); padded * width];
            for (place, lane) in lanes.iter().enumerate() {
                let (first, column) = (place / width * LANES, place % width);
                let start = (first / group * width + column) * group + first % group;
                let slots = groups[start..start + LANES].iter_mut();
                slots.zip(lane).for_each(|(slot, value)| *slot = T::nearest(*value));
            }
            groups
        })
    }
}

fn lay_out(rows: &[Vec<f64>]) -> Vec<Lane> {
    let width = rows.first().map_or(0, Vec::len);
    let mut lanes = vec![[0.0; LANES]; rows.len().div_ceil(LANES) * width];
    for (sample, row) in rows.iter().enumerate() {
        for (column, value) in row.iter().enumerate() {
            lanes[sample / LANES * width + column][sample % LANES] = *value;
        }
    }
    lanes
}

/// Buffers of [`Perceptron::mean_square_error`], allocated once for a whole training.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// Activations of one block, all layers, inputs first.
    activations: Vec<Lane>,
    /// Derivatives of the error by the weighted sums of two neighbouring layers.
    deltas: Vec<Lane>,
    deltas_below: Vec<Lane>,
    partial: Vec<[f64; PARTIAL]>,
}

impl Workspace {
    /// Buffers for networks of these layer sizes.
    #[must_use]
    pub fn new(sizes: &[usize]) -> Self {
        let widest = sizes.iter().copied().max().unwrap_or(0);
        Self {
            activations: vec![[0.0; LANES]; sizes.iter().sum()],
            deltas: vec![[0.0; LANES]; widest],
            deltas_below: vec![[0.0; LANES]; widest],
            partial: vec![[0.0; PARTIAL]; weight_count(sizes)],
        }
    }
}

impl Perceptron {
    /// The mean over samples and outputs of the squared error (equation 3 of the paper), and its
    /// gradient by the weights, by back-propagation.
    pub fn mean_square_error(
        &self,
        batch: &Batch,
        gradient: &mut [f64],
        work: &mut Workspace,
    ) -> f64 {
        work.partial.fill([0.0; PARTIAL]);
        let mut total = 0.0;
        self.each_block(batch, work, |targets, filled, work| {
            total += self.output_deltas(targets, filled, work);
            self.backward_block(work);
        });
        let count = (batch.samples * batch.outputs) as f64;
        for (sum, parts) in gradient.iter_mut().zip(&work.partial) {
            *sum = ((parts[0] + parts[2]) + (parts[1] + parts[3])) * (2.0 / count);
        }
        total / count
    }

    fn forward_block(&self, activations: &mut [Lane]) {
        let mut weights = self.weights.as_slice();
        let mut start = 0;
        for layer in 1..self.sizes.len() {
            let (below, here) = (self.sizes[layer - 1], self.sizes[layer]);
            let (rows, rest) = weights.split_at(below * here);
            let (biases, rest) = rest.split_at(here);
            weights = rest;
            let (lower, upper) = activations[start..].split_at_mut(below);
            for ((row, bias), out) in rows.chunks_exact(below).zip(biases).zip(upper) {
                let mut sums = [*bias; LANES];
                for (weight, values) in row.iter().zip(&*lower) {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += weight * value;
                    }
                }
                if self.squashes(layer) {
                    for sum in &mut sums {
                        *sum = sigmoid(self.gain * *sum);
                    }
                }
                *out = sums;
            }
            start += below;
        }
    }

    /// Fills `work.deltas` for the output layer; returns the block's sum of squared errors.
    fn output_deltas(&self, targets: &[Lane], filled: usize, work: &mut Workspace) -> f64 {
        let start = work.activations.len() - targets.len();
        let squash = self.output == OutputActivation::Sigmoid;
        let mut total = 0.0;
        for ((delta, out), target) in
            work.deltas.iter_mut().zip(&work.activations[start..]).zip(targets)
        {
            for lane in 0..LANES {
                // Lanes beyond the last sample are padding.
                let error = if lane < filled { out[lane] - target[lane] } else { 0.0 };
                total += error * error;
                let slope = if squash { self.gain * out[lane] * (1.0 - out[lane]) } else { 1.0 };
                delta[lane] = error * slope;
            }
        }
        total
    }

    fn backward_block(&self, work: &mut Workspace) {
        let mut weights_end = self.weights.len();
        let mut activations_end = work.activations.len();
        for layer in (1..self.sizes.len()).rev() {
            let (below, here) = (self.sizes[layer - 1], self.sizes[layer]);
            let weights_start = weights_end - (below + 1) * here;
            activations_end -= here;
            let lower = &work.activations[activations_end - below..activations_end];
            let (rows, biases) =
                work.partial[weights_start..weights_end].split_at_mut(below * here);
            for ((row, bias), delta) in rows.chunks_exact_mut(below).zip(biases).zip(&work.deltas) {
                for (sums, values) in row.iter_mut().zip(lower) {
                    accumulate(sums, delta, values);
                }
                accumulate(bias, delta, &[1.0; LANES]);
            }
            if layer > 1 {
                let rows = &self.weights[weights_start..weights_start + below * here];
                self.deltas_below(rows, lower, &work.deltas[..here], &mut work.deltas_below);
                std::mem::swap(&mut work.deltas, &mut work.deltas_below);
            }
            weights_end = weights_start;
        }
    }

    fn deltas_below(&self, rows: &[f64], lower: &[Lane], deltas: &[Lane], into: &mut [Lane]) {
        for (unit, (activation, out)) in lower.iter().zip(into).enumerate() {
            let mut sums = [0.0; LANES];
            for (row, delta) in rows.chunks_exact(lower.len()).zip(deltas) {
                for (sum, value) in sums.iter_mut().zip(delta) {
                    *sum += row[unit] * value;
                }
            }
            for (sum, a) in sums.iter_mut().zip(activation) {
                *sum *= self.gain * a * (1.0 - a);
            }
            *out = sums;
        }
    }
}

impl Perceptron {
    /// Runs the forward pass block by block; `visit` gets its targets, how many of its lanes are
    /// samples, and the buffers.
    fn each_block(
        &self,
        batch: &Batch,
        work: &mut Workspace,
        mut visit: impl FnMut(&[Lane], usize, &mut Workspace),
    ) {
        let inputs = self.sizes[0];
        let blocks =
            batch.inputs.chunks_exact(inputs).zip(batch.targets.chunks_exact(batch.outputs));
        for (block, (samples, targets)) in blocks.enumerate() {
            work.activations[..inputs].copy_from_slice(samples);
            self.forward_block(&mut work.activations);
            let filled = (batch.samples - block * LANES).min(LANES);
            visit(targets, filled, work);
        }
    }
}

/// Adds the products of two lanes to partial sums, always in the same order.
#[inline(always)]
fn accumulate(sums: &mut [f64; PARTIAL], a: &Lane, b: &Lane) {
    for (a, b) in a.chunks_exact(PARTIAL).zip(b.chunks_exact(PARTIAL)) {
        for part in 0..PARTIAL {
            sums[part] += a[part] * b[part];
        }
    }
}
