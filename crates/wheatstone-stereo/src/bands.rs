//! A picture in bands of rows, each matched on its own.
//!
//! The costs of all pixels and disparities of a large picture do not fit into memory. Paths down and up a
//! band begin some rows outside of it; farther pixels have next to no say. Bands follow from the pictures' size and the range
//! alone, so that results do not depend on the number of threads.

use crate::{
    aggregation::{Order, PathRow, Paths, Penalties},
    buffers::{Buffer, Pool, Pools},
    cost::{CodedPair, CostRows},
    field::Field,
    picture::Picture,
    winner::{Clarity, NO_MATCH, SearchRow, WinnerRow, Winners},
};
use rayon::prelude::*;
use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

/// Rows of a band, at most.
const MOST_ROWS: usize = 192;
/// Rows of a band, at least.
const LEAST_ROWS: usize = 64;
/// Rows above and below a band from where paths come.
const OVERLAP: usize = 16;
/// Memory that a band may take, in bytes, where its rows are not fewer than [`LEAST_ROWS`].
const BAND_BYTES: usize = 256 << 20;
/// Memory that all bands may take that are matched at one time.
const WORK_BYTES: usize = 1 << 30;

/// What the search finds, row by row: see [`WinnerRow`].
pub(crate) struct Candidates {
    pub(crate) disparity: Buffer<f32>,
    pub(crate) clarity: Vec<Clarity>,
    pub(crate) right: Vec<u16>,
}

/// One row of them.
pub(crate) struct CandidateRow<'a> {
    pub(crate) disparity: &'a [f32],
    pub(crate) clarity: &'a [Clarity],
    pub(crate) right: &'a [u16],
}

impl Candidates {
    /// The lead of every pixel, in a field.
    pub(crate) fn lead(&self, width: usize) -> Field {
        let size = (width, self.clarity.len() / width);
        let mut lead = Field::new(self.disparity.pool(), size, 0.0);
        let rows = lead.par_pixels_mut().zip(self.clarity.par_chunks(width));
        rows.for_each(|(lead, clarity)| {
            for (lead, clarity) in lead.iter_mut().zip(clarity) {
                *lead = f32::from(clarity.lead);
            }
        });
        lead
    }

    pub(crate) fn row(&self, y: usize, width: usize) -> CandidateRow<'_> {
        let at = y * width..(y + 1) * width;
        CandidateRow {
            disparity: &self.disparity[at.clone()],
            clarity: &self.clarity[at.clone()],
            right: &self.right[at],
        }
    }
}

/// A band and where its results go.
struct Band<'a> {
    rows: Range<usize>,
    disparity: &'a mut [f32],
    clarity: &'a mut [Clarity],
    right: &'a mut [u16],
}

/// Searches all pixels.
pub(crate) fn search(
    pair: CodedPair<'_>,
    left: &Picture<'_>,
    penalties: &Penalties,
    pools: &Pools,
) -> Candidates {
    let (width, height) = (pair.width, pair.height);
    let mut found = Candidates {
        disparity: pools.floats.filled(width * height, f32::NAN),
        clarity: vec![Clarity::default(); width * height],
        right: vec![NO_MATCH; width * height],
    };
    // A band keeps costs and means of paths: two bytes a pixel and disparity.
    let row_bytes = 2 * width * pair.range.slots;
    let rows = rows_of_a_band(height, row_bytes);
    let at_a_time = (WORK_BYTES / (rows * row_bytes)).max(1);
    let pixels = rows * width;
    let parts = found.disparity.chunks_mut(pixels).zip(found.clarity.chunks_mut(pixels));
    let parts = parts.zip(found.right.chunks_mut(pixels)).enumerate();
    let bands: Vec<Band<'_>> = parts
        .map(|(number, ((disparity, clarity), right))| {
            let start = number * rows;
            Band { rows: start..start + clarity.len() / width, disparity, clarity, right }
        })
        .collect();
    let workers = at_a_time.min(bands.len()).min(rayon::current_num_threads());
    let bands = Mutex::new(bands.into_iter());
    // A lock that is held only to take the next band cannot be left in between.
    let next = || bands.lock().unwrap_or_else(PoisonError::into_inner).next();
    (0..workers).into_par_iter().for_each(|_| {
        let mut memory = Memory::new(pair, rows, &pools.bytes);
        while let Some(mut band) = next() {
            band.search(left, penalties, &mut memory);
        }
    });
    found
}

/// Bands of one height, an even number of them, as processors have an even number of cores.
fn rows_of_a_band(height: usize, row_bytes: usize) -> usize {
    let most = (BAND_BYTES / row_bytes).clamp(LEAST_ROWS, MOST_ROWS);
    let bands = height.div_ceil(most);
    let bands = if bands > 1 { bands.next_multiple_of(2) } else { bands };
    height.div_ceil(bands)
}

/// What a thread needs to search one band after the other.
struct Memory<'a> {
    pair: CodedPair<'a>,
    rows: CostRows<'a>,
    /// Costs of a band, [row][x][index].
    costs: Buffer<u8>,
    /// Means of the paths that lead forward.
    forward: Buffer<u8>,
    /// The same of one row: costs outside of the band, or means of the paths that lead backward.
    outside: Vec<u8>,
}

impl<'a> Memory<'a> {
    fn new(pair: CodedPair<'a>, rows: usize, pool: &Pool<u8>) -> Self {
        let length = pair.width * pair.range.slots;
        let [costs, forward] = [(); 2].map(|()| pool.any(rows.min(pair.height) * length));
        Self { pair, rows: CostRows::new(pair), costs, forward, outside: vec![0; length] }
    }
}

impl Band<'_> {
    fn search(&mut self, left: &Picture<'_>, penalties: &Penalties, memory: &mut Memory<'_>) {
        let Memory { pair, rows, costs, forward, outside } = memory;
        let (width, slots) = (pair.width, pair.range.slots);
        let length = width * slots;
        let start = self.rows.start;

        let mut paths = Paths::new(width, slots, Order::Forward, penalties);
        for y in start.saturating_sub(OVERLAP)..start {
            rows.write(y, outside);
            paths.follow_columns(path_row(left, outside, y, y.saturating_sub(1)));
        }
        let both = costs.chunks_exact_mut(length).zip(forward.chunks_exact_mut(length));
        for (y, (costs, means)) in self.rows.clone().zip(both) {
            rows.write(y, costs);
            paths.follow(path_row(left, costs, y, y.saturating_sub(1)), means);
        }

        let last = pair.height - 1;
        let mut paths = Paths::new(width, slots, Order::Backward, penalties);
        for y in (self.rows.end..(self.rows.end + OVERLAP).min(pair.height)).rev() {
            rows.write(y, outside);
            paths.follow_columns(path_row(left, outside, y, (y + 1).min(last)));
        }
        let mut winners = Winners::new(width, pair.range);
        let both = costs.chunks_exact(length).zip(forward.chunks_exact(length));
        for (y, (costs, forward)) in self.rows.clone().zip(both).rev() {
            paths.follow(path_row(left, costs, y, (y + 1).min(last)), outside);
            let row = SearchRow { forward, backward: outside, costs };
            winners.find(row, self.row(y - start, width));
        }
    }

    fn row(&mut self, row: usize, width: usize) -> WinnerRow<'_> {
        let at = row * width..(row + 1) * width;
        WinnerRow {
            disparity: &mut self.disparity[at.clone()],
            clarity: &mut self.clarity[at.clone()],
            right: &mut self.right[at],
        }
    }
}

fn path_row<'a>(left: &Picture<'a>, costs: &'a [u8], y: usize, before: usize) -> PathRow<'a> {
    PathRow { costs, pixels: left.row(y), pixels_before: left.row(before) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_the_picture_and_fit_into_memory() {
        for height in 1..3000 {
            for row_bytes in [64, 82_000, 2 << 20, 16 << 20] {
                let rows = rows_of_a_band(height, row_bytes);
                assert!((1..=MOST_ROWS).contains(&rows));
                assert!(rows <= LEAST_ROWS || rows * row_bytes <= BAND_BYTES);
            }
        }
        assert_eq!(rows_of_a_band(480, 82_000), 120);
    }
}
