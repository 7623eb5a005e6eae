//! How badly two pixels match.
//!
//! The cost of a pixel and a disparity is the number of census bits that differ, plus half of the difference of
//! gradients, cut at [`MOST_DIFFERENCE`]; and then the mean over 3 x 3 pixels, times 3/2. It is at most 54.

use crate::{
    census::{Codes, reversed},
    registers::{LANES, mean, pieces, pieces_mut},
    search_range::SearchRange,
};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Differences of gradients beyond this say no more.
const MOST_DIFFERENCE: u8 = 24;
/// The cost of a disparity that leads out of the picture, before the mean: about that of unrelated pixels.
const OUTSIDE: u8 = 17;
/// What fills up a register. It is more than any path's cost, so that it never wins.
const NO_DISPARITY: u8 = u8::MAX;

/// The codes of both pictures, and where to search.
#[derive(Clone, Copy)]
pub(crate) struct CodedPair<'a> {
    pub(crate) left: &'a Codes,
    pub(crate) right: &'a Codes,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) range: SearchRange,
}

/// Computes rows of costs, one after the other, up or down.
pub(crate) struct CostRows<'a> {
    pair: CodedPair<'a>,
    /// The right picture's codes of a row, as [`reversed`].
    candidates: [Vec<u8>; 4],
    /// Costs of a row's pixels, [x + 1][index], with one pixel repeated at each end.
    pixels: Vec<u8>,
    /// Sums of three pixels along the row, [x][index], of the last three rows.
    sums: [Vec<u8>; 3],
    /// Which rows these are of.
    held: [Option<usize>; 3],
}

impl<'a> CostRows<'a> {
    pub(crate) fn new(pair: CodedPair<'a>) -> Self {
        let (width, slots) = (pair.width, pair.range.slots);
        let candidates = || vec![0; width + slots];
        let sums = || vec![0; width * slots];
        Self {
            pair,
            candidates: std::array::from_fn(|_| candidates()),
            pixels: vec![0; (width + 2) * slots],
            sums: std::array::from_fn(|_| sums()),
            held: [None; 3],
        }
    }

    /// Writes the costs of a row: [x][index of the disparity].
    pub(crate) fn write(&mut self, y: usize, out: &mut [u8]) {
        let last = self.pair.height - 1;
        for row in [y.saturating_sub(1), y, (y + 1).min(last)] {
            if self.held[row % 3] != Some(row) {
                self.held[row % 3] = Some(row);
                self.sum_row(row);
            }
        }
        let [above, same, below] =
            [y.saturating_sub(1), y, (y + 1).min(last)].map(|row| self.sums[row % 3].as_slice());
        on_widest(Smoothed { above, same, below, out, range: self.pair.range });
    }

    fn sum_row(&mut self, y: usize) {
        let pair = self.pair;
        let at = y * pair.width..(y + 1) * pair.width;
        let planes = |codes: &'a Codes| {
            let [first, second, third] = &codes.census;
            [first, second, third, &codes.gradient].map(|plane| &plane[at.clone()])
        };
        for (plane, candidates) in planes(pair.right).into_iter().zip(&mut self.candidates) {
            reversed(plane, pair.range.first, candidates);
        }
        on_widest(RowSums {
            left: planes(pair.left),
            candidates: &self.candidates,
            range: pair.range,
            pixels: &mut self.pixels,
            sums: &mut self.sums[y % 3],
        });
    }
}

/// Costs of the pixels of a row, and their sums along it.
struct RowSums<'a> {
    left: [&'a [u8]; 4],
    candidates: &'a [Vec<u8>; 4],
    range: SearchRange,
    pixels: &'a mut [u8],
    sums: &'a mut [u8],
}

impl WithSimd for RowSums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let slots = self.range.slots;
        let width = self.left[0].len();
        for x in 0..width {
            let codes = self.left.map(|plane| plane[x]);
            let from = width - 1 - x;
            let candidates = self.candidates.each_ref().map(|plane| &plane[from..from + slots]);
            let costs = &mut self.pixels[(x + 1) * slots..(x + 2) * slots];
            compare(codes, candidates, costs);
            let inside = self.range.inside(x, width);
            if inside.len() < self.range.count {
                costs[..inside.start].fill(OUTSIDE);
                costs[inside.end..].fill(OUTSIDE);
            }
        }
        self.pixels.copy_within(slots..2 * slots, 0);
        self.pixels.copy_within(width * slots..(width + 1) * slots, (width + 1) * slots);
        let [before, same, after] = [0, 1, 2].map(|x| &self.pixels[x * slots..(x + width) * slots]);
        for (((sum, &a), &b), &c) in self.sums.iter_mut().zip(before).zip(same).zip(after) {
            *sum = a.wrapping_add(b).wrapping_add(c);
        }
    }
}

/// The costs of one pixel.
#[inline(always)]
fn compare(codes: [u8; 4], candidates: [&[u8]; 4], costs: &mut [u8]) {
    let [first, second, third, gradients] = candidates.map(pieces::<u8, LANES>);
    for (k, costs) in pieces_mut::<u8, LANES>(costs).iter_mut().enumerate() {
        let (first, second, third, gradients) = (first[k], second[k], third[k], gradients[k]);
        *costs = std::array::from_fn(|lane| {
            // All in bytes: wider sums and differences take several times as long.
            let differing = (codes[0] ^ first[lane]).count_ones() as u8
                + (codes[1] ^ second[lane]).count_ones() as u8
                + (codes[2] ^ third[lane]).count_ones() as u8;
            let (own, other) = (codes[3], gradients[lane]);
            let gradient = (own.max(other) - own.min(other)).min(MOST_DIFFERENCE);
            differing + ((gradient + 1) >> 1)
        });
    }
}

/// The mean of three rows of sums: half of the middle one and a quarter of each other.
struct Smoothed<'a> {
    above: &'a [u8],
    same: &'a [u8],
    below: &'a [u8],
    out: &'a mut [u8],
    range: SearchRange,
}

impl WithSimd for Smoothed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let rows = self.above.iter().zip(self.same).zip(self.below);
        for (out, ((&above, &same), &below)) in self.out.iter_mut().zip(rows) {
            *out = mean(mean(above, below), same) >> 1;
        }
        let SearchRange { count, slots, .. } = self.range;
        if count < slots {
            self.out.chunks_exact_mut(slots).for_each(|costs| costs[count..].fill(NO_DISPARITY));
        }
    }
}
