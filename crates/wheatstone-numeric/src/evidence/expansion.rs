//! The quadratic model of the misfit about the present weights, and the steps it proposes.

use super::posterior::Decay;
use crate::{
    cholesky::{Cholesky, Lower},
    perceptron::{Batch, Curvature, GradientPass, Perceptron},
};

/// Expands the misfit, in buffers that are kept.
pub(super) struct Expansion {
    curvature: Curvature,
    pass: GradientPass<f64>,
    /// Half the weighted Hessian, by outer products, without decay.
    pub(super) hessian: Lower,
    /// Half the weighted gradient, without decay.
    gradient: Vec<f64>,
    /// The gradient where the squared errors were last asked for, or how it bends.
    other: Vec<f64>,
    /// The noise under which the gradient is already that of the weights that come next.
    ready: Option<Vec<f64>>,
}

/// How far a step may bend: half the acceleration, over the step, in the metric of the misfit.
const MOST_BEND: f64 = 0.375;

fn inverses(noise: &[f64]) -> Vec<f64> {
    noise.iter().map(|variance| 1.0 / variance).collect()
}

impl Expansion {
    pub(super) fn new(network: &Perceptron, batch: &Batch) -> Self {
        let count = network.weights().len();
        Self {
            curvature: Curvature::new(network, batch),
            pass: GradientPass::new(network, batch),
            hessian: Lower::zeros(count),
            gradient: vec![0.0; count],
            other: vec![0.0; count],
            ready: None,
        }
    }

    /// Expands about these weights.
    pub(super) fn at(&mut self, weights: &[f64], noise: &[f64]) {
        self.curvature.hessian(weights, noise, &mut self.hessian);
        if self.ready.take().is_none_or(|ready| ready != noise) {
            self.pass.run(weights, &inverses(noise), &mut self.gradient);
        }
    }

    /// The weights of which [`Expansion::squared_errors`] were last asked for are those about which this will
    /// be expanded next.
    pub(super) fn take(&mut self, noise: &[f64]) {
        std::mem::swap(&mut self.gradient, &mut self.other);
        self.ready = Some(noise.to_vec());
    }

    /// The sum of squared errors of each output.
    pub(super) fn squared_errors(&mut self, weights: &[f64], noise: &[f64]) -> &[f64] {
        self.pass.run(weights, &inverses(noise), &mut self.other)
    }

    /// Where a step leads from the weights about which this was expanded, and by how much a straight one would
    /// lower the regularised misfit, were it quadratic; `None` where there is no step.
    ///
    /// The step follows the geodesic, to second order: outputs bend as weights move, and half of what undoes
    /// that is added.
    pub(super) fn step(
        &mut self,
        (start, noise): (&[f64], &[f64]),
        decay: &Decay,
        damping: f64,
    ) -> Option<(Vec<f64>, f64)> {
        let held = |index: usize| (1.0 + damping) * decay.of(index);
        let factors = Cholesky::of(self.hessian.clone(), held)?;
        let slopes = self.gradient.iter().zip(start).enumerate();
        let slopes: Vec<f64> = slopes.map(|(i, (g, w))| g + decay.of(i) * w).collect();
        let back = factors.solve(&slopes);
        let promised = back.iter().zip(&slopes).enumerate();
        let promised =
            promised.map(|(i, (by, slope))| by * (damping * decay.of(i) * by + slope)).sum::<f64>();
        self.pass.second_derivative((start, &back), &inverses(noise), &mut self.other);
        let bend = factors.solve(&self.other);
        let share = 0.5 * f64::min(1.0, MOST_BEND / self.half_ratio((&bend, &back), decay));
        let steps = back.iter().zip(&bend).map(|(by, bend)| by + share * bend);
        Some((start.iter().zip(steps).map(|(start, by)| start - by).collect(), 0.5 * promised))
    }

    /// How long half of `one` is, measured by `other`.
    fn half_ratio(&self, (one, other): (&[f64], &[f64]), decay: &Decay) -> f64 {
        let square = |values: &[f64]| -> f64 {
            let each = values.iter().enumerate();
            each.map(|(i, value)| value * value * (decay.of(i) + self.hessian.get(i, i))).sum()
        };
        0.5 * (square(one) / square(other).max(f64::MIN_POSITIVE)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{perceptron::OutputActivation, random::Random};
    use nalgebra::{DMatrix, DVector};

    /// Samples of a curve, and a network that knows nothing of it.
    fn lesson(count: usize) -> (Perceptron, Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let mut random = Random::new(5);
        let samples = (0..count).map(|_| {
            let x = random.uniform(-2.0, 2.0);
            (vec![x], vec![libm::sin(2.0 * x), 0.5 * x])
        });
        let (inputs, targets) = samples.unzip();
        let sizes = [1, 12, 2];
        let network = Perceptron::nguyen_widrow(&sizes, 1.0, OutputActivation::Linear, &mut random);
        (network, inputs, targets)
    }

    #[test]
    fn the_expansion_is_that_of_the_jacobian() {
        let (network, inputs, targets) = lesson(37);
        let (count, noise) = (network.weights().len(), [0.5, 2.0]);
        let batch = Batch::new(&inputs, &targets);
        let mut found = Expansion::new(&network, &batch);
        found.at(network.weights(), &noise);
        let mut hessian = DMatrix::zeros(count, count);
        let mut gradient = DVector::zeros(count);
        let mut rows = vec![0.0; 2 * count];
        for (input, target) in inputs.iter().zip(&targets) {
            let out = network.jacobian(input, &mut rows);
            for output in 0..2 {
                let row = DVector::from_column_slice(&rows[output * count..][..count]);
                hessian += &row * row.transpose() / noise[output];
                gradient += row * ((out[output] - target[output]) / noise[output]);
            }
        }
        let found_gradient = DVector::from_vec(found.gradient);
        let half = DMatrix::from_fn(count, count, |i, j| found.hessian.get(i.max(j), i.min(j)));
        assert!((half - &hessian).norm() < 1e-12 * hessian.norm());
        assert!((found_gradient - &gradient).norm() < 1e-12 * gradient.norm());
    }

    #[test]
    fn a_bent_step_errs_by_the_third_order() {
        let (network, inputs, _) = lesson(5);
        let mut random = Random::new(8);
        let away: Vec<f64> = network.weights().iter().map(|_| random.normal()).collect();
        let noise = [1.0, 1.0];
        let decay = Decay::new(network.sizes(), 1e-16);
        // More weights than errors: a step can undo them all, but for what it overlooks.
        let left = |size: f64| -> f64 {
            let mut other = network.clone();
            let moved = network.weights().iter().zip(&away).map(|(w, by)| w + size * by);
            other.set_weights(&moved.collect::<Vec<f64>>());
            let targets: Vec<Vec<f64>> = inputs.iter().map(|input| other.evaluate(input)).collect();
            let mut expansion = Expansion::new(&network, &Batch::new(&inputs, &targets));
            expansion.at(network.weights(), &noise);
            let (reached, _) = expansion.step((network.weights(), &noise), &decay, 1e6).unwrap();
            expansion.squared_errors(&reached, &noise).iter().sum::<f64>().sqrt()
        };
        let (long, short) = (left(0.08), left(0.04));
        assert!(long > 1e-9 && short < long / 6.0, "{long} {short}: a straight step has a fourth");
    }
}
