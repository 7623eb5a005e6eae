//! The perceptron's outputs with their derivatives by every weight, sample by sample: what
//! second-order training needs.

use super::Perceptron;

impl Perceptron {
    /// The outputs for one sample; `rows` gets their derivatives, one row of all weights an output.
    pub fn jacobian(&self, inputs: &[f64], rows: &mut [f64]) -> Vec<f64> {
        let layers = self.activations(inputs);
        let count = self.weights.len();
        let outputs = layers[layers.len() - 1].len();
        for (output, row) in rows.chunks_exact_mut(count).take(outputs).enumerate() {
            let last = layers.len() - 1;
            let mut deltas = vec![0.0; outputs];
            deltas[output] = self.slope(last, layers[last][output]);
            let mut end = count;
            for layer in (1..layers.len()).rev() {
                let below = &layers[layer - 1];
                let start = end - (below.len() + 1) * deltas.len();
                let (weights, biases) = row[start..end].split_at_mut(below.len() * deltas.len());
                for (slots, delta) in weights.chunks_exact_mut(below.len()).zip(&deltas) {
                    for (slot, activation) in slots.iter_mut().zip(below) {
                        *slot = delta * activation;
                    }
                }
                biases.copy_from_slice(&deltas);
                if layer > 1 {
                    let matrix = &self.weights[start..start + below.len() * deltas.len()];
                    deltas = self.deltas_of_layer(layer - 1, below, matrix, &deltas);
                }
                end = start;
            }
        }
        layers.into_iter().next_back().unwrap_or_default()
    }

    /// The outputs for one sample; `rows` gets their derivatives by the inputs, one row an output.
    pub fn input_jacobian(&self, inputs: &[f64], rows: &mut [f64]) -> Vec<f64> {
        let layers = self.activations(inputs);
        let last = layers.len() - 1;
        let outputs = layers[last].len();
        for (output, row) in rows.chunks_exact_mut(inputs.len()).take(outputs).enumerate() {
            let mut deltas = vec![0.0; outputs];
            deltas[output] = self.slope(last, layers[last][output]);
            let mut end = self.weights.len();
            for layer in (1..=last).rev() {
                let below = &layers[layer - 1];
                let start = end - (below.len() + 1) * deltas.len();
                let matrix = &self.weights[start..start + below.len() * deltas.len()];
                if layer > 1 {
                    deltas = self.deltas_of_layer(layer - 1, below, matrix, &deltas);
                } else {
                    row.fill(0.0);
                    for (weights, delta) in matrix.chunks_exact(below.len()).zip(&deltas) {
                        row.iter_mut().zip(weights).for_each(|(sum, w)| *sum += w * delta);
                    }
                }
                end = start;
            }
        }
        layers.into_iter().next_back().unwrap_or_default()
    }

    /// Derivative of an activation of `layer` by its weighted sum.
    fn slope(&self, layer: usize, activation: f64) -> f64 {
        if self.squashes(layer) { self.gain * activation * (1.0 - activation) } else { 1.0 }
    }

    fn deltas_of_layer(
        &self,
        layer: usize,
        activations: &[f64],
        matrix: &[f64],
        above: &[f64],
    ) -> Vec<f64> {
        let mut deltas = vec![0.0; activations.len()];
        for (row, delta) in matrix.chunks_exact(activations.len()).zip(above) {
            for (sum, weight) in deltas.iter_mut().zip(row) {
                *sum += weight * delta;
            }
        }
        for (delta, activation) in deltas.iter_mut().zip(activations) {
            *delta *= self.slope(layer, *activation);
        }
        deltas
    }
}
