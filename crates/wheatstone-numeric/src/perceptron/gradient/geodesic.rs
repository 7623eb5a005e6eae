//! How the outputs bend as the weights move along a line, as a change of the gradient: what a step of a
//! second-order training overlooks.

use super::{DOUBLES, GradientPass, SINGLES, group};
use crate::simd::{Real, Simd, WithSimd, on_widest};

impl<T: Real> GradientPass<T> {
    /// Second derivatives of the outputs as the `weights` move by `direction`, summed over samples and outputs
    /// with the outputs' own derivatives by the weights, each times its `factor`: `gradient`.
    pub fn second_derivative(
        &mut self,
        (weights, direction): (&[f64], &[f64]),
        factors: &[f64],
        gradient: &mut [f64],
    ) {
        self.packed.set(weights);
        self.along.set(direction);
        on_widest(Kernel { pass: self, factors, gradient });
    }
}

/// One pass over all samples.
struct Kernel<'a, T> {
    pass: &'a mut GradientPass<T>,
    factors: &'a [f64],
    gradient: &'a mut [f64],
}

impl<T: Real> WithSimd for Kernel<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Kernel { pass, factors, gradient } = self;
        pass.sums.fill(T::default());
        if group::<T>() == SINGLES {
            pass.second_derivatives_of_all::<S, SINGLES>(simd, factors);
        } else {
            pass.second_derivatives_of_all::<S, DOUBLES>(simd, factors);
        }
        pass.sum_up(gradient);
    }
}

impl<T: Real> GradientPass<T> {
    /// Goes through all samples, `N` at a time.
    #[inline(always)]
    fn second_derivatives_of_all<S: Simd, const N: usize>(&mut self, simd: S, factors: &[f64]) {
        for group in 0..self.present.len().div_ceil(N) {
            let count = N.min(self.present.len() - group * N) / T::width::<S>();
            self.bend_group::<S, N>(simd, (group, count), factors);
            self.add_up::<S, N>(simd, count);
        }
    }

    /// Takes so many registers of a group of samples forward, with their bends, and those backward.
    #[inline(always)]
    fn bend_group<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        (group, count): (usize, usize),
        factors: &[f64],
    ) {
        let (inputs, outputs) = self.packed.ends();
        let units = self.packed.units();
        let activations = &mut self.activations.as_chunks_mut::<N>().0[..units];
        let deltas = &mut self.deltas.as_chunks_mut::<N>().0[..units - inputs];
        let samples = &self.inputs.as_chunks::<N>().0[group * inputs..][..inputs];
        activations[..inputs].copy_from_slice(samples);
        self.packed.forward(simd, activations, count);
        let [slopes, bends] = &mut self.motion;
        let bends = bends.as_chunks_mut::<N>().0;
        let motion = [slopes.as_chunks_mut::<N>().0, &mut *bends];
        self.packed.second_derivative(simd, &self.along, (activations, motion), count);
        let present = T::vectors::<S>(&self.present[group * N..]);
        let (found, bends) = (&activations[units - outputs..], &bends[units - outputs..units]);
        let last = &mut deltas[units - inputs - outputs..];
        for (output, factor) in factors.iter().enumerate().take(outputs) {
            let factor = T::splat(simd, T::nearest(*factor));
            let values = T::vectors::<S>(&found[output]).iter().zip(present);
            let bends = T::vectors::<S>(&bends[output]).iter().zip(values).take(count);
            let deltas = T::vectors_mut::<S>(&mut last[output]).iter_mut();
            for (delta, (bend, (value, present))) in deltas.zip(bends) {
                let bend = T::multiply(simd, T::multiply(simd, *bend, *present), factor);
                *delta = T::multiply(simd, bend, self.packed.output_slope(simd, *value));
            }
        }
        self.packed.backward(simd, activations, deltas, count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        perceptron::{Batch, OutputActivation, Perceptron},
        random::Random,
        simd::on_each,
    };

    #[test]
    fn is_the_second_difference_of_the_outputs_times_their_jacobian() {
        let shapes: [&[usize]; 4] = [&[4, 8, 8, 3], &[6, 13, 3], &[2, 1], &[4, 3, 2, 5, 1]];
        for sizes in shapes {
            for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
                let mut random = Random::new(11);
                let network = Perceptron::nguyen_widrow(sizes, 1.3, output, &mut random);
                let (outputs, count) = (sizes[sizes.len() - 1], network.weights().len());
                let inputs: Vec<Vec<f64>> = (0..143)
                    .map(|_| (0..sizes[0]).map(|_| random.uniform(0.0, 1.0)).collect())
                    .collect();
                let factors: Vec<f64> = (0..outputs).map(|place| 0.5 + place as f64).collect();
                let direction: Vec<f64> = (0..count).map(|_| random.normal()).collect();
                let step = 1e-3;
                let moved = |by: f64| {
                    let mut moved = network.clone();
                    let along = network.weights().iter().zip(&direction);
                    moved.set_weights(&along.map(|(w, d)| w + by * d).collect::<Vec<f64>>());
                    moved
                };
                let (before, after) = (moved(-step), moved(step));
                let (mut wanted, mut rows) = (vec![0.0; count], vec![0.0; outputs * count]);
                for input in &inputs {
                    let here = network.jacobian(input, &mut rows);
                    let (low, high) = (before.evaluate(input), after.evaluate(input));
                    for (place, row) in rows.chunks_exact(count).enumerate() {
                        let bend = (low[place] + high[place] - 2.0 * here[place]) / (step * step);
                        let change = factors[place] * bend;
                        wanted.iter_mut().zip(row).for_each(|(sum, slope)| *sum += change * slope);
                    }
                }
                let batch = Batch::new(&inputs, &vec![vec![0.0; outputs]; inputs.len()]);
                let mut found = vec![0.0; count];
                let mut pass = GradientPass::<f64>::new(&network, &batch);
                pass.second_derivative((network.weights(), &direction), &factors, &mut found);
                let size = wanted.iter().fold(1e-3_f64, |most, value| most.max(value.abs()));
                for (found, wanted) in found.iter().zip(&wanted) {
                    assert!((found - wanted).abs() < 1e-4 * size, "{sizes:?} {output:?}");
                }
            }
        }
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let mut random = Random::new(3);
        let sizes = [4, 8, 8, 3];
        let network = Perceptron::nguyen_widrow(&sizes, 1.0, OutputActivation::Linear, &mut random);
        let rows: Vec<Vec<f64>> =
            (0..143).map(|_| (0..4).map(|_| random.uniform(0.0, 1.0)).collect()).collect();
        let batch = Batch::new(&rows, &vec![vec![0.0; 3]; rows.len()]);
        let mut pass = GradientPass::<f64>::new(&network, &batch);
        pass.packed.set(network.weights());
        pass.along.set(network.weights());
        let mut results = vec![(pass, vec![0.0; 139]); 4];
        let mut next = results.iter_mut();
        let widths = on_each(|| {
            let (pass, gradient) = next.next().unwrap();
            Kernel { pass, factors: &[1.0, 2.0, 0.5], gradient }
        });
        assert!(widths.len() > 1);
        assert!(results[..widths.len()].iter().all(|other| other.1 == results[0].1));
        assert!(results[0].1.iter().any(|slope| *slope != 0.0));
    }
}
