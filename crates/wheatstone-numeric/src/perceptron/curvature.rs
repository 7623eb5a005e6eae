//! The normal matrix of a perceptron's second-order training, in vector registers.
//!
//! A weight's derivative is the delta d of the unit it leads to times the activation a that it is
//! multiplied by. An entry of J'J between two layers is therefore a sum over samples of
//! (sum over outputs of d d') (a a'): the products of all pairs of deltas, as a matrix, times those of all
//! pairs of activations. That is a quarter of the arithmetic that J'J takes row by row, and one matrix product
//! for each pair of layers. Within a layer, pairs count once.

mod pairs;
mod product;

use super::{Batch, LANES, Perceptron, packed::Packed};
use crate::{
    aligned::AlignedVec,
    cholesky::Lower,
    simd::{Real, Simd, WithSimd, on_widest},
};
use pairs::{Factor, Layer, Pair};
use product::{SAMPLES, STRIDE, STRIP, add_matrix_product};

/// Registers of samples that are multiplied together: [`SAMPLES`] are a multiple of so many at any width.
const TOGETHER: usize = 5;

/// Samples laid out, and every buffer: nothing is allocated from one pass to the next.
#[derive(Clone, Debug)]
pub struct Curvature {
    packed: Packed<f64>,
    layers: Vec<Layer>,
    inputs: AlignedVec<f64>,
    present: AlignedVec<f64>,
    /// Unit by unit, [`SAMPLES`] each, as the two passes leave them.
    activations: AlignedVec<f64>,
    /// Output by output, unit by unit.
    deltas: AlignedVec<f64>,
    /// Layer by layer, sample by sample, twice, and then the 1 that the biases are multiplied by.
    rows: Vec<AlignedVec<f64>>,
    /// Products of deltas: pair by pair, sample by sample.
    left: AlignedVec<f64>,
    /// A strip of the products of activations: sample by sample, pair by pair.
    right: AlignedVec<f64>,
    pairs: Vec<Pair>,
}

impl Curvature {
    /// Lays out samples for a network of this shape.
    #[must_use]
    pub fn new(network: &Perceptron, batch: &Batch) -> Self {
        let packed = Packed::new(network);
        let (inputs, outputs) = packed.ends();
        let layers = Layer::of(&packed.sizes);
        let mut pairs = Vec::new();
        for first in 0..layers.len() {
            pairs.extend((first..layers.len()).map(|second| Pair::new(&layers, (first, second))));
        }
        let tallest = pairs.iter().map(|pair| pair.sums.len() / pair.width).max().unwrap_or(0);
        let row = |layer: &Layer| AlignedVec::of(&vec![1.0; layer.row() * SAMPLES]);
        Self {
            inputs: AlignedVec::of(batch.inputs.as_flattened()),
            present: AlignedVec::of(&batch.present()),
            activations: AlignedVec::zeros(packed.units() * SAMPLES),
            deltas: AlignedVec::zeros((packed.units() - inputs) * outputs * SAMPLES),
            rows: layers.iter().map(row).collect(),
            left: AlignedVec::zeros(tallest * SAMPLES),
            right: AlignedVec::zeros(STRIDE * SAMPLES),
            pairs,
            layers,
            packed,
        }
    }

    /// Half the Hessian, by outer products, of the sum of squared errors, each over its output's
    /// variance.
    pub fn hessian(&mut self, weights: &[f64], variances: &[f64], hessian: &mut Lower) {
        self.packed.set(weights);
        on_widest(Pass { curvature: self, variances });
        for pair in &self.pairs {
            pair.write_out(hessian);
        }
    }
}

/// Adds up the products over all samples.
struct Pass<'a> {
    curvature: &'a mut Curvature,
    variances: &'a [f64],
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Pass { curvature, variances } = self;
        for pair in &mut curvature.pairs {
            pair.sums.fill(0.0);
        }
        let count = curvature.present.len();
        for first in (0..count).step_by(SAMPLES) {
            let samples = SAMPLES.min(count - first);
            curvature.both_ways(simd, (first, samples), variances);
            curvature.turn(samples);
            for index in 0..curvature.pairs.len() {
                curvature.multiply_deltas(simd, samples, index);
                for first in (0..curvature.pairs[index].width).step_by(STRIP) {
                    curvature.multiply_activations(simd, (index, first));
                    let Curvature { left, right, pairs, .. } = curvature;
                    let right = &right[..samples * STRIDE];
                    add_matrix_product(simd, (left, right), &mut pairs[index], first);
                }
            }
        }
    }
}

impl Curvature {
    /// Takes samples forward, and backward from every output, over its deviation.
    #[inline(always)]
    fn both_ways<S: Simd>(&mut self, simd: S, (first, samples): (usize, usize), variances: &[f64]) {
        let (inputs, outputs) = self.packed.ends();
        let units = self.packed.units();
        let upper = units - inputs;
        let width = f64::width::<S>();
        let registers = LANES / width;
        let given = f64::vectors::<S>(&self.inputs);
        let present = f64::vectors::<S>(&self.present);
        let (first, count) = (first / width, samples / width);
        let place = |slot: usize, input: usize| {
            let (block, register) = ((first + slot) / registers, (first + slot) % registers);
            (block * inputs + input) * registers + register
        };
        let activations = self.activations.as_chunks_mut().0;
        for (input, unit) in activations.iter_mut().take(inputs).enumerate() {
            for (slot, value) in f64::vectors_mut::<S>(unit).iter_mut().take(count).enumerate() {
                *value = given[place(slot, input)];
            }
        }
        self.packed.forward(simd, activations, count);
        let deltas = self.deltas.as_chunks_mut::<SAMPLES>().0;
        for (output, deltas) in deltas.chunks_exact_mut(upper).enumerate() {
            let last = &mut deltas[upper - outputs..];
            last.fill([0.0; SAMPLES]);
            let weight = simd.splat_f64s(1.0 / variances[output].sqrt());
            let values = f64::vectors::<S>(&activations[units - outputs + output]);
            let slopes = f64::vectors_mut::<S>(&mut last[output]).iter_mut().zip(values);
            for ((slope, value), present) in slopes.zip(&present[first..]).take(count) {
                let own = self.packed.output_slope(simd, *value);
                *slope = simd.mul_f64s(simd.mul_f64s(own, weight), *present);
            }
            self.packed.backward(simd, activations, deltas, count);
        }
    }

    /// Lays the activations out sample by sample.
    #[inline(always)]
    fn turn(&mut self, samples: usize) {
        let activations = self.activations.as_chunks::<SAMPLES>().0;
        for (layer, rows) in self.layers.iter().zip(&mut self.rows) {
            let below = &activations[layer.first_below..][..layer.below];
            for (place, unit) in below.iter().enumerate() {
                let rows = rows.chunks_exact_mut(layer.row());
                for (row, value) in rows.zip(unit).take(samples) {
                    row[place] = *value;
                    row[layer.below + place] = *value;
                }
            }
        }
    }

    /// The left factor of a pair of layers.
    #[inline(always)]
    fn multiply_deltas<S: Simd>(&mut self, simd: S, samples: usize, pair: usize) {
        let (inputs, outputs) = self.packed.ends();
        let upper = self.packed.units() - inputs;
        let width = f64::width::<S>();
        let Pair { layers: (first, second), units, .. } = &self.pairs[pair];
        let (a, b) = (self.layers[*first], self.layers[*second]);
        let is_last = second + 1 == self.layers.len();
        let left = f64::vectors_mut::<S>(&mut self.left).chunks_exact_mut(SAMPLES / width);
        let deltas = self.deltas.as_chunks::<SAMPLES>().0;
        for (row, (one, other)) in left.zip(units) {
            let asked = if is_last { *other..other + 1 } else { 0..outputs };
            let deltas = &deltas[asked.start * upper..asked.end * upper];
            for slot in
                (0..SAMPLES / width).step_by(TOGETHER).take_while(|slot| slot * width < samples)
            {
                let mut products = [simd.splat_f64s(0.0); TOGETHER];
                for deltas in deltas.chunks_exact(upper) {
                    let of = &f64::vectors::<S>(&deltas[a.first_here + one])[slot..slot + TOGETHER];
                    let by =
                        &f64::vectors::<S>(&deltas[b.first_here + other])[slot..slot + TOGETHER];
                    for (product, (a, b)) in products.iter_mut().zip(of.iter().zip(by)) {
                        *product = f64::add_product(simd, *product, *a, *b);
                    }
                }
                row[slot..slot + TOGETHER].copy_from_slice(&products);
            }
        }
    }

    /// The strip of a pair's right factor that begins with this column. Whole registers are written where less is
    /// left: the rest is written over by what follows, or stands in columns that mean nothing.
    #[inline(always)]
    fn multiply_activations<S: Simd>(&mut self, simd: S, (pair, first): (usize, usize)) {
        let pair = &self.pairs[pair];
        let activations =
            &self.activations.as_chunks::<SAMPLES>().0[self.layers[pair.layers.0].first_below..];
        for block in &pair.blocks {
            let (begin, end) =
                (block.first.max(first), (block.first + block.count).min(first + STRIP));
            if begin >= end {
                continue;
            }
            let rows =
                Rows { values: &self.rows[block.layer], length: self.layers[block.layer].row() };
            let from = block.from + begin - block.first;
            for column in (0..end - begin).step_by(f64::width::<S>()) {
                let (from, to) = (from + column, begin - first + column);
                match block.factor {
                    Factor::Behind(apart) => {
                        rows.multiply(simd, (from, from + apart), (&mut self.right, to))
                    }
                    Factor::Input(input) => {
                        rows.scale(simd, (&activations[input], from), (&mut self.right, to))
                    }
                    Factor::One => rows.scale(simd, (&[1.0; SAMPLES], from), (&mut self.right, to)),
                }
            }
        }
    }
}

/// Values sample by sample, so many each.
#[derive(Clone, Copy)]
struct Rows<'a> {
    values: &'a [f64],
    length: usize,
}

impl Rows<'_> {
    /// A register of the products of two stretches of each sample.
    #[inline(always)]
    fn multiply<S: Simd>(
        self,
        simd: S,
        (one, other): (usize, usize),
        (products, to): (&mut [f64], usize),
    ) {
        let width = f64::width::<S>();
        let rows = self.values.chunks_exact(self.length);
        for (own, row) in products.as_chunks_mut::<STRIDE>().0.iter_mut().zip(rows) {
            let one = f64::vectors::<S>(&row[one..one + width])[0];
            let other = f64::vectors::<S>(&row[other..other + width])[0];
            f64::vectors_mut::<S>(&mut own[to..to + width])[0] = simd.mul_f64s(one, other);
        }
    }

    /// A register of the products of a stretch of each sample and a factor of its own.
    #[inline(always)]
    fn scale<S: Simd>(
        self,
        simd: S,
        (factors, from): (&[f64; SAMPLES], usize),
        (products, to): (&mut [f64], usize),
    ) {
        let width = f64::width::<S>();
        let rows = self.values.chunks_exact(self.length).zip(factors);
        for (own, (row, factor)) in products.as_chunks_mut::<STRIDE>().0.iter_mut().zip(rows) {
            let values = f64::vectors::<S>(&row[from..from + width])[0];
            f64::vectors_mut::<S>(&mut own[to..to + width])[0] =
                simd.mul_f64s(simd.splat_f64s(*factor), values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{perceptron::OutputActivation, random::Random, simd::on_each};

    fn world(sizes: &[usize]) -> (Perceptron, Batch) {
        let output = OutputActivation::Linear;
        let mut random = Random::new(9);
        let network = Perceptron::nguyen_widrow(sizes, 1.2, output, &mut random);
        // More than one portion, and the last one not full.
        let inputs: Vec<Vec<f64>> = (0..SAMPLES + 21)
            .map(|_| (0..sizes[0]).map(|_| random.uniform(0.0, 1.0)).collect())
            .collect();
        let targets = vec![vec![0.0; sizes[sizes.len() - 1]]; inputs.len()];
        let batch = Batch::new(&inputs, &targets);
        (network, batch)
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let (network, batch) = world(&[4, 8, 8, 3]);
        let mut curvature = Curvature::new(&network, &batch);
        curvature.packed.set(network.weights());
        let mut all = vec![curvature; 4];
        let mut next = all.iter_mut();
        let widths =
            on_each(|| Pass { curvature: next.next().unwrap(), variances: &[1.0, 2.0, 0.5] });
        // What stands in the last columns, which only fill them up, means nothing.
        let sums = |curvature: &Curvature| -> Vec<f64> {
            let of = |pair: &Pair| {
                let meant = pair.inputs.len();
                pair.sums.chunks_exact(pair.width).flat_map(|row| row[..meant].to_vec()).collect()
            };
            curvature.pairs.iter().flat_map(|pair| -> Vec<f64> { of(pair) }).collect()
        };
        assert!(widths.len() > 1);
        assert!(all[..widths.len()].iter().all(|other| sums(other) == sums(&all[0])));
    }
}
