//! Sums over samples of the products of derivatives and activations: the gradient.

use crate::simd::{Real, Simd};

/// What a group left behind, unit by unit; of each block of samples, one register.
pub(super) struct Products<'a, T: Real, S: Simd, const N: usize> {
    pub(super) simd: S,
    pub(super) deltas: &'a [[T; N]],
    pub(super) activations: &'a [[T; N]],
    /// Which of a block's registers, and how many those are: so far apart are the sums of two weights.
    pub(super) register: usize,
    pub(super) registers: usize,
    /// Registers of the group.
    pub(super) count: usize,
}

impl<T: Real, S: Simd, const N: usize> Products<'_, T, S, N> {
    /// One layer's weights: `(here, below)` sums.
    #[inline(always)]
    pub(super) fn layer(
        &self,
        sums: &mut [T::Vector<S>],
        (here_start, below_start): (usize, usize),
        (here, below): (usize, usize),
    ) {
        let mut unit = 0;
        while unit < here {
            let tall = match here - unit {
                2 => 1,
                rest => rest.min(4),
            };
            let mut input = 0;
            while input < below {
                let wide = (below - input).min(2);
                let sums = &mut sums[(unit * below + input) * self.registers..];
                let from = (here_start + unit, below_start + input);
                match (tall, wide) {
                    (4, 2) => self.tile::<4, 2>(sums, below, from),
                    (4, _) => self.tile::<4, 1>(sums, below, from),
                    (3, 2) => self.tile::<3, 2>(sums, below, from),
                    (3, _) => self.tile::<3, 1>(sums, below, from),
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
        let Some(deltas) = self.deltas[unit..].first_chunk::<TALL>() else { return };
        let Some(activations) = self.activations[input..].first_chunk::<WIDE>() else { return };
        let place = |row: usize, column: usize| (row * below + column) * self.registers;
        // Not from the sums that are there: no product would wait for those, which lie farther away.
        let mut sums = [[T::splat(self.simd, T::default()); WIDE]; TALL];
        let mut slot = self.register;
        // Two at a time: there is as much to count as to compute otherwise.
        while slot + self.registers < self.count {
            self.add_slot(&mut sums, (deltas, activations), slot);
            self.add_slot(&mut sums, (deltas, activations), slot + self.registers);
            slot += 2 * self.registers;
        }
        if slot < self.count {
            self.add_slot(&mut sums, (deltas, activations), slot);
        }
        for (r, sums) in sums.into_iter().enumerate() {
            for (c, sum) in sums.into_iter().enumerate() {
                let row = &mut rows[place(r, c)];
                *row = T::add(self.simd, *row, sum);
            }
        }
    }

    /// One register's part of a tile.
    #[inline(always)]
    fn add_slot<const TALL: usize, const WIDE: usize>(
        &self,
        sums: &mut [[T::Vector<S>; WIDE]; TALL],
        (deltas, activations): (&[[T; N]; TALL], &[[T; N]; WIDE]),
        slot: usize,
    ) {
        if slot >= N / T::width::<S>() {
            return;
        }
        for (sums, delta) in sums.iter_mut().zip(deltas) {
            let delta = T::vectors::<S>(delta)[slot];
            for (sum, activation) in sums.iter_mut().zip(activations) {
                let activation = T::vectors::<S>(activation)[slot];
                *sum = T::add_product(self.simd, *sum, delta, activation);
            }
        }
    }

    /// One layer's biases.
    #[inline(always)]
    pub(super) fn biases(&self, sums: &mut [T::Vector<S>], (start, here): (usize, usize)) {
        let mut unit = 0;
        while unit + 4 <= here {
            self.few_biases::<4>(&mut sums[unit * self.registers..], start + unit);
            unit += 4;
        }
        while unit < here {
            self.few_biases::<1>(&mut sums[unit * self.registers..], start + unit);
            unit += 1;
        }
    }

    /// The biases of a few units.
    #[inline(always)]
    fn few_biases<const TALL: usize>(&self, rows: &mut [T::Vector<S>], start: usize) {
        let Some(deltas) = self.deltas[start..].first_chunk::<TALL>() else { return };
        let mut sums: [T::Vector<S>; TALL] = std::array::from_fn(|row| rows[row * self.registers]);
        for slot in (self.register..self.count.min(N / T::width::<S>())).step_by(self.registers) {
            for (sum, delta) in sums.iter_mut().zip(deltas) {
                *sum = T::add(self.simd, *sum, T::vectors::<S>(delta)[slot]);
            }
        }
        for (row, sum) in sums.into_iter().enumerate() {
            rows[row * self.registers] = sum;
        }
    }
}
