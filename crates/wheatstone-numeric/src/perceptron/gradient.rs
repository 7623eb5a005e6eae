//! Error and gradient of a perceptron over a batch, in vector registers: what training does all day.
//!
//! [`Perceptron::mean_square_error`] is the plain reference. Every sample keeps the lane it has there,
//! so that sums are the same whatever the registers' width.

mod geodesic;
mod products;

use super::{Batch, LANES, Perceptron, packed::Packed};
use crate::{
    aligned::AlignedVec,
    simd::{Real, Simd, WithSimd, on_widest},
};
use products::Products;

/// Bytes of a unit's samples that go forward and backward before their derivatives are added up: what they
/// leave behind of the paper's network stays in the nearest cache.
const GROUP: usize = 640;
const SINGLES: usize = GROUP / size_of::<f32>();
const DOUBLES: usize = GROUP / size_of::<f64>();

/// Samples laid out, and every buffer: nothing is allocated from one pass to the next.
#[derive(Clone, Debug)]
pub struct GradientPass<T> {
    packed: Packed<T>,
    /// Group by group, input by input.
    inputs: AlignedVec<T>,
    /// Group by group, output by output.
    targets: AlignedVec<T>,
    /// 1 for a sample, 0 for padding of the last [`LANES`].
    present: AlignedVec<T>,
    /// Unit by unit, the samples of a group.
    activations: AlignedVec<T>,
    /// As the activations, without inputs.
    deltas: AlignedVec<T>,
    /// How the weights move where the outputs' bends are asked for.
    along: Packed<T>,
    /// As the activations: their first and second derivatives by that motion.
    motion: [AlignedVec<T>; 2],
    /// Weight by weight, sums over each lane's samples of the gradient.
    sums: AlignedVec<T>,
    squares: AlignedVec<T>,
    totals: Vec<f64>,
}

impl<T: Real> GradientPass<T> {
    /// Lays out samples for a network of this shape.
    #[must_use]
    pub fn new(network: &Perceptron, batch: &Batch) -> Self {
        let packed = Packed::new(network);
        let (inputs, outputs) = packed.ends();
        let [given, targets] = batch.groups(group::<T>());
        let zeros = |count: usize| AlignedVec::zeros(count * LANES);
        let units = |count: usize| AlignedVec::zeros(count * group::<T>());
        Self {
            inputs: AlignedVec::of(&given),
            targets: AlignedVec::of(&targets),
            present: AlignedVec::of(&batch.present()),
            activations: units(packed.units()),
            deltas: units(packed.units() - inputs),
            along: packed.clone(),
            motion: [(); 2].map(|()| units(packed.units())),
            sums: zeros(network.weights.len()),
            squares: zeros(outputs),
            totals: vec![0.0; outputs],
            packed,
        }
    }

    /// The sum of squared errors of each output with these weights; `gradient` gets the derivatives by
    /// the weights of half their sum, each times its `factor`.
    pub fn run(&mut self, weights: &[f64], factors: &[f64], gradient: &mut [f64]) -> &[f64] {
        self.packed.set(weights);
        on_widest(Kernel { pass: self, factors, gradient });
        &self.totals
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
        pass.squares.fill(T::default());
        if group::<T>() == SINGLES {
            pass.add_all::<S, SINGLES>(simd, factors);
        } else {
            pass.add_all::<S, DOUBLES>(simd, factors);
        }
        for (total, squares) in pass.totals.iter_mut().zip(pass.squares.as_chunks().0) {
            *total = sum_of_lanes(squares);
        }
        pass.sum_up(gradient);
    }
}

/// Samples of a group.
fn group<T>() -> usize {
    GROUP / size_of::<T>()
}

/// The sum over the lanes, in one order.
///
/// Never inlined: compilers would take eight weights at once and gather their lanes, which is slower.
#[inline(never)]
fn sum_of_lanes<T: Real>(lanes: &[T; LANES]) -> f64 {
    let (mut eight, mut four) = ([T::default(); 8], [0.0; 4]);
    for (lane, sum) in eight.iter_mut().enumerate() {
        *sum = lanes[lane].plus(lanes[lane + 8]);
    }
    for (lane, sum) in four.iter_mut().enumerate() {
        *sum = eight[lane].plus(eight[lane + 4]).double();
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

impl<T: Real> GradientPass<T> {
    /// Goes through all samples, `N` at a time.
    #[inline(always)]
    fn add_all<S: Simd, const N: usize>(&mut self, simd: S, factors: &[f64]) {
        for group in 0..self.present.len().div_ceil(N) {
            let count = N.min(self.present.len() - group * N) / T::width::<S>();
            self.both_ways::<S, N>(simd, (group, count), factors);
            self.add_up::<S, N>(simd, count);
        }
    }

    /// The gradient from its sums of lanes.
    fn sum_up(&self, gradient: &mut [f64]) {
        for (slope, sums) in gradient.iter_mut().zip(self.sums.as_chunks().0) {
            *slope = sum_of_lanes(sums);
        }
    }

    /// Takes so many registers of a group of samples forward and backward.
    #[inline(always)]
    fn both_ways<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        (group, count): (usize, usize),
        factors: &[f64],
    ) {
        let (inputs, outputs) = self.packed.ends();
        let registers = LANES / T::width::<S>();
        let units = self.packed.units();
        let activations = &mut self.activations.as_chunks_mut::<N>().0[..units];
        let deltas = &mut self.deltas.as_chunks_mut::<N>().0[..units - inputs];
        let samples = &self.inputs.as_chunks::<N>().0[group * inputs..][..inputs];
        activations[..inputs].copy_from_slice(samples);
        self.packed.forward(simd, activations, count);
        let present = T::vectors::<S>(&self.present[group * N..]);
        let squares = T::vectors_mut::<S>(&mut self.squares);
        let found = &activations[units - outputs..];
        let last = &mut deltas[units - inputs - outputs..];
        let targets = &self.targets.as_chunks::<N>().0[group * outputs..];
        for (output, factor) in factors.iter().enumerate().take(outputs) {
            let factor = T::splat(simd, T::nearest(*factor));
            let squares = &mut squares[output * registers..][..registers];
            let wanted = T::vectors::<S>(&targets[output]).iter().zip(present);
            let found = T::vectors::<S>(&found[output]).iter().zip(wanted);
            let deltas = T::vectors_mut::<S>(&mut last[output]).iter_mut();
            for (slot, (delta, (value, (wanted, present)))) in
                deltas.zip(found).enumerate().take(count)
            {
                let error = T::subtract(simd, *value, *wanted);
                let error = T::multiply(simd, error, *present);
                let sum = &mut squares[slot % registers];
                *sum = T::add_product(simd, *sum, error, error);
                let error = T::multiply(simd, error, factor);
                *delta = T::multiply(simd, error, self.packed.output_slope(simd, *value));
            }
        }
        self.packed.backward(simd, activations, deltas, count);
    }

    /// Adds the products of derivatives and activations of a group of so many registers to the gradient's
    /// sums.
    #[inline(always)]
    fn add_up<S: Simd, const N: usize>(&mut self, simd: S, count: usize) {
        let registers = LANES / T::width::<S>();
        let activations = self.activations.as_chunks::<N>().0;
        let deltas = self.deltas.as_chunks::<N>().0;
        let sums = T::vectors_mut::<S>(&mut self.sums);
        for register in 0..registers {
            let samples =
                Products::<T, S, N> { simd, deltas, activations, register, registers, count };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
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
        let mut pass = GradientPass::<T>::new(&network, &batch);
        let mut found = wanted.clone();
        let totals = pass.run(network.weights(), &vec![2.0 / count; outputs], &mut found);
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
        let mut pass = GradientPass::<T>::new(&network, &batch);
        pass.packed.set(network.weights());
        let mut results = vec![(pass, vec![0.0; 139]); 4];
        let mut next = results.iter_mut();
        let widths = on_each(|| {
            let (pass, gradient) = next.next().unwrap();
            Kernel { pass, factors: &[1.0, 2.0, 0.5], gradient }
        });
        let used = results.into_iter().take(widths.len());
        used.map(|(pass, gradient)| (pass.totals, gradient)).collect()
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        for results in [bits_at_each_width::<f64>(), bits_at_each_width::<f32>()] {
            assert!(results.len() > 1);
            assert!(results.iter().all(|other| *other == results[0]));
        }
    }
}
