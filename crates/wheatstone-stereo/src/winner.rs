//! The disparity of least cost, for both pictures, and how clearly it wins.
//!
//! The sum of four paths and the disparity's index share 16 bits, so that one comparison finds both. Beyond 128
//! disparities the sum leaves off its lowest bits, one for every doubling; the winner then moves to
//! the least of the exact sums beside it.

use crate::{
    registers::{self, Bytes, each, lanes, least, pieces},
    search_range::SearchRange,
};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Bits of the highest sum: two means of bytes.
const SUM_BITS: u32 = 9;
/// Disparities at a time.
const LANES: usize = 16;
/// Indices of the first of them.
const FIRST_INDICES: [u16; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
/// A sum of paths that is worse than a match's by less may be that of the true match. With 56, a convergent pair loses 4 %
/// of its confident pixels and not 2, and of a chessboard 481 instead of 777 points are a period off.
const CLOSE: u16 = 32;
/// Where there is no match: no index.
pub(crate) const NO_MATCH: u16 = u16::MAX;

/// How clearly a disparity wins.
#[derive(Clone, Copy, Default)]
pub(crate) struct Clarity {
    /// By how much the second best sum of paths is worse that is not beside the best.
    pub(crate) gap: u16,
    /// By how much the best cost of others is worse than that of the winner, before aggregation; negative where the
    /// winner owes its place to the neighbours.
    pub(crate) lead: i16,
}

/// A row of what winners are found from: means of the paths there and back, and costs, [x][index].
#[derive(Clone, Copy)]
pub(crate) struct SearchRow<'a> {
    pub(crate) forward: &'a [u8],
    pub(crate) backward: &'a [u8],
    pub(crate) costs: &'a [u8],
}

/// The winners of one row.
pub(crate) struct WinnerRow<'a> {
    /// Disparities of the left picture's pixels with their fraction; NaN where the match is outside.
    pub(crate) disparity: &'a mut [f32],
    pub(crate) clarity: &'a mut [Clarity],
    /// Indices of the disparities of the right picture's pixels, or [`NO_MATCH`].
    pub(crate) right: &'a mut [u16],
}

/// What is needed to find winners, row after row.
pub(crate) struct Winners {
    width: usize,
    range: SearchRange,
    index_bits: u32,
    /// Sums and indices of one pixel.
    packed: Vec<u16>,
    /// What hides the indices beside a winner from a search for the least: see [`hiding`].
    hide: (Vec<u16>, Vec<u8>),
    /// The least of them for every pixel on the right: at index k that of pixel `width - 1 - first - k`.
    right: Vec<u16>,
}

impl Winners {
    pub(crate) fn new(width: usize, range: SearchRange) -> Self {
        let index_bits = usize::BITS - (range.slots - 1).leading_zeros();
        Self {
            width,
            range,
            index_bits: index_bits.max(u16::BITS - SUM_BITS),
            packed: vec![0; range.slots],
            hide: (hiding(range.slots, u16::MAX), hiding(range.slots, u8::MAX)),
            right: vec![u16::MAX; width + range.slots],
        }
    }

    /// Finds the winners of a row.
    pub(crate) fn find(&mut self, row: SearchRow<'_>, out: WinnerRow<'_>) {
        on_widest(Find { winners: self, row, out });
    }

    /// Packs the sums of a pixel, notes them on the right, and returns the least.
    #[inline(always)]
    fn pack(&mut self, forward: &[u8], backward: &[u8], x: usize) -> u16 {
        let coarse = SUM_BITS + self.index_bits - u16::BITS;
        let from = self.width - 1 - x;
        let right = &mut self.right[from..from + self.range.slots];
        let right = right.as_chunks_mut::<LANES>().0.iter_mut();
        let sums = forward.as_chunks::<LANES>().0.iter().zip(backward.as_chunks::<LANES>().0);
        let packed = self.packed.as_chunks_mut::<LANES>().0.iter_mut();
        let mut lowest = [u16::MAX; LANES];
        let mut index = FIRST_INDICES;
        for (((forward, backward), packed), right) in sums.zip(packed).zip(right) {
            let sums: [u16; LANES] = std::array::from_fn(|lane| {
                (u16::from(forward[lane]) + u16::from(backward[lane])) >> coarse << self.index_bits
            });
            let values = lanes(sums, index, |sum, index| sum | index);
            lowest = lanes(lowest, values, u16::min);
            *right = lanes(*right, values, u16::min);
            *packed = values;
            index = each(index, |index| index + LANES as u16);
        }
        lowest.into_iter().fold(u16::MAX, u16::min)
    }

    /// By how much the best of other costs is worse than the winner's.
    #[inline(always)]
    fn lead(&self, costs: &[u8], winner: usize) -> i16 {
        let hide = &self.hide.1[costs.len() + 1 - winner..][..costs.len()];
        let mut lowest: Bytes = [u8::MAX; registers::LANES];
        for (costs, hide) in pieces(costs).iter().zip(pieces(hide)) {
            lowest = lanes(lowest, lanes(*costs, *hide, |cost, hide| cost | hide), u8::min);
        }
        i16::from(least(&lowest)) - i16::from(costs[winner])
    }

    /// The least sum and the least cost that other pixels of the left picture have with the right pixel of a match, but for
    /// those beside the match.
    fn rivals(&self, row: &SearchRow<'_>, x: usize, winner: usize) -> Rivals {
        let SearchRange { count, slots, .. } = self.range;
        let mut found = Rivals { sum: u16::MAX, cost: u8::MAX };
        for other in (0..count).filter(|other| other.abs_diff(winner) > 1) {
            let there = (x + other).checked_sub(winner).filter(|there| *there < self.width);
            if let Some(at) = there.map(|there| there * slots + other) {
                let sum = u16::from(row.forward[at]) + u16::from(row.backward[at]);
                found.sum = found.sum.min(sum);
                found.cost = found.cost.min(row.costs[at]);
            }
        }
        found
    }

    /// The least packed value whose index is not beside that of the best.
    #[inline(always)]
    fn second_best(&self, best: u16) -> u16 {
        let (winner, slots) = (usize::from(best & ((1 << self.index_bits) - 1)), self.packed.len());
        let hide = &self.hide.0[slots + 1 - winner..][..slots];
        let mut lowest = [u16::MAX; LANES];
        let pieces = self.packed.as_chunks::<LANES>().0.iter().zip(hide.as_chunks::<LANES>().0);
        for (packed, hide) in pieces {
            lowest = lanes(lowest, lanes(*packed, *hide, |packed, hide| packed | hide), u16::min);
        }
        lowest.into_iter().fold(u16::MAX, u16::min)
    }
}

/// What else a pixel of the right picture could be.
struct Rivals {
    sum: u16,
    cost: u8,
}

/// Zeros, with three of the largest number among them: a part of `slots` numbers that begins at `slots + 1 - winner` has these
/// at the winner and on both sides of it. Joined bit by bit to other numbers, it makes those three the largest.
fn hiding<T: Copy + Default>(slots: usize, largest: T) -> Vec<T> {
    let mut hide = vec![T::default(); 2 * slots + 2];
    hide[slots..slots + 3].fill(largest);
    hide
}

/// The work of one row.
struct Find<'a> {
    winners: &'a mut Winners,
    row: SearchRow<'a>,
    out: WinnerRow<'a>,
}

impl WithSimd for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { winners, row, out } = self;
        let SearchRange { first, count, slots } = winners.range;
        let (bits, coarse) = (winners.index_bits, SUM_BITS + winners.index_bits - u16::BITS);
        winners.right.fill(u16::MAX);
        for x in 0..winners.width {
            let here = x * slots..(x + 1) * slots;
            let (forward, backward) = (&row.forward[here.clone()], &row.backward[here.clone()]);
            let best = winners.pack(forward, backward, x);
            let gap = (winners.second_best(best) >> bits).saturating_sub(best >> bits);
            let sum = |index: usize| u16::from(forward[index]) + u16::from(backward[index]);
            let index = lowest_beside(usize::from(best & ((1 << bits) - 1)), count, &sum);
            let lead = winners.lead(&row.costs[here.clone()], index);
            let mut clarity = Clarity { gap: gap << coarse, lead };
            let inside = winners.range.inside(x, winners.width);
            out.disparity[x] = if inside.contains(&index) {
                (first + index as i32) as f32 + fraction(index, count, &sum)
            } else {
                f32::NAN
            };
            // Beside the picture's border the right one does not show all candidates: what repeats itself may be another
            // period, as only the right pixel tells, which may be seen better elsewhere.
            if inside.contains(&index) && inside.len() < count {
                let rivals = winners.rivals(&row, x, index);
                let gap = rivals.sum.saturating_sub(sum(index));
                if gap < CLOSE {
                    clarity.gap = clarity.gap.min(gap);
                    let own = row.costs[here.start + index];
                    clarity.lead = clarity.lead.min(i16::from(rivals.cost) - i16::from(own));
                }
            }
            out.clarity[x] = clarity;
        }
        for (x, out) in out.right.iter_mut().enumerate() {
            let at = winners.width as i64 - 1 - i64::from(first) - x as i64;
            let lowest = usize::try_from(at).ok().and_then(|at| winners.right.get(at)).copied();
            let found = lowest.filter(|&lowest| lowest != u16::MAX);
            *out = found.map_or(NO_MATCH, |lowest| lowest & ((1 << bits) - 1));
        }
    }
}

/// The least of the sums that an index leads down to.
#[inline(always)]
fn lowest_beside(mut index: usize, count: usize, sum: &impl Fn(usize) -> u16) -> usize {
    while index > 0 && sum(index - 1) < sum(index) {
        index -= 1;
    }
    while index + 1 < count && sum(index + 1) < sum(index) {
        index += 1;
    }
    index
}

/// Where between the disparities the minimum lies: two lines of opposite slopes through three sums (Shimizu and Okutomi
/// 2001, doi:10.1109/ICCV.2001.937500).
#[inline(always)]
fn fraction(index: usize, count: usize, sum: &impl Fn(usize) -> u16) -> f32 {
    if index == 0 || index + 1 >= count {
        return 0.0;
    }
    let [before, here, after] = [index - 1, index, index + 1].map(|index| f32::from(sum(index)));
    let steeper = (before - here).max(after - here);
    if steeper > 0.0 { 0.5 * (before - after) / steeper } else { 0.0 }
}
