//! A perceptron's outputs for many samples, in vector registers: column by column in, column by column out.

use super::{Perceptron, packed::Packed};
use crate::simd::{Real, Simd, WithSimd, on_widest};

/// Samples that are read and written at once: a few registers of the widest.
pub const TOGETHER: usize = 64;

/// Where samples come from and outputs go. Kernels are compiled with what is written here, so that memory is
/// read and written while the network computes.
pub trait Samples<T> {
    /// Fills the inputs, one entry each, of the samples from `first` on; what is beyond the last is anything.
    fn read(&self, first: usize, inputs: &mut [[T; TOGETHER]]);

    /// Takes the outputs of as many, one entry each.
    fn write(&mut self, first: usize, outputs: &[[T; TOGETHER]]);
}

/// A network made ready to be evaluated at many samples. [`Perceptron::evaluate`] is the reference.
#[derive(Clone, Debug)]
pub struct Forward<T> {
    packed: Packed<T>,
}

impl<T: Real> Forward<T> {
    /// Takes the network's weights over.
    #[must_use]
    pub fn new(network: &Perceptron) -> Self {
        let mut packed = Packed::new(network);
        packed.set(&network.weights);
        Self { packed }
    }

    /// Evaluates the network: `inputs` holds one column of samples an input, `outputs` gets one an output,
    /// as far as all are long. Nothing is done where columns are missing.
    ///
    /// Every sample's bits depend on itself alone, not on its place nor on the processor.
    pub fn columns(&self, inputs: &[&[T]], outputs: &mut [&mut [T]]) {
        let (first, last) = self.packed.ends();
        if inputs.len() < first || outputs.len() < last {
            return;
        }
        let lengths = inputs.iter().map(|column| column.len());
        let count = lengths.chain(outputs.iter().map(|column| column.len())).min().unwrap_or(0);
        self.samples(count, Columns { inputs, outputs, count });
    }

    /// Evaluates the network at so many samples.
    pub fn samples(&self, count: usize, samples: impl Samples<T>) {
        on_widest(Pass { packed: &self.packed, samples, count });
    }
}

/// Samples that are there already.
struct Columns<'a, 'b, T> {
    inputs: &'a [&'a [T]],
    outputs: &'a mut [&'b mut [T]],
    count: usize,
}

impl<T: Real> Samples<T> for Columns<'_, '_, T> {
    #[inline(always)]
    fn read(&self, first: usize, inputs: &mut [[T; TOGETHER]]) {
        let last = self.count.min(first + TOGETHER);
        for (input, column) in inputs.iter_mut().zip(self.inputs) {
            input[..last - first].copy_from_slice(&column[first..last]);
        }
    }

    #[inline(always)]
    fn write(&mut self, first: usize, outputs: &[[T; TOGETHER]]) {
        let last = self.count.min(first + TOGETHER);
        for (output, column) in outputs.iter().zip(&mut *self.outputs) {
            column[first..last].copy_from_slice(&output[..last - first]);
        }
    }
}

/// One run through samples.
struct Pass<'a, T, K> {
    packed: &'a Packed<T>,
    samples: K,
    count: usize,
}

impl<T: Real, K: Samples<T>> WithSimd for Pass<'_, T, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Pass { packed, mut samples, count } = self;
        let (first, last) = packed.ends();
        let mut units = vec![[T::default(); TOGETHER]; packed.units()];
        let outputs = units.len() - last;
        for start in (0..count).step_by(TOGETHER) {
            samples.read(start, &mut units[..first]);
            let left = TOGETHER.min(count - start).div_ceil(T::width::<S>());
            packed.forward(simd, &mut units, left);
            samples.write(start, &units[outputs..]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{perceptron::OutputActivation, random::Random, simd::on_each};

    fn outputs_at_each_width<T: Real>(
        network: &Perceptron,
        inputs: &[Vec<f64>],
    ) -> Vec<Vec<Vec<T>>> {
        let columns: Vec<Vec<T>> = inputs
            .iter()
            .map(|column| column.iter().map(|value| T::nearest(*value)).collect())
            .collect();
        let columns: Vec<&[T]> = columns.iter().map(Vec::as_slice).collect();
        let forward = Forward::<T>::new(network);
        let mut results = vec![vec![vec![T::default(); inputs[0].len()]; 3]; 5];
        let (whole, rest) = results.split_first_mut().unwrap();
        let mut whole: Vec<&mut [T]> = whole.iter_mut().map(Vec::as_mut_slice).collect();
        forward.columns(&columns, &mut whole);
        let mut slots: Vec<Vec<&mut [T]>> = rest
            .iter_mut()
            .map(|result| result.iter_mut().map(Vec::as_mut_slice).collect())
            .collect();
        let mut next = slots.iter_mut();
        let count = inputs[0].len();
        let widths = on_each(|| Pass {
            packed: &forward.packed,
            samples: Columns { inputs: &columns, outputs: next.next().unwrap(), count },
            count,
        });
        results.truncate(1 + widths.len());
        results
    }

    #[test]
    fn is_the_reference_at_every_width_and_every_place() {
        for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
            let mut random = Random::new(4);
            let network = Perceptron::nguyen_widrow(&[4, 8, 8, 3], 1.1, output, &mut random);
            // The last register is not full at any width.
            let inputs: Vec<Vec<f64>> =
                (0..4).map(|_| (0..101).map(|_| random.uniform(0.0, 1.0)).collect()).collect();
            let doubles = outputs_at_each_width::<f64>(&network, &inputs);
            assert!(doubles.iter().all(|other| *other == doubles[0]));
            let singles = outputs_at_each_width::<f32>(&network, &inputs);
            assert!(singles.iter().all(|other| *other == singles[0]));
            for sample in 0..101 {
                let input: Vec<f64> = inputs.iter().map(|column| column[sample]).collect();
                for (output, wanted) in network.evaluate(&input).into_iter().enumerate() {
                    assert!((doubles[0][output][sample] - wanted).abs() < 1e-14);
                    // Singles of inputs and weights, and the sigmoid's stated error.
                    assert!((f64::from(singles[0][output][sample]) - wanted).abs() < 5e-6);
                }
            }
        }
    }
}
