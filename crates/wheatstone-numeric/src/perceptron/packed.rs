//! A perceptron's weights in the order in which register kernels use them, and the two passes over a
//! group of samples.

use super::{OutputActivation, Perceptron};
use crate::simd::{Real, Simd};

/// Goes through `0..$count` in tiles of four, and what is left at once.
macro_rules! in_tiles {
    ($count:expr, $first:ident, $tile:ident, $body:block) => {{
        let mut $first = 0;
        while $first + 4 <= $count {
            const $tile: usize = 4;
            $body;
            $first += 4;
        }
        match $count - $first {
            3 => {
                const $tile: usize = 3;
                $body;
            }
            2 => {
                const $tile: usize = 2;
                $body;
            }
            1 => {
                const $tile: usize = 1;
                $body;
            }
            _ => {}
        }
    }};
}

/// Goes through the registers `0..$count` of samples two at a time: the sums of four units fit into registers.
macro_rules! in_registers {
    ($count:expr, $first:ident, $wide:ident, $body:block) => {{
        let mut $first = 0;
        while $first + 2 <= $count {
            const $wide: usize = 2;
            $body;
            $first += 2;
        }
        while $first < $count {
            const $wide: usize = 1;
            $body;
            $first += 1;
        }
    }};
}

mod geodesic;

/// The weights, packed.
#[derive(Clone, Debug)]
pub(super) struct Packed<T> {
    pub(super) sizes: Vec<usize>,
    /// Where it is not one, and must be multiplied by.
    gain: Option<T>,
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

/// The sigmoids of a gain times sums, in place: so many registers of each unit, a few at a time that do not
/// wait for each other.
#[inline(always)]
fn squash<T: Real, S: Simd, const N: usize>(
    simd: S,
    gain: Option<T>,
    (units, count): (&mut [[T; N]], usize),
) {
    for unit in units {
        let sums = &mut T::vectors_mut::<S>(unit)[..count];
        if let Some(gain) = gain {
            let gain = T::splat(simd, gain);
            for sum in &mut *sums {
                *sum = T::multiply(simd, gain, *sum);
            }
        }
        let (fours, rest) = sums.as_chunks_mut::<4>();
        for four in fours {
            *four = T::sigmoid(simd, *four);
        }
        for one in rest {
            [*one] = T::sigmoid(simd, [*one]);
        }
    }
}

/// So many registers of a unit's samples, from the `first` on.
#[inline(always)]
fn part<T: Real, S: Simd, const N: usize, const WIDE: usize>(
    unit: &[T; N],
    first: usize,
) -> Option<&[T::Vector<S>; WIDE]> {
    T::vectors::<S>(unit).get(first..)?.first_chunk()
}

/// The same in all registers of a unit.
#[inline(always)]
fn even<T: Real, S: Simd, const TILE: usize, const WIDE: usize>(
    simd: S,
    starts: [T; TILE],
) -> [[T::Vector<S>; WIDE]; TILE] {
    starts.map(|start| [T::splat(simd, start); WIDE])
}

/// `sums[u]` and the sum over the units below of their samples times `weights[below][u]`, in their order.
#[inline(always)]
fn weighted_sums<T: Real, S: Simd, const N: usize, const TILE: usize, const WIDE: usize>(
    simd: S,
    mut sums: [[T::Vector<S>; WIDE]; TILE],
    weights: &[T],
    (units, first): (&[[T; N]], usize),
) -> [[T::Vector<S>; WIDE]; TILE] {
    // Two at a time: there is as much to count as to compute otherwise.
    let (weights, last) = weights.as_chunks::<TILE>().0.as_chunks::<2>();
    let (pairs, last_unit) = units.as_chunks::<2>();
    for (weights, units) in weights.iter().zip(pairs) {
        for (weights, unit) in weights.iter().zip(units) {
            add_unit::<T, S, N, TILE, WIDE>(simd, &mut sums, weights, (unit, first));
        }
    }
    for (weights, unit) in last.iter().zip(last_unit) {
        add_unit::<T, S, N, TILE, WIDE>(simd, &mut sums, weights, (unit, first));
    }
    sums
}

/// One unit's part of [`weighted_sums`].
#[inline(always)]
fn add_unit<T: Real, S: Simd, const N: usize, const TILE: usize, const WIDE: usize>(
    simd: S,
    sums: &mut [[T::Vector<S>; WIDE]; TILE],
    weights: &[T; TILE],
    (unit, first): (&[T; N], usize),
) {
    let Some(samples) = part::<T, S, N, WIDE>(unit, first) else { return };
    for (sums, weight) in sums.iter_mut().zip(weights) {
        let weight = T::splat(simd, *weight);
        for (sum, sample) in sums.iter_mut().zip(samples) {
            *sum = T::add_product(simd, *sum, weight, *sample);
        }
    }
}

/// A few units' weighted sums of what is below them.
#[inline(always)]
fn lift<T: Real, S: Simd, const N: usize, const TILE: usize, const WIDE: usize>(
    simd: S,
    weights: &[T],
    (lower, upper): (&[[T; N]], &mut [[T; N]]),
    first: usize,
) {
    let Some((biases, weights)) = weights.split_first_chunk::<TILE>() else { return };
    let below = (lower, first);
    let starts = even::<T, S, TILE, WIDE>(simd, *biases);
    let sums = weighted_sums::<T, S, N, TILE, WIDE>(simd, starts, weights, below);
    for (unit, sums) in upper.iter_mut().zip(sums) {
        T::vectors_mut::<S>(unit)[first..first + WIDE].copy_from_slice(&sums);
    }
}

impl<T: Real> Packed<T> {
    /// Room for the weights of such a network.
    pub(super) fn new(network: &Perceptron) -> Self {
        let places = places(&network.sizes);
        Self {
            sizes: network.sizes.clone(),
            gain: (network.gain != 1.0).then(|| T::nearest(network.gain)),
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

    /// Fills all layers' activations from the inputs, which stand first: of each unit, so many registers.
    #[inline(always)]
    pub(super) fn forward<S: Simd, const N: usize>(
        &self,
        simd: S,
        mut activations: &mut [[T; N]],
        count: usize,
    ) {
        let count = count.min(N / T::width::<S>());
        let mut weights = self.forward.as_slice();
        for (layer, pair) in self.sizes.windows(2).enumerate() {
            let (lower, upper) = activations.split_at_mut(pair[0]);
            in_tiles!(pair[1], unit, TILE, {
                let (tile, rest) = weights.split_at((pair[0] + 1) * TILE);
                weights = rest;
                let units = &mut upper[unit..unit + TILE];
                in_registers!(count, first, WIDE, {
                    lift::<T, S, N, TILE, WIDE>(simd, tile, (lower, units), first);
                });
            });
            if layer + 2 < self.sizes.len() || self.squashes_outputs {
                squash::<T, S, N>(simd, self.gain, (&mut upper[..pair[1]], count));
            }
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
        let slope = T::subtract_product(simd, activation, activation, activation);
        match self.gain {
            Some(gain) => T::multiply(simd, T::splat(simd, gain), slope),
            None => slope,
        }
    }

    /// Fills the derivatives by the weighted sums of all layers but the inputs, of so many registers; those of
    /// the outputs stand last.
    #[inline(always)]
    pub(super) fn backward<S: Simd, const N: usize>(
        &self,
        simd: S,
        activations: &[[T; N]],
        deltas: &mut [[T; N]],
        count: usize,
    ) {
        let count = count.min(N / T::width::<S>());
        let mut weights = self.backward.as_slice();
        let mut end = deltas.len();
        for pair in self.sizes.windows(2).skip(1).rev() {
            let (below, here) = (pair[0], pair[1]);
            let (lower, upper) = deltas[end - here - below..end].split_at_mut(below);
            let start = self.sizes[0] + end - here - below;
            let activations = &activations[start..start + below];
            in_tiles!(below, unit, TILE, {
                let (tile, rest) = weights.split_at(here * TILE);
                weights = rest;
                let (units, own) = (&mut lower[unit..unit + TILE], &activations[unit..unit + TILE]);
                in_registers!(count, first, WIDE, {
                    self.lower::<S, N, TILE, WIDE>(simd, tile, (upper, own), (units, first));
                });
            });
            end -= here;
        }
    }

    /// A few units' deltas from those above.
    #[inline(always)]
    fn lower<S: Simd, const N: usize, const TILE: usize, const WIDE: usize>(
        &self,
        simd: S,
        weights: &[T],
        (upper, activations): (&[[T; N]], &[[T; N]]),
        (lower, first): (&mut [[T; N]], usize),
    ) {
        let above = (upper, first);
        let zeros = even::<T, S, TILE, WIDE>(simd, [T::default(); TILE]);
        let sums = weighted_sums::<T, S, N, TILE, WIDE>(simd, zeros, weights, above);
        for ((unit, sums), activation) in lower.iter_mut().zip(sums).zip(activations) {
            let places = T::vectors_mut::<S>(unit)[first..first + WIDE].iter_mut();
            let Some(activations) = part::<T, S, N, WIDE>(activation, first) else { return };
            for ((delta, activation), sum) in places.zip(activations).zip(sums) {
                *delta = T::multiply(simd, sum, self.slope(simd, *activation));
            }
        }
    }
}
