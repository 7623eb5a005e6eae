//! Error and gradient of a perceptron over a batch, in vector registers: what training does all day.
//!
//! [`Perceptron::mean_square_error`] is the plain reference. Every sample keeps the lane it has there,
//! so that sums are the same whatever the registers' width.

use super::{Batch, LANES, Perceptron, packed::Packed};
use crate::numeric::simd::{Real, Simd, WithSimd, on_widest};

/// Blocks of [`LANES`] samples that go forward and backward before their derivatives are added up: what
/// they leave behind must stay in the nearest cache.
const BLOCKS: usize = 8;

/// Samples laid out, and every buffer: nothing is allocated from one pass to the next.
#[derive(Clone, Debug)]
pub struct Sweep<T> {
    packed: Packed<T>,
    /// Block by block, input by input, [`LANES`] samples.
    inputs: Vec<T>,
    /// Block by block, output by output.
    targets: Vec<T>,
    /// Block by block: 1 for a sample, 0 for padding.
    present: Vec<T>,
    activations: Vec<T>,
    deltas: Vec<T>,
    /// Weight by weight, sums over each lane's samples of the gradient.
    sums: Vec<T>,
    squares: Vec<T>,
    totals: Vec<f64>,
}

impl<T: Real> Sweep<T> {
    /// Lays out samples for a network of this shape.
    #[must_use]
    pub fn new(network: &Perceptron, batch: &Batch) -> Self {
        let packed = Packed::new(network);
        let (inputs, outputs) = packed.ends();
        let nearest = |lanes: &[super::Lane]| {
            lanes.as_flattened().iter().map(|value| T::nearest(*value)).collect()
        };
        let zeros = |count: usize| vec![T::default(); count * LANES];
        Self {
            inputs: nearest(&batch.inputs),
            targets: nearest(&batch.targets),
            present: batch.present(),
            activations: zeros(BLOCKS * packed.units()),
            deltas: zeros(BLOCKS * (packed.units() - inputs)),
            sums: zeros(network.weights.len()),
            squares: zeros(outputs),
            totals: vec![0.0; outputs],
            packed,
        }
    }

    /// The sum of squared errors of each output with these weights; `gradient` gets the derivatives by
    /// the weights of half their sum, each times its `factor`.
    pub fn pass(&mut self, weights: &[f64], factors: &[f64], gradient: &mut [f64]) -> &[f64] {
        self.packed.set(weights);
        on_widest(Pass { sweep: self, factors, gradient });
        &self.totals
    }
}

/// One pass over all samples.
struct Pass<'a, T> {
    sweep: &'a mut Sweep<T>,
    factors: &'a [f64],
    gradient: &'a mut [f64],
}

impl<T: Real> WithSimd for Pass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Pass { sweep, factors, gradient } = self;
        sweep.sums.fill(T::default());
        sweep.squares.fill(T::default());
        let blocks = sweep.present.len() / LANES;
        for first in (0..blocks).step_by(BLOCKS) {
            let last = blocks.min(first + BLOCKS);
            sweep.both_ways(simd, first..last, factors);
            sweep.add_up(simd, last - first);
        }
        for (total, squares) in sweep.totals.iter_mut().zip(sweep.squares.as_chunks().0) {
            *total = sum_of_lanes(squares);
        }
        for (slope, sums) in gradient.iter_mut().zip(sweep.sums.as_chunks().0) {
            *slope = sum_of_lanes(sums);
        }
    }
}

/// The sum over the lanes, in one order.
#[inline(always)]
fn sum_of_lanes<T: Real>(lanes: &[T; LANES]) -> f64 {
    let eight: [f64; 8] = std::array::from_fn(|l| lanes[l].double() + lanes[l + 8].double());
    let four: [f64; 4] = std::array::from_fn(|lane| eight[lane] + eight[lane + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

impl<T: Real> Sweep<T> {
    /// Takes blocks forward and backward, register by register.
    #[inline(always)]
    fn both_ways<S: Simd>(&mut self, simd: S, blocks: std::ops::Range<usize>, factors: &[f64]) {
        let (inputs, outputs) = self.packed.ends();
        let units = self.packed.units();
        let hidden_and_out = units - inputs;
        let registers = LANES / T::width::<S>();
        let samples = T::vectors::<S>(&self.inputs);
        let targets = T::vectors::<S>(&self.targets);
        let present = T::vectors::<S>(&self.present);
        let squares = T::vectors_mut::<S>(&mut self.squares);
        let all_activations = T::vectors_mut::<S>(&mut self.activations).chunks_exact_mut(units);
        let all_deltas = T::vectors_mut::<S>(&mut self.deltas).chunks_exact_mut(hidden_and_out);
        let places = blocks.start * registers..blocks.end * registers;
        for ((place, activations), deltas) in places.zip(all_activations).zip(all_deltas) {
            let (block, register) = (place / registers, place % registers);
            for (input, value) in activations.iter_mut().take(inputs).enumerate() {
                *value = samples[(block * inputs + input) * registers + register];
            }
            self.packed.forward(simd, activations);
            let found = activations[units - outputs..].iter().zip(factors);
            let last = deltas[hidden_and_out - outputs..].iter_mut();
            for (output, ((value, factor), delta)) in found.zip(last).enumerate() {
                let wanted = targets[(block * outputs + output) * registers + register];
                let error = T::subtract(simd, *value, wanted);
                let error = T::multiply(simd, error, present[place]);
                let sum = &mut squares[output * registers + register];
                *sum = T::add(simd, *sum, T::multiply(simd, error, error));
                let error = T::multiply(simd, error, T::splat(simd, T::nearest(*factor)));
                *delta = T::multiply(simd, error, self.packed.output_slope(simd, *value));
            }
            self.packed.backward(simd, activations, deltas);
        }
    }

    /// Adds the products of derivatives and activations of so many blocks to the gradient's sums.
    #[inline(always)]
    fn add_up<S: Simd>(&mut self, simd: S, blocks: usize) {
        let units = self.packed.units();
        let hidden_and_out = units - self.packed.sizes[0];
        let registers = LANES / T::width::<S>();
        let activations = T::vectors::<S>(&self.activations);
        let deltas = T::vectors::<S>(&self.deltas);
        let sums = T::vectors_mut::<S>(&mut self.sums);
        for register in 0..registers {
            let samples = Products::<T, S> {
                simd,
                deltas: &deltas[register * hidden_and_out..blocks * registers * hidden_and_out],
                activations: &activations[register * units..blocks * registers * units],
                strides: (registers * hidden_and_out, registers * units),
                registers,
            };
            let (mut start, mut below_start, mut here_start) = (0, 0, 0);
            for pair in self.packed.sizes.windows(2) {
                let (below, here) = (pair[0], pair[1]);
                let sums = &mut sums[start * registers + register..];
                samples.layer(sums, (here_start, below_start), (here, below));
                samples.biases(&mut sums[below * here * registers..], (here_start, here));
                start += (below + 1) * here;
                below_start += below;
                here_start += here;
            }
        }
    }
}

/// What one register's samples left behind: every block's deltas and activations, a stride apart.
struct Products<'a, T: Real, S: Simd> {
    simd: S,
    deltas: &'a [T::Vector<S>],
    activations: &'a [T::Vector<S>],
    strides: (usize, usize),
    /// How far apart the sums of two weights are.
    registers: usize,
}

impl<T: Real, S: Simd> Products<'_, T, S> {
    /// One layer's weights: `(here, below)` sums.
    #[inline(always)]
    fn layer(
        &self,
        sums: &mut [T::Vector<S>],
        (here_start, below_start): (usize, usize),
        (here, below): (usize, usize),
    ) {
        let mut unit = 0;
        while unit < here {
            let tall = if here - unit >= 4 { 4 } else { 1 };
            let mut input = 0;
            while input < below {
                let wide = if below - input >= 2 { 2 } else { 1 };
                let sums = &mut sums[(unit * below + input) * self.registers..];
                let from = (here_start + unit, below_start + input);
                match (tall, wide) {
                    (4, 2) => self.tile::<4, 2>(sums, below, from),
                    (4, _) => self.tile::<4, 1>(sums, below, from),
                    (_, 2) => self.tile::<1, 2>(sums, below, from),
                    _ => self.tile::<1, 1>(sums, below, from),
                }
                input += wide;
            }
            unit += tall;
        }
    }

    /// Sums of `TALL` units' deltas times `WIDE` activations, kept in registers.
    #[inline(always)]
    fn tile<const TALL: usize, const WIDE: usize>(
        &self,
        rows: &mut [T::Vector<S>],
        below: usize,
        (unit, input): (usize, usize),
    ) {
        let simd = self.simd;
        let place = |row: usize, column: usize| (row * below + column) * self.registers;
        let mut sums: [[T::Vector<S>; WIDE]; TALL] =
            std::array::from_fn(|r| std::array::from_fn(|c| rows[place(r, c)]));
        let deltas = self.deltas.chunks(self.strides.0);
        for (deltas, activations) in deltas.zip(self.activations.chunks(self.strides.1)) {
            let Some(deltas) = deltas[unit..].first_chunk::<TALL>() else { return };
            let Some(activations) = activations[input..].first_chunk::<WIDE>() else { return };
            for (sums, delta) in sums.iter_mut().zip(deltas) {
                for (sum, activation) in sums.iter_mut().zip(activations) {
                    *sum = T::add(simd, *sum, T::multiply(simd, *delta, *activation));
                }
            }
        }
        for (r, sums) in sums.into_iter().enumerate() {
            for (c, sum) in sums.into_iter().enumerate() {
                rows[place(r, c)] = sum;
            }
        }
    }

    /// One layer's biases.
    #[inline(always)]
    fn biases(&self, sums: &mut [T::Vector<S>], (start, here): (usize, usize)) {
        for unit in 0..here {
            let mut total = sums[unit * self.registers];
            for deltas in self.deltas.chunks(self.strides.0) {
                total = T::add(self.simd, total, deltas[start + unit]);
            }
            sums[unit * self.registers] = total;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{
        perceptron::{OutputActivation, Workspace},
        random::Random,
        simd::on_each,
    };

    fn world(sizes: &[usize], output: OutputActivation) -> (Perceptron, Batch) {
        let mut random = Random::new(7);
        let network = Perceptron::nguyen_widrow(sizes, 1.3, output, &mut random);
        let mut rows = |width: usize| -> Vec<Vec<f64>> {
            // Nine blocks, the last of them padded.
            (0..143).map(|_| (0..width).map(|_| random.uniform(0.0, 1.0)).collect()).collect()
        };
        let (inputs, targets) = (rows(sizes[0]), rows(sizes[sizes.len() - 1]));
        (network, Batch::new(&inputs, &targets))
    }

    /// Greatest difference from the plain reference, over the gradient's greatest entry.
    fn difference<T: Real>(sizes: &[usize], output: OutputActivation) -> f64 {
        let (network, batch) = world(sizes, output);
        let mut wanted = vec![0.0; network.weights().len()];
        let error = network.mean_square_error(&batch, &mut wanted, &mut Workspace::new(sizes));
        let outputs = sizes[sizes.len() - 1];
        let count = (143 * outputs) as f64;
        let mut sweep = Sweep::<T>::new(&network, &batch);
        let mut found = wanted.clone();
        let totals = sweep.pass(network.weights(), &vec![2.0 / count; outputs], &mut found);
        let total = totals.iter().sum::<f64>() / count;
        let greatest = wanted.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
        let gaps = wanted.iter().zip(&found).map(|(a, b)| (a - b).abs() / greatest);
        gaps.fold((total / error - 1.0).abs(), f64::max)
    }

    #[test]
    fn agrees_with_the_plain_reference_for_every_shape() {
        let shapes: [&[usize]; 5] =
            [&[4, 8, 8, 3], &[6, 13, 3], &[2, 1], &[4, 3, 2, 5, 1], &[1, 9, 2]];
        for sizes in shapes {
            for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
                let double = difference::<f64>(sizes, output);
                assert!(double < 1e-14, "{sizes:?} {output:?}: {double}");
                // Singles have 24 bits; sums of 143 samples lose a few of them.
                let single = difference::<f32>(sizes, output);
                assert!(single < 1e-5, "{sizes:?} {output:?}: {single}");
            }
        }
    }

    fn bits_at_each_width<T: Real>() -> Vec<(Vec<f64>, Vec<f64>)> {
        let (network, batch) = world(&[4, 8, 8, 3], OutputActivation::Linear);
        let mut sweep = Sweep::<T>::new(&network, &batch);
        sweep.packed.set(network.weights());
        let mut results = vec![(sweep, vec![0.0; 139]); 4];
        let mut next = results.iter_mut();
        let widths = on_each(|| {
            let (sweep, gradient) = next.next().unwrap();
            Pass { sweep, factors: &[1.0, 2.0, 0.5], gradient }
        });
        let used = results.into_iter().take(widths.len());
        used.map(|(sweep, gradient)| (sweep.totals, gradient)).collect()
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        for results in [bits_at_each_width::<f64>(), bits_at_each_width::<f32>()] {
            assert!(results.len() > 1);
            assert!(results.iter().all(|other| *other == results[0]));
        }
    }
}
