//! The right picture's codes in the order in which the pixels of a row search them.
//!
//! Without curves the candidates of a pixel lie in its own row. Curves lead them through several, and between them: every
//! candidate then comes from the quarter row that is nearest to its curve. Pixels beside each other share most of their candidates,
//! so a block of them is served at a time, as long as curves are nearly the same for all of it.

use crate::{
    buffers::Pool, census::Codes, curves::CurveRow, pair::Pair, quarter_rows::QuarterRows,
    search_range::SearchRange,
};
use std::ops::Range;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// The most that curves may change by along what is treated as one, in pixels: half of it from the middle to the ends.
const MOST_CHANGE: f32 = 0.5;
/// Pixels of a block, at most.
const MOST_BLOCK: f32 = 64.0;

/// Codes of the right picture.
pub(crate) enum RightCodes<'a> {
    /// Of its rows.
    Rows(Codes),
    /// Of its quarter rows.
    Curves(QuarterRows<'a>),
}

impl<'a> RightCodes<'a> {
    pub(crate) fn new(pair: &Pair<'a>, pool: &Pool<u8>) -> Self {
        match pair.curves {
            None => Self::Rows(Codes::new(pair.right, pool)),
            Some(curves) => Self::Curves(QuarterRows::new(pair.right, curves, pool)),
        }
    }
}

/// The candidates of a row, a block of pixels at a time.
pub(crate) struct CandidateRow<'a> {
    right: &'a RightCodes<'a>,
    width: usize,
    range: SearchRange,
    y: usize,
    curve: Option<CurveRow>,
    /// Pixels of a stretch, which share their curves.
    stretch: usize,
    /// Pixels of a block, at most: a candidate has one disparity for all of them.
    block: usize,
    /// Where in the codes the curves of a stretch lead, from half a block before the first disparity on.
    rows: Vec<usize>,
    /// From right to left: candidate k of pixel x stands at `width - 1 - x + k`.
    codes: [Vec<u8>; 4],
}

impl<'a> CandidateRow<'a> {
    pub(crate) fn new(right: &'a RightCodes<'a>, width: usize, range: SearchRange) -> Self {
        let (mut stretch, mut block) = (width, width);
        if let RightCodes::Curves(rows) = right {
            [stretch, block] = rows
                .curves
                .steepest()
                .map(|steepest| (MOST_CHANGE / steepest).clamp(1.0, MOST_BLOCK) as usize);
        }
        let codes = std::array::from_fn(|_| vec![0; width + range.slots]);
        Self { right, width, range, y: 0, curve: None, stretch, block, rows: Vec::new(), codes }
    }

    /// Turns to another row.
    pub(crate) fn turn_to(&mut self, y: usize) {
        self.y = y;
        self.curve = match self.right {
            RightCodes::Rows(_) => None,
            RightCodes::Curves(rows) => Some(rows.curves.row(y as f32)),
        };
    }

    /// The blocks of a row, from left to right.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let (width, stretch, block) = (self.width, self.stretch, self.block);
        (0..width).step_by(stretch).flat_map(move |start| {
            let end = (start + stretch).min(width);
            (start..end).step_by(block).map(move |x| x..(x + block).min(end))
        })
    }

    /// The candidates of the next block: see [`Self::codes`]. What leads out of the picture's sides is any code.
    pub(crate) fn of_block(&mut self, block: Range<usize>) -> &[Vec<u8>; 4] {
        let right = self.right;
        if let RightCodes::Curves(quarters) = right
            && block.start.is_multiple_of(self.stretch)
        {
            self.find_rows(quarters, block.start);
        }
        let inside = |x: i64| x.clamp(0, self.width as i64) as usize;
        let (first, slots) = (i64::from(self.range.first), self.range.slots as i64);
        // Where candidates lie in the right picture: x - first - k.
        let there =
            inside(block.start as i64 - first - slots + 1)..inside(block.end as i64 - first);
        if there.is_empty() {
            return &self.codes;
        }
        // A candidate's x and its place in `codes` add up to this.
        let sum = self.width as i64 - 1 - first;
        let places = (sum - there.end as i64 + 1) as usize..(sum - there.start as i64 + 1) as usize;
        let out = self.codes.each_mut().map(|plane| &mut plane[places.clone()]);
        match right {
            RightCodes::Rows(codes) => {
                let planes = codes.row(self.y, self.width).map(|plane| &plane[there.clone()]);
                for (out, plane) in out.into_iter().zip(planes) {
                    out.iter_mut().zip(plane.iter().rev()).for_each(|(out, &code)| *out = code);
                }
            }
            RightCodes::Curves(quarters) => {
                // The rows are right for the pixel in the middle.
                let middle = self.width - block.end + block.len() / 2;
                let rows = &self.rows[places.start + self.block / 2 - middle..][..there.len()];
                on_widest(Gather { codes: &quarters.codes, rows, last: there.end - 1, out });
            }
        }
        &self.codes
    }

    /// Finds where the curves of a stretch lead.
    fn find_rows(&mut self, quarters: &QuarterRows<'_>, start: usize) {
        let Some(curve) = &self.curve else { return };
        let middle = 0.5 * (start + (start + self.stretch).min(self.width) - 1) as f32;
        let first = self.range.first as f32 - (self.block / 2) as f32;
        self.rows.clear();
        self.rows.extend(
            (0..self.range.slots + self.block)
                .map(|k| quarters.nearest(self.y as f32 + curve.at(middle, first + k as f32))),
        );
    }
}

/// Takes every code of a block from its own row, from right to left.
struct Gather<'a> {
    codes: &'a [[u8; 4]],
    /// Where rows begin.
    rows: &'a [usize],
    /// The first code's place in its row.
    last: usize,
    out: [&'a mut [u8]; 4],
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        const PIECE: usize = 32;
        let mut out = self.out.map(|plane| plane.chunks_mut(PIECE));
        let mut last = self.last;
        for rows in self.rows.chunks(PIECE) {
            let mut found = [[0; 4]; PIECE];
            for (k, (found, row)) in found.iter_mut().zip(rows).enumerate() {
                *found = self.codes[row + last - k];
            }
            last = last.saturating_sub(PIECE);
            for (plane, out) in out.iter_mut().enumerate() {
                let Some(out) = out.next() else { return };
                let codes: [u8; PIECE] = std::array::from_fn(|k| found[k][plane]);
                out.copy_from_slice(&codes[..out.len()]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{curves::EpipolarCurves, picture::Picture};

    const WIDTH: usize = 45;
    const HEIGHT: usize = 20;
    /// The row of the left picture.
    const Y: usize = 5;

    /// Calls `see` for every pixel, index of a disparity within the right picture, and code of the candidate.
    fn for_each_candidate(
        curves: Option<&EpipolarCurves>,
        pixels: &[u8],
        range: SearchRange,
        see: impl Fn(usize, usize, [u8; 4]),
    ) {
        let picture = Picture::new(WIDTH, HEIGHT, pixels).unwrap();
        let codes =
            RightCodes::new(&Pair { left: &picture, right: &picture, curves }, &Pool::default());
        let mut row = CandidateRow::new(&codes, WIDTH, range);
        row.turn_to(Y);
        let mut next = 0;
        for block in row.blocks() {
            assert_eq!(block.start, next);
            next = block.end;
            let found = row.of_block(block.clone());
            for (x, k) in block.flat_map(|x| range.inside(x, WIDTH).map(move |k| (x, k))) {
                see(x, k, found.each_ref().map(|plane| plane[WIDTH - 1 - x + k]));
            }
        }
        assert_eq!(next, WIDTH);
    }

    #[test]
    fn candidates_lie_in_the_row_or_where_curves_lead() {
        let pixels: Vec<u8> = (0..WIDTH * HEIGHT).map(|at| (at * at % 251) as u8).collect();
        let picture = Picture::new(WIDTH, HEIGHT, &pixels).unwrap();
        for range in [-12..3, 0..40, 20..60, -44..-20] {
            let searched = SearchRange::parse(&range, WIDTH).unwrap();
            let there =
                |x: usize, k: usize| (x as i64 - i64::from(range.start) - k as i64) as usize;
            let rows = Codes::new(&picture, &Pool::default());
            for_each_candidate(None, &pixels, searched, |x, k, code| {
                assert_eq!(code, rows.row(Y, WIDTH).map(|plane| plane[there(x, k)]));
            });
            // Blocks as long as stretches, shorter, and of one pixel.
            for (per_x, per_disparity) in [(0.2, 0.1), (0.01, 0.2), (0.5, 0.6), (-0.02, 0.0)] {
                let v = |x: f32, d: f32| per_disparity * d + per_x * (x - 20.0);
                let (size, range) = ((WIDTH, HEIGHT), range.clone());
                let curves = EpipolarCurves::new(size, range, |x, _, d| Some(v(x, d))).unwrap();
                let quarters = QuarterRows::new(&picture, &curves, &Pool::default());
                for_each_candidate(Some(&curves), &pixels, searched, |x, k, code| {
                    let y = Y as f32 + v(x as f32, (searched.first + k as i32) as f32);
                    // Half of what a block and a stretch may change by, each.
                    let near = [-0.5, -0.25, 0.0, 0.25, 0.5].map(|by| quarters.nearest(y + by));
                    let there = there(x, k);
                    assert!(near.iter().any(|row| quarters.codes[row + there] == code), "{x} {k}");
                });
            }
        }
    }
}
