//! Copies that the search cannot see.
//!
//! At the left border larger disparities lead out of the right picture. Where the texture repeats, all copies of a pixel
//! but one may lie there, and that one looks unique: the left picture itself tells, for a copy farther along the row shows
//! what a larger disparity would have shown.

use crate::{map::DisparityMap, picture::Picture, search_range::SearchRange, window::RADIUS};
use rayon::prelude::*;

/// Windows that correlate so much are copies. On Middlebury's and rendered pairs up to a quarter of a percent of the matches
/// have one beyond the border, with 0.8 up to two thirds.
const COPY: f32 = 0.9;
/// And between the two there is something that correlates less: elsewhere the texture is one that hardly changes.
const BETWEEN: f32 = 0.5;
/// A match with a copy is one of two, at best.
const OF_TWO: f32 = 0.5;

/// Halves the confidence of matches that have a copy at a disparity that leads out of the right picture.
pub(crate) fn doubt(map: &mut DisparityMap, left: &Picture<'_>, range: SearchRange) {
    let last = range.first + range.count as i32 - 1;
    let width = map.width;
    // The columns from which some disparity leads out.
    let columns = usize::try_from(last).unwrap_or(0).min(width);
    let (disparity, rows) = (&map.disparity, map.confidence.par_chunks_mut(width));
    rows.enumerate().for_each(|(y, confidence)| {
        let own = &disparity[y * width..][..columns];
        if y < RADIUS || y + RADIUS >= left.height() {
            return;
        }
        let copied = copied(left, y, own, last);
        for (confidence, copied) in confidence.iter_mut().zip(copied) {
            *confidence *= if copied { OF_TWO } else { 1.0 };
        }
    });
}

/// Which of the first pixels of a row have a copy farther right that stands for a disparity beyond the right picture.
fn copied(left: &Picture<'_>, y: usize, disparity: &[f32], last: i32) -> Vec<bool> {
    let columns = disparity.len();
    let mut all = vec![false; columns];
    let mut differs = vec![false; columns];
    let farthest = |x: usize| if disparity[x].is_nan() { 0.0 } else { last as f32 - disparity[x] };
    let most = (0..columns).map(farthest).fold(0.0, f32::max) as usize;
    // Farther copies lie beyond the left picture.
    let most = most.min(left.width() - 1);
    let sums = Sums::of(left, y);
    for shift in 1..=most {
        let products = Sums::products(left, (y, shift), columns + 2 * RADIUS);
        for x in 0..columns {
            let Some(likeness) = sums.likeness(&products, (x.max(RADIUS), shift)) else { continue };
            differs[x] |= likeness < BETWEEN;
            // No comparison with NaN holds.
            let is_beyond = shift as f32 > x as f32 - disparity[x] && shift as f32 <= farthest(x);
            all[x] |= is_beyond && differs[x] && likeness > COPY;
        }
    }
    all
}

/// Sums over the columns of the windows of a row, from the left border to before each column.
struct Sums {
    levels: Vec<i64>,
    squares: Vec<i64>,
}

impl Sums {
    fn of(left: &Picture<'_>, y: usize) -> Self {
        let up_to = |of: &dyn Fn(i64) -> i64| {
            let column = |x: usize| rows(y).map(|row| of(i64::from(left.row(row)[x]))).sum();
            cumulated((0..left.width()).map(column))
        };
        Self { levels: up_to(&|level| level), squares: up_to(&|level| level * level) }
    }

    /// Of the products of pixels with those so far to the right, of the first columns.
    fn products(left: &Picture<'_>, (y, shift): (usize, usize), columns: usize) -> Vec<i64> {
        let end = left.width().saturating_sub(shift).min(columns);
        let mut products = vec![0_i64; end];
        for row in rows(y) {
            let row = left.row(row);
            for (sum, (here, there)) in products.iter_mut().zip(row.iter().zip(&row[shift..])) {
                *sum += i64::from(u32::from(*here) * u32::from(*there));
            }
        }
        cumulated(products.into_iter())
    }

    /// The correlation of the window about a column with the one so far to the right; none beyond the picture.
    fn likeness(&self, products: &[i64], (x, shift): (usize, usize)) -> Option<f32> {
        const COUNT: i64 = ((2 * RADIUS + 1) * (2 * RADIUS + 1)) as i64;
        let within = |sums: &[i64], x: usize| Some(sums.get(x + RADIUS + 1)? - sums[x - RADIUS]);
        let (a, b) = (within(&self.levels, x)?, within(&self.levels, x + shift)?);
        let (aa, bb) = (within(&self.squares, x)?, within(&self.squares, x + shift)?);
        let both = COUNT * within(products, x)? - a * b;
        let power = (COUNT * aa - a * a) as f32 * (COUNT * bb - b * b) as f32;
        Some(if power > 0.0 { both as f32 / power.sqrt() } else { 1.0 })
    }
}

fn rows(y: usize) -> std::ops::RangeInclusive<usize> {
    y - RADIUS..=y + RADIUS
}

fn cumulated(values: impl Iterator<Item = i64>) -> Vec<i64> {
    let mut sum = 0;
    let before = |value: i64| {
        sum += value;
        sum
    };
    std::iter::once(0).chain(values.map(before)).collect()
}
