//! How badly two pixels match.
//!
//! The cost of a pixel and a disparity is the number of census bits that differ, plus half of the difference of
//! gradients, cut at [`MOST_DIFFERENCE`]; and then the mean over 3 x 3 pixels, times 3/2. It is at most 54.

use crate::{
    candidates::{CandidateRow, RightCodes},
    census::Codes,
    registers::{LANES, mean, pieces, pieces_mut},
    search_range::SearchRange,
};
use std::ops::Range;
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
    pub(crate) right: &'a RightCodes<'a>,
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) range: SearchRange,
}

/// Computes rows of costs, one after the other, up or down.
pub(crate) struct CostRows<'a> {
    pair: CodedPair<'a>,
    candidates: CandidateRow<'a>,
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
        let sums = || vec![0; width * slots];
        Self {
            pair,
            candidates: CandidateRow::new(pair.right, width, pair.range),
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
        let CodedPair { left, width, range, .. } = self.pair;
        let left = left.row(y, width);
        self.candidates.turn_to(y);
        for block in self.candidates.blocks() {
            let candidates = self.candidates.of_block(block.clone());
            on_widest(PixelCosts { left, candidates, range, block, pixels: &mut self.pixels });
        }
        let (pixels, sums) = (&mut self.pixels, &mut self.sums[y % 3]);
        on_widest(RowSums { pixels, sums, slots: range.slots });
    }
}

/// Costs of a block of pixels of a row.
struct PixelCosts<'a> {
    left: [&'a [u8]; 4],
    candidates: &'a [Vec<u8>; 4],
    range: SearchRange,
    block: Range<usize>,
    pixels: &'a mut [u8],
}

impl WithSimd for PixelCosts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let slots = self.range.slots;
        let width = self.left[0].len();
        for x in self.block {
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
    }
}

/// Sums of the costs of three pixels along a row.
struct RowSums<'a> {
    pixels: &'a mut [u8],
    sums: &'a mut [u8],
    slots: usize,
}

impl WithSimd for RowSums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { pixels, sums, slots } = self;
        let length = sums.len();
        pixels.copy_within(slots..2 * slots, 0);
        pixels.copy_within(length..length + slots, length + slots);
        let [before, same, after] = [0, 1, 2].map(|x| &pixels[x * slots..x * slots + length]);
        for (((sum, &a), &b), &c) in sums.iter_mut().zip(before).zip(same).zip(after) {
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
