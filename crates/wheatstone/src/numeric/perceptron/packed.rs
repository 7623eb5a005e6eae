//! A perceptron's weights in the order in which register kernels use them, and the two passes over as
//! many samples as a register holds.

use super::{OutputActivation, Perceptron};
use crate::numeric::simd::{Real, Simd, add_products, has_many_registers};

/// Goes through `0..$count` in tiles of eight, four, two and one: sums that are kept apart hide each
/// other's latency, and eight with what they are multiplied by fit into sixteen registers.
macro_rules! in_tiles {
    ($count:expr, $first:ident, $tile:ident, $body:block) => {{
        let mut $first = 0;
        while $first + 8 <= $count {
            const $tile: usize = 8;
            $body;
            $first += 8;
        }
        while $first + 4 <= $count {
            const $tile: usize = 4;
            $body;
            $first += 4;
        }
        while $first + 2 <= $count {
            const $tile: usize = 2;
            $body;
            $first += 2;
        }
        while $first < $count {
            const $tile: usize = 1;
            $body;
            $first += 1;
        }
    }};
}

/// The weights, packed.
#[derive(Clone, Debug)]
pub(super) struct Packed<T> {
    pub(super) sizes: Vec<usize>,
    gain: T,
    /// Whether the gain is not one, and must be multiplied by.
    scales: bool,
    /// Whether the last layer goes through the sigmoid.
    squashes_outputs: bool,
    /// Layer by layer, tile by tile: biases, then the weights input by input.
    forward: Vec<T>,
    /// From the last layer to the second, tile by tile of the units below: weights unit by unit.
    backward: Vec<T>,
    /// Where each of those two stands among the network's weights.
    places: [Vec<usize>; 2],
}

/// The order in which the weights are needed forward, and backward.
fn places(sizes: &[usize]) -> [Vec<usize>; 2] {
    let (mut forward, mut backward) = (Vec::new(), Vec::new());
    let mut start = 0;
    for pair in sizes.windows(2) {
        let (below, here) = (pair[0], pair[1]);
        in_tiles!(here, first, TILE, {
            let tile = first..first + TILE;
            forward.extend(tile.clone().map(|unit| start + below * here + unit));
            for input in 0..below {
                forward.extend(tile.clone().map(|unit| start + unit * below + input));
            }
        });
        start += (below + 1) * here;
    }
    for pair in sizes.windows(2).skip(1).rev() {
        let (below, here) = (pair[0], pair[1]);
        start -= (below + 1) * here;
        in_tiles!(below, first, TILE, {
            for unit in 0..here {
                backward.extend((first..first + TILE).map(|input| start + unit * below + input));
            }
        });
    }
    [forward, backward]
}

/// The sigmoids of sums, eight or four at a time: as many chains as the registers hold.
#[inline(always)]
fn squash<T: Real, S: Simd>(simd: S, sums: &mut [T::Vector<S>]) {
    let many = if has_many_registers::<T, S>() { sums.len() / 8 * 8 } else { 0 };
    let (eights, rest) = sums.split_at_mut(many);
    for eight in eights.as_chunks_mut::<8>().0 {
        *eight = T::sigmoid(simd, *eight);
    }
    let (fours, rest) = rest.as_chunks_mut::<4>();
    for four in fours {
        *four = T::sigmoid(simd, *four);
    }
    for one in rest {
        [*one] = T::sigmoid(simd, [*one]);
    }
}

/// What stands in one place of each unit.
#[inline(always)]
fn in_slot<V, const B: usize>(units: &[[V; B]], slot: usize) -> impl Iterator<Item = &V> {
    units.iter().map(move |unit| &unit[slot])
}

impl<T: Real> Packed<T> {
    /// Room for the weights of such a network.
    pub(super) fn new(network: &Perceptron) -> Self {
        let places = places(&network.sizes);
        Self {
            sizes: network.sizes.clone(),
            gain: T::nearest(network.gain),
            scales: network.gain != 1.0,
            squashes_outputs: network.output == OutputActivation::Sigmoid,
            forward: vec![T::default(); places[0].len()],
            backward: vec![T::default(); places[1].len()],
            places,
        }
    }

    /// Units of all layers, inputs among them.
    pub(super) fn units(&self) -> usize {
        self.sizes.iter().sum()
    }

    /// Inputs and outputs.
    pub(super) fn ends(&self) -> (usize, usize) {
        (self.sizes[0], self.sizes[self.sizes.len() - 1])
    }

    /// Takes weights over.
    pub(super) fn set(&mut self, weights: &[f64]) {
        let of_weights = |(slot, place): (&mut T, &usize)| *slot = T::nearest(weights[*place]);
        self.forward.iter_mut().zip(&self.places[0]).for_each(of_weights);
        self.backward.iter_mut().zip(&self.places[1]).for_each(of_weights);
    }

    /// Fills all layers' activations from the inputs, which stand first: those in the place `slot` of each
    /// unit.
    #[inline(always)]
    pub(super) fn forward<S: Simd, const B: usize>(
        &self,
        simd: S,
        mut activations: &mut [[T::Vector<S>; B]],
        slot: usize,
    ) {
        if slot >= B {
            return;
        }
        let mut weights = self.forward.as_slice();
        let gain = T::splat(simd, self.gain);
        for (layer, pair) in self.sizes.windows(2).enumerate() {
            let (lower, upper) = activations.split_at_mut(pair[0]);
            let squashes = layer + 2 < self.sizes.len() || self.squashes_outputs;
            in_tiles!(pair[1], first, TILE, {
                let (tile, rest) = weights.split_at((pair[0] + 1) * TILE);
                weights = rest;
                let (biases, tile) = tile.split_at(TILE);
                let sums: [T::Vector<S>; TILE] =
                    std::array::from_fn(|unit| T::splat(simd, biases[unit]));
                let below = in_slot(lower, slot);
                let mut sums = add_products::<T, S, TILE>(simd, sums, tile, below);
                if squashes {
                    if self.scales {
                        for sum in &mut sums {
                            *sum = T::multiply(simd, gain, *sum);
                        }
                    }
                    squash::<T, S>(simd, &mut sums);
                }
                for (unit, sum) in upper[first..first + TILE].iter_mut().zip(sums) {
                    unit[slot] = sum;
                }
            });
            activations = upper;
        }
    }

    /// The slope of the outputs' activation.
    #[inline(always)]
    pub(super) fn output_slope<S: Simd>(&self, simd: S, output: T::Vector<S>) -> T::Vector<S> {
        if self.squashes_outputs {
            self.slope(simd, output)
        } else {
            T::splat(simd, T::nearest(1.0))
        }
    }

    #[inline(always)]
    fn slope<S: Simd>(&self, simd: S, activation: T::Vector<S>) -> T::Vector<S> {
        let rest = T::subtract(simd, T::splat(simd, T::nearest(1.0)), activation);
        let slope = T::multiply(simd, activation, rest);
        if self.scales { T::multiply(simd, T::splat(simd, self.gain), slope) } else { slope }
    }

    /// Fills the derivatives by the weighted sums of all layers but the inputs; those of the outputs
    /// stand last. In the place `slot` of each unit.
    #[inline(always)]
    pub(super) fn backward<S: Simd, const B: usize>(
        &self,
        simd: S,
        activations: &[[T::Vector<S>; B]],
        deltas: &mut [[T::Vector<S>; B]],
        slot: usize,
    ) {
        if slot >= B {
            return;
        }
        let mut weights = self.backward.as_slice();
        let mut end = deltas.len();
        for pair in self.sizes.windows(2).skip(1).rev() {
            let (below, here) = (pair[0], pair[1]);
            let (lower, upper) = deltas[end - here - below..end].split_at_mut(below);
            let start = self.sizes[0] + end - here - below;
            let here_activations = &activations[start..start + below];
            in_tiles!(below, first, TILE, {
                let (tile, rest) = weights.split_at(here * TILE);
                weights = rest;
                let zero = [T::splat(simd, T::default()); TILE];
                let above = in_slot(upper, slot);
                let sums = add_products::<T, S, TILE>(simd, zero, tile, above);
                let places = lower[first..first + TILE].iter_mut();
                for ((delta, activation), sum) in
                    places.zip(&here_activations[first..first + TILE]).zip(sums)
                {
                    delta[slot] = T::multiply(simd, sum, self.slope(simd, activation[slot]));
                }
            });
            end -= here;
        }
    }
}
