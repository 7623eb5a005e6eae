//! A perceptron's outputs for many samples, in vector registers: column by column in, column by column out.

use super::{Perceptron, packed::Packed};
use crate::numeric::simd::{Real, Simd, WithSimd, on_widest};

/// Numbers in the widest register there is.
const WIDEST: usize = 16;

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
        on_widest(Pass { packed: &self.packed, inputs, outputs, count });
    }
}

/// One run through the columns.
struct Pass<'a, 'b, T> {
    packed: &'a Packed<T>,
    inputs: &'a [&'a [T]],
    outputs: &'a mut [&'b mut [T]],
    count: usize,
}

impl<T: Real> WithSimd for Pass<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Pass { packed, inputs, outputs, count } = self;
        let (first, last) = packed.ends();
        let width = T::width::<S>();
        let mut units = vec![T::splat(simd, T::default()); packed.units()];
        let hidden_end = units.len() - last;
        for start in (0..count).step_by(width) {
            let end = count.min(start + width);
            for (unit, column) in units.iter_mut().take(first).zip(inputs) {
                // The last samples may not fill a register.
                let mut part = [T::default(); WIDEST];
                let whole = if end - start == width {
                    &column[start..end]
                } else {
                    part[..end - start].copy_from_slice(&column[start..end]);
                    &part[..width]
                };
                *unit = T::vectors::<S>(whole)[0];
            }
            packed.forward(simd, &mut units);
            for (unit, column) in units[hidden_end..].iter().zip(&mut *outputs) {
                if end - start == width {
                    T::vectors_mut::<S>(&mut column[start..end])[0] = *unit;
                } else {
                    let mut part = [T::default(); WIDEST];
                    T::vectors_mut::<S>(&mut part)[0] = *unit;
                    column[start..end].copy_from_slice(&part[..end - start]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{perceptron::OutputActivation, random::Random, simd::on_each};

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
        let widths = on_each(|| Pass {
            packed: &forward.packed,
            inputs: &columns,
            outputs: next.next().unwrap(),
            count: inputs[0].len(),
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

    #[test]
    fn columns_that_are_missing_change_nothing() {
        let network = Perceptron::nguyen_widrow(
            &[2, 3, 1],
            1.0,
            OutputActivation::Linear,
            &mut Random::new(1),
        );
        let mut column = [7.0; 4];
        Forward::new(&network).columns(&[&[1.0; 4]], &mut [&mut column]);
        assert_eq!(column, [7.0; 4]);
        Forward::new(&network).columns(&[&[1.0; 4], &[0.5; 3]], &mut [&mut column]);
        assert!(column[2] != 7.0 && column[3] == 7.0);
    }
}
