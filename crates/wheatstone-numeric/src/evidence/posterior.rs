//! What the data say of a network's weights, in Laplace's approximation, and what follows for decay
//! and noise.

use crate::{
    cholesky::{Cholesky, Lower},
    covariance::UNKNOWN,
};

/// One decay a class of weights: a layer's weights, and its biases.
pub(super) struct Decay {
    /// The class of each weight.
    class: Vec<usize>,
    /// The decay of each class.
    rate: Vec<f64>,
}

impl Decay {
    pub(super) fn new(sizes: &[usize], rate: f64) -> Self {
        let mut class = Vec::new();
        for (layer, pair) in sizes.windows(2).enumerate() {
            class.extend(std::iter::repeat_n(2 * layer, pair[0] * pair[1]));
            class.extend(std::iter::repeat_n(2 * layer + 1, pair[1]));
        }
        Self { rate: vec![rate; 2 * (sizes.len() - 1)], class }
    }

    pub(super) fn of(&self, weight: usize) -> f64 {
        self.rate[self.class[weight]]
    }

    pub(super) fn penalty(&self, weights: &[f64]) -> f64 {
        0.5 * weights.iter().enumerate().map(|(i, w)| self.of(i) * w * w).sum::<f64>()
    }
}

pub(super) fn misfit(squares: &[f64], noise: &[f64]) -> f64 {
    0.5 * squares.iter().zip(noise).map(|(sum, variance)| sum / variance).sum::<f64>()
}

/// The curvatures of the regularised misfit, factored; a share of [`UNKNOWN`] of them is added where rounding has made
/// their matrix singular.
pub(super) fn factors(hessian: &Lower, decay: &Decay) -> Option<Cholesky> {
    let exact = Cholesky::of(hessian.clone(), |index| decay.of(index));
    let more = |index: usize| decay.of(index) + UNKNOWN * hessian.get(index, index);
    exact.or_else(|| Cholesky::of(hessian.clone(), more))
}

/// What the data say of the weights, in Laplace's approximation.
pub(super) struct Posterior {
    log_determinant: f64,
    /// Weights that the data determine, in all and class by class.
    pub(super) effective: f64,
    effective_of_class: Vec<f64>,
}

impl Posterior {
    pub(super) fn new(hessian: &Lower, decay: &Decay) -> Option<Self> {
        let factors = factors(hessian, decay)?;
        let log_determinant = factors.log_determinant();
        let variances = factors.diagonal_of_inverse();
        let mut effective_of_class = vec![0.0; decay.rate.len()];
        for (index, variance) in variances.into_iter().enumerate() {
            effective_of_class[decay.class[index]] += 1.0 - decay.of(index) * variance;
        }
        let effective = effective_of_class.iter().sum();
        Some(Self { log_determinant, effective, effective_of_class })
    }

    pub(super) fn log_evidence(
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
    pub(super) fn update(
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
