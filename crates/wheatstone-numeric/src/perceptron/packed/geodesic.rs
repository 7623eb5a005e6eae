//! How the activations bend as the weights move along a line: their first and second derivatives.

use super::{Packed, even, weighted_sums};
use crate::simd::{Real, Simd};

/// Of a few units, the derivatives of their weighted sums.
struct Tile<'a, T, const N: usize> {
    /// Biases and weights, and how they move.
    weights: [&'a [T]; 2],
    /// Activations below, and their first and second derivatives; those of inputs are none.
    below: [&'a [[T; N]]; 3],
    inputs: bool,
}

impl<T: Real, const N: usize> Tile<'_, T, N> {
    /// Fills so many registers from the first on.
    #[inline(always)]
    fn fill<S: Simd, const TILE: usize, const WIDE: usize>(
        &self,
        simd: S,
        [slopes, bends]: [&mut [[T; N]]; 2],
        first: usize,
    ) {
        let [weights, moves] = self.weights.map(|weights| weights.split_first_chunk::<TILE>());
        let (Some((_, weights)), Some((biases, moves))) = (weights, moves) else { return };
        let [values, first_below, second_below] = self.below.map(|units| (units, first));
        let biases = even::<T, S, TILE, WIDE>(simd, *biases);
        let mut own = weighted_sums::<T, S, N, TILE, WIDE>(simd, biases, moves, values);
        let mut twice = even::<T, S, TILE, WIDE>(simd, [T::default(); TILE]);
        if !self.inputs {
            own = weighted_sums::<T, S, N, TILE, WIDE>(simd, own, weights, first_below);
            twice = weighted_sums::<T, S, N, TILE, WIDE>(simd, twice, moves, first_below);
            for sum in twice.as_flattened_mut() {
                *sum = T::add(simd, *sum, *sum);
            }
            twice = weighted_sums::<T, S, N, TILE, WIDE>(simd, twice, weights, second_below);
        }
        for (units, sums) in [(slopes, own), (bends, twice)] {
            for (unit, sums) in units.iter_mut().zip(sums) {
                T::vectors_mut::<S>(unit)[first..first + WIDE].copy_from_slice(&sums);
            }
        }
    }
}

impl<T: Real> Packed<T> {
    /// Fills the first and second derivatives of all activations above the inputs, as the weights move by
    /// `along`; the activations are there already.
    #[inline(always)]
    pub(in super::super) fn second_derivative<S: Simd, const N: usize>(
        &self,
        simd: S,
        along: &Self,
        (mut activations, [mut slopes, mut bends]): (&[[T; N]], [&mut [[T; N]]; 2]),
        count: usize,
    ) {
        let count = count.min(N / T::width::<S>());
        let (mut weights, mut moves) = (self.forward.as_slice(), along.forward.as_slice());
        for (layer, pair) in self.sizes.windows(2).enumerate() {
            let (values, above) = activations.split_at(pair[0]);
            let (first_below, slopes_above) = slopes.split_at_mut(pair[0]);
            let (second_below, bends_above) = bends.split_at_mut(pair[0]);
            let (first_below, second_below) = (&*first_below, &*second_below);
            in_tiles!(pair[1], unit, TILE, {
                let (own, rest) = weights.split_at((pair[0] + 1) * TILE);
                weights = rest;
                let (moved, rest) = moves.split_at((pair[0] + 1) * TILE);
                moves = rest;
                let tile = Tile {
                    weights: [own, moved],
                    below: [values, first_below, second_below],
                    inputs: layer == 0,
                };
                in_registers!(count, first, WIDE, {
                    let units = unit..unit + TILE;
                    let to = [&mut slopes_above[units.clone()], &mut bends_above[units]];
                    tile.fill::<S, TILE, WIDE>(simd, to, first);
                });
            });
            if layer + 2 < self.sizes.len() || self.squashes_outputs {
                let motion = [&mut *slopes_above, &mut *bends_above];
                self.squash_bends::<S, N>(simd, (&above[..pair[1]], motion), count);
            }
            (activations, slopes, bends) = (above, slopes_above, bends_above);
        }
    }

    /// From derivatives of the weighted sums to those of the activations.
    #[inline(always)]
    fn squash_bends<S: Simd, const N: usize>(
        &self,
        simd: S,
        (activations, [slopes, bends]): (&[[T; N]], [&mut [[T; N]]; 2]),
        count: usize,
    ) {
        let (one, two) = (T::splat(simd, T::nearest(1.0)), T::splat(simd, T::nearest(2.0)));
        for ((unit, slopes), bends) in activations.iter().zip(slopes).zip(bends) {
            let slopes = T::vectors_mut::<S>(slopes).iter_mut();
            let both = slopes.zip(T::vectors_mut::<S>(bends)).take(count);
            for (value, (slope, bend)) in T::vectors::<S>(unit).iter().zip(both) {
                let own = self.slope(simd, *value);
                let mut skew = T::subtract_product(simd, one, two, *value);
                if let Some(gain) = self.gain {
                    skew = T::multiply(simd, T::splat(simd, gain), skew);
                }
                let sum = *slope;
                *slope = T::multiply(simd, own, sum);
                // s'' z'^2 + s' z'', where s'' is the skew times s'.
                let square = T::multiply(simd, skew, T::multiply(simd, sum, sum));
                *bend = T::multiply(simd, own, T::add(simd, *bend, square));
            }
        }
    }
}
