//! Semi-global aggregation: costs along four paths, in bytes.
//!
//! A path comes from a side of the picture to the pixel and pays the costs of the disparities that it takes, a
//! small penalty where they change by one and a large one where they change by more (Hirschmüller 2008,
//! doi:10.1109/TPAMI.2007.1166, equations 13 and 14). The large penalty falls where brightness changes: there objects
//! end. Two paths, from the side and from above, are followed downwards, and the other two upwards.

use crate::{
    error::MatchError,
    limits::MOST_PENALTY,
    registers::{Bytes, LANES, lanes, least, mean, pieces, pieces_mut},
};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Differences of brightness up to this, in grey levels, leave the large penalty as it is.
const SAME_BRIGHTNESS: u16 = 6;
/// What stands on both sides of a path's costs, where there are no disparities.
const MARGIN: usize = LANES;

/// What a change of disparity costs between one pixel and the next. A pixel's own cost is at most 54.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Penalties {
    /// For a change by one.
    pub small: u8,
    /// For a larger change, where brightness stays the same.
    pub large: u8,
    /// The large penalty falls with the difference of brightness, to this.
    pub least: u8,
}

impl Default for Penalties {
    fn default() -> Self {
        Self { small: 30, large: 150, least: 40 }
    }
}

impl Penalties {
    pub(crate) fn check(&self) -> Result<(), MatchError> {
        let grow = self.small < self.least && self.least <= self.large;
        if grow && self.large <= MOST_PENALTY { Ok(()) } else { Err(MatchError::Penalties) }
    }

    /// The large penalty, by the absolute difference of brightness.
    fn by_difference(&self) -> [u8; 256] {
        std::array::from_fn(|difference| {
            let difference = (difference as u16).max(SAME_BRIGHTNESS);
            let penalty = u16::from(self.large) * SAME_BRIGHTNESS / difference;
            (penalty as u8).max(self.least)
        })
    }
}

/// Whether pixels are visited from left to right, and rows downwards; or both the other way.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    Forward,
    Backward,
}

/// One row of what paths go through.
#[derive(Clone, Copy)]
pub(crate) struct PathRow<'a> {
    /// Costs, [x][index].
    pub(crate) costs: &'a [u8],
    /// Brightness.
    pub(crate) pixels: &'a [u8],
    /// Brightness of the row that was visited before, or of the same row at the beginning.
    pub(crate) pixels_before: &'a [u8],
}

/// Two paths, one along rows and one down or up the columns, and where they have come to.
pub(crate) struct Paths {
    slots: usize,
    order: Order,
    small: u8,
    large: [u8; 256],
    /// Costs of the path along the row, at the last pixel and at this.
    side: [Vec<u8>; 2],
    /// Costs of the paths along the columns, [x][MARGIN + index], in the last row and in this.
    columns: [Vec<u8>; 2],
    /// The least of each column's costs.
    lowest: Vec<u8>,
}

impl Paths {
    pub(crate) fn new(width: usize, slots: usize, order: Order, penalties: &Penalties) -> Self {
        let mut blank = vec![u8::MAX; slots + 2 * MARGIN];
        blank[MARGIN..MARGIN + slots].fill(0);
        let columns = || blank.repeat(width);
        Self {
            slots,
            order,
            small: penalties.small,
            large: penalties.by_difference(),
            side: [blank.clone(), blank.clone()],
            columns: [columns(), columns()],
            lowest: vec![0; width],
        }
    }

    /// Follows both paths through the next row. `means` gets the mean of their costs: [x][index].
    pub(crate) fn follow(&mut self, row: PathRow<'_>, means: &mut [u8]) {
        on_widest(BothPaths { paths: self, row, means });
        self.columns.swap(0, 1);
    }

    /// Follows the paths along columns alone.
    pub(crate) fn follow_columns(&mut self, row: PathRow<'_>) {
        on_widest(ColumnPaths { paths: self, row });
        self.columns.swap(0, 1);
    }
}

/// A path's costs at one pixel and at the next.
struct Step<'a> {
    before: &'a [u8],
    after: &'a mut [u8],
    small: u8,
    /// The least cost before.
    lowest: u8,
    /// What the large penalty makes of it.
    jump: u8,
}

impl<'a> Step<'a> {
    /// Costs before of one disparity less, of the same, and of one more.
    #[inline(always)]
    fn neighbours(&self, slots: usize) -> [&'a [Bytes]; 3] {
        [MARGIN - 1, MARGIN, MARGIN + 1].map(|at| pieces(&self.before[at..at + slots]))
    }

    #[inline(always)]
    fn extend(&self, costs: &Bytes, [less, same, more]: [&Bytes; 3]) -> Bytes {
        std::array::from_fn(|lane| {
            let changed = less[lane].min(more[lane]).saturating_add(self.small);
            let least = same[lane].min(changed).min(self.jump);
            costs[lane].saturating_add(least.wrapping_sub(self.lowest))
        })
    }
}

/// The work of a row with both paths.
struct BothPaths<'a> {
    paths: &'a mut Paths,
    row: PathRow<'a>,
    means: &'a mut [u8],
}

impl WithSimd for BothPaths<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { paths, row, means } = self;
        let (slots, width) = (paths.slots, row.pixels.len());
        let stride = slots + 2 * MARGIN;
        let [columns_before, columns_after] = &mut paths.columns;
        let [side, side_next] = &mut paths.side;
        let (mut before, mut after) = (side, side_next);
        before[MARGIN..MARGIN + slots].fill(0);
        let mut lowest = 0u8;
        let mut last = None;
        for step in 0..width {
            let x = if paths.order == Order::Forward { step } else { width - 1 - step };
            let pixel = row.pixels[x];
            let beside = pixel.abs_diff(row.pixels[last.unwrap_or(x)]);
            let above = pixel.abs_diff(row.pixels_before[x]);
            let small = paths.small;
            let mut along = Step {
                before: &before[..],
                after: &mut after[..],
                small,
                lowest,
                jump: lowest.saturating_add(paths.large[usize::from(beside)]),
            };
            let mut down = Step {
                before: &columns_before[x * stride..(x + 1) * stride],
                after: &mut columns_after[x * stride..(x + 1) * stride],
                small,
                lowest: paths.lowest[x],
                jump: paths.lowest[x].saturating_add(paths.large[usize::from(above)]),
            };
            let here = x * slots..(x + 1) * slots;
            (lowest, paths.lowest[x]) =
                extend_both(&row.costs[here.clone()], &mut along, &mut down, &mut means[here]);
            std::mem::swap(&mut before, &mut after);
            last = Some(x);
        }
    }
}

/// Extends two paths by one pixel. Returns the least cost of each.
#[inline(always)]
fn extend_both(
    costs: &[u8],
    along: &mut Step<'_>,
    down: &mut Step<'_>,
    means: &mut [u8],
) -> (u8, u8) {
    let slots = costs.len();
    let (mut lowest_along, mut lowest_down) = ([u8::MAX; LANES], [u8::MAX; LANES]);
    let costs = pieces::<u8, LANES>(costs);
    let (beside, above) = (along.neighbours(slots), down.neighbours(slots));
    for (k, means) in pieces_mut::<u8, LANES>(means).iter_mut().enumerate() {
        let a = along.extend(&costs[k], beside.map(|part| &part[k]));
        let b = down.extend(&costs[k], above.map(|part| &part[k]));
        lowest_along = lanes(lowest_along, a, u8::min);
        lowest_down = lanes(lowest_down, b, u8::min);
        *means = lanes(a, b, mean);
        let at = MARGIN + k * LANES;
        along.after[at..at + LANES].copy_from_slice(&a);
        down.after[at..at + LANES].copy_from_slice(&b);
    }
    (least(&lowest_along), least(&lowest_down))
}

/// The work of a row with the paths along columns.
struct ColumnPaths<'a> {
    paths: &'a mut Paths,
    row: PathRow<'a>,
}

impl WithSimd for ColumnPaths<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { paths, row } = self;
        let slots = paths.slots;
        let stride = slots + 2 * MARGIN;
        let [before, after] = &mut paths.columns;
        let states = before.chunks_exact(stride).zip(after.chunks_exact_mut(stride));
        for ((x, (before, after)), lowest) in states.enumerate().zip(&mut paths.lowest) {
            let difference = row.pixels[x].abs_diff(row.pixels_before[x]);
            let jump = lowest.saturating_add(paths.large[usize::from(difference)]);
            let step = Step { before, after, small: paths.small, lowest: *lowest, jump };
            let neighbours = step.neighbours(slots);
            let costs = pieces::<u8, LANES>(&row.costs[x * slots..(x + 1) * slots]);
            let mut least_costs = [u8::MAX; LANES];
            for (k, costs) in costs.iter().enumerate() {
                let extended = step.extend(costs, neighbours.map(|part| &part[k]));
                least_costs = lanes(least_costs, extended, u8::min);
                let at = MARGIN + k * LANES;
                step.after[at..at + LANES].copy_from_slice(&extended);
            }
            *lowest = least(&least_costs);
        }
    }
}
