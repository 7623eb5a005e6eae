//! How far a pair is from being rectified: by how many rows its pictures are beside each other.
//!
//! Corners of the left picture, one a cell of a grid, are looked for in the right one along the row and some rows up and
//! down. Those count whose best place is clearly better than any other (Lowe 2004,
//! doi:10.1023/B:VISI.0000029664.99615.94, section 7.1). Halved pictures tell of more rows.

use crate::{
    error::MatchError,
    offset_pattern::{Offsets, TERMS},
    picture::Picture,
    search_range::SearchRange,
};
use rayon::prelude::*;
use std::{fmt, ops::Range};
use wheatstone_numeric::statistics::{median, percentile, root_mean_square};

/// Rows up and down where a corner is looked for.
const ROWS: isize = 6;
/// Pixels from a window's centre to its side.
const RADIUS: isize = 4;
/// Cells of the grid, at most.
const MOST_CELLS: usize = 400;
/// Pixels of a cell's side, at least.
const LEAST_CELL: usize = 32;
/// A corner's least variance along rows and columns, as sums over the window of squared differences: 2 grey levels a pixel.
const LEAST_CORNER: i64 = 4 * (2 * RADIUS as i64 + 1).pow(2);
/// The least correlation of a match, and by how much it must exceed any other's.
const LEAST_CORRELATION: f32 = 0.8;
const LEAST_LEAD: f32 = 0.1;
/// More than half of the offsets must lie within this of one pattern, in pixels.
const MOST_DIFFERENCE: f64 = 1.0;
/// Fewer matches say nothing, and neither do those of less than a fifth of the corners.
const LEAST_MATCHES: usize = 8;
/// The part of the height that a camera may have moved by when nothing is found within [`ROWS`].
const MOST_ROWS: f64 = 0.05;
/// Sound pairs have less at their sides, in pixels: of ten published ones up to 0.3, of rendered ones up to 0.07. A camera that
/// was turned about its axis by 0.2 degrees has 0.8, and depths that err by ten standard deviations.
const MOST_SOUND: f32 = 0.4;
/// And by so many standard deviations of the offset itself.
const CLEARLY: f32 = 3.0;

/// How many rows lower the right picture shows things.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VerticalOffset {
    /// The median, in pixels. A pair that is rectified well has less than half a pixel.
    pub median: f32,
    /// The median of its size, higher or lower, in pixels.
    pub median_size: f32,
    /// Nineteen in twenty corners have less by what they have in common, higher or lower, in pixels.
    pub largest: f32,
    /// The standard deviation of these, by how much corners scatter and how many there are, in pixels.
    pub sigma: f32,
    /// The number of corners that these are of.
    pub corners: usize,
}

impl VerticalOffset {
    /// Whether it is more than sound cameras have whose epipolar lines are off by `expected` pixels anyway: places that
    /// such pairs tell are farther off than their standard deviations say.
    #[must_use]
    pub fn is_doubtful(&self, expected: f32) -> bool {
        self.largest > MOST_SOUND + expected + CLEARLY * self.sigma
    }
}

impl fmt::Display for VerticalOffset {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { median, median_size, largest, corners, .. } = self;
        write!(out, "the right picture shows things ")?;
        if *largest < 2.0 * median.abs() {
            let way = if *median > 0.0 { "lower" } else { "higher" };
            return write!(out, "{:.1} rows {way} (median of {corners} corners)", median.abs());
        }
        write!(
            out,
            "in other rows, {largest:.1} rows higher or lower at its sides (median of {corners} corners: {median_size:.1})"
        )
    }
}

/// A corner that both pictures of a pair show.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CornerOffset {
    /// x and y in the left picture, in pixels.
    pub left: [f64; 2],
    /// x on the left less x on the right, to a pixel.
    pub disparity: f64,
    /// By how many rows the right picture shows things lower there, by what all corners have in common: a constant, slopes
    /// along x and y, and their product, in pixels.
    pub lower: f64,
}

/// What corners say of a pair.
pub(crate) struct Corners {
    pub(crate) offset: VerticalOffset,
    /// Those that agree.
    pub(crate) agreeing: Vec<CornerOffset>,
}

/// Measures the vertical offset of a pair, for a range of disparities. None where too few corners are found again within 6 rows, or
/// where they disagree: the pictures show nothing in common, or no texture.
///
/// # Errors
///
/// Where pictures have two sizes, or the range is empty, too large or leads out of the picture everywhere.
pub fn vertical_offset(
    left: &Picture<'_>,
    right: &Picture<'_>,
    range: Range<i32>,
) -> Result<Option<VerticalOffset>, MatchError> {
    Ok(corner_offsets([left, right], range)?.map(|corners| corners.offset))
}

/// As [`vertical_offset`], with the corners.
pub(crate) fn corner_offsets(
    [left, right]: [&Picture<'_>; 2],
    range: Range<i32>,
) -> Result<Option<Corners>, MatchError> {
    let sizes = [left, right].map(|picture| (picture.width(), picture.height()));
    if sizes[0] != sizes[1] {
        return Err(MatchError::Sizes { left: sizes[0], right: sizes[1] });
    }
    SearchRange::parse(&range, left.width())?;
    Ok(Search { left, right, range, rows: ROWS }.offset())
}

/// As [`corner_offsets`], of pictures that may be some twentieth of their height off, to about a row.
pub(crate) fn large_corner_offsets(
    [left, right]: [&Picture<'_>; 2],
    range: Range<i32>,
) -> Option<Corners> {
    let pixels = [left, right].map(halved);
    let half = |side: usize| Picture::new(left.width() / 2, left.height() / 2, &pixels[side]).ok();
    let (left, right) = (half(0)?, half(1)?);
    let rows = ((MOST_ROWS * left.height() as f64) as isize).max(ROWS);
    let range = range.start.div_euclid(2)..range.end.div_euclid(2) + 1;
    let Corners { mut offset, mut agreeing } =
        Search { left: &left, right: &right, range, rows }.offset()?;
    let VerticalOffset { median, median_size, largest, sigma, .. } = &mut offset;
    [median, median_size, largest, sigma].into_iter().for_each(|rows| *rows *= 2.0);
    for corner in &mut agreeing {
        corner.left = corner.left.map(|at| 2.0 * at + 0.5);
        (corner.disparity, corner.lower) = (2.0 * corner.disparity, 2.0 * corner.lower);
    }
    Some(Corners { offset, agreeing })
}

/// The means of two by two pixels.
fn halved(picture: &Picture<'_>) -> Vec<u8> {
    let rows = (0..picture.height() / 2).map(|y| [2 * y, 2 * y + 1].map(|y| picture.row(y)));
    let row = |[upper, lower]: [&[u8]; 2]| -> Vec<u8> {
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        let sum = |(a, b): (&[u8; 2], &[u8; 2])| -> u16 {
            a.iter().chain(b).map(|&v| u16::from(v)).sum()
        };
        pairs.map(|both| ((sum(both) + 2_u16) / 4) as u8).collect()
    };
    rows.flat_map(row).collect()
}

/// The best corner of each cell, (x, y).
fn corners(picture: &Picture<'_>) -> Vec<(isize, isize)> {
    let (width, height) = (picture.width(), picture.height());
    let side = ((width * height / MOST_CELLS).isqrt()).max(LEAST_CELL);
    let cells: Vec<(usize, usize)> = (0..height)
        .step_by(side)
        .flat_map(|top| (0..width).step_by(side).map(move |from| (from, top)))
        .collect();
    let best = |&(from, top): &(usize, usize)| {
        let margin = (RADIUS + 1) as usize;
        let rows = top.max(margin)..(top + side).min(height.saturating_sub(margin));
        let columns = from.max(margin)..(from + side).min(width.saturating_sub(margin));
        let places = rows.step_by(2).flat_map(|y| columns.clone().step_by(2).map(move |x| (x, y)));
        let strengths = places.map(|(x, y)| (strength(picture, x, y), x as isize, y as isize));
        let (strength, x, y) = strengths.max()?;
        (strength > LEAST_CORNER).then_some((x, y))
    };
    cells.par_iter().filter_map(best).collect()
}

/// The smaller of the sums of squared differences along rows and along columns.
fn strength(picture: &Picture<'_>, x: usize, y: usize) -> i64 {
    let pixel = |x: usize, y: usize| i64::from(picture.row(y)[x]);
    let radius = RADIUS as usize;
    let (mut along, mut down) = (0, 0);
    for y in y - radius..=y + radius {
        for x in x - radius..=x + radius {
            along += (pixel(x + 1, y) - pixel(x - 1, y)).pow(2);
            down += (pixel(x, y + 1) - pixel(x, y - 1)).pow(2);
        }
    }
    along.min(down)
}

struct Search<'a> {
    left: &'a Picture<'a>,
    right: &'a Picture<'a>,
    range: Range<i32>,
    /// Rows up and down.
    rows: isize,
}

impl Search<'_> {
    /// What most corners agree on, if enough of them are found again.
    fn offset(&self) -> Option<Corners> {
        let corners = corners(self.left);
        let found = corners.par_iter().filter_map(|&(x, y)| {
            let (disparity, lower) = self.find((x, y))?;
            Some(([x as f64, y as f64], disparity, f64::from(lower)))
        });
        let found: Vec<([f64; 2], f64, f64)> = found.collect();
        if found.len() < LEAST_MATCHES.max(corners.len() / 5) {
            return None;
        }
        let size = [self.left.width(), self.left.height()];
        let offsets: Vec<_> = found.iter().map(|(at, _, lower)| (*at, *lower)).collect();
        let agreed = Offsets::new(&offsets, size).agreed(MOST_DIFFERENCE);
        let agreeing: Vec<_> = agreed
            .iter()
            .map(|corner| {
                let (left, disparity, _) = found[corner.index];
                CornerOffset { left, disparity, lower: corner.told }
            })
            .collect();
        let told: Vec<f64> = agreed.iter().map(|corner| corner.told).collect();
        let sizes: Vec<f64> = told.iter().map(|offset| offset.abs()).collect();
        let scatter: Vec<f64> = agreed.iter().map(|corner| corner.residual).collect();
        let degrees = agreed.len().saturating_sub(TERMS).max(1) as f64;
        let sigma = root_mean_square(&scatter) * (TERMS as f64 / degrees).sqrt();
        let offset = VerticalOffset {
            median: median(&told) as f32,
            median_size: median(&sizes) as f32,
            largest: percentile(&sizes, 0.95) as f32,
            sigma: sigma as f32,
            corners: found.len(),
        };
        (2 * agreed.len() > found.len()).then_some(Corners { offset, agreeing })
    }

    /// The disparity of a corner and how many rows lower it is found again, if it is found clearly.
    fn find(&self, (x, y): (isize, isize)) -> Option<(f64, f32)> {
        let columns: Vec<isize> =
            self.range.clone().map(|disparity| x - disparity as isize).collect();
        let scores: Vec<Vec<f32>> = (-self.rows..=self.rows)
            .map(|down| {
                columns.iter().map(|&there| self.score((x, y), (there, y + down))).collect()
            })
            .collect();
        let all = || {
            scores.iter().enumerate().flat_map(|(row, scores)| {
                scores.iter().enumerate().map(move |(index, &score)| (score, row, index))
            })
        };
        let (best, row, index) = all().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let others = all().filter(|other| other.1.abs_diff(row) > 1 || other.2.abs_diff(index) > 1);
        let second = others.map(|other| other.0).fold(-1.0, f32::max);
        let is_at_the_end = row == 0 || row + 1 == scores.len();
        if best < LEAST_CORRELATION || best - second < LEAST_LEAD || is_at_the_end {
            return None;
        }
        // The vertex of a parabola.
        let (above, below) = (scores[row - 1][index], scores[row + 1][index]);
        let curvature = 2.0 * best - above - below;
        let fraction = if curvature > 0.0 { 0.5 * (below - above) / curvature } else { 0.0 };
        Some(((x - columns[index]) as f64, row as f32 - self.rows as f32 + fraction))
    }

    /// The correlation of two windows; -1 where the one on the right leads out of the picture.
    fn score(&self, here: (isize, isize), there: (isize, isize)) -> f32 {
        let Some(right) = window(self.right, there) else { return -1.0 };
        let Some(left) = window(self.left, here) else { return -1.0 };
        let (mut l, mut r, mut ll, mut rr, mut lr) = (0i64, 0i64, 0i64, 0i64, 0i64);
        let mut count = 0;
        for (&a, &b) in left.zip(right).flat_map(|(left, right)| left.iter().zip(right)) {
            let (a, b) = (i64::from(a), i64::from(b));
            (l, r, ll, rr, lr) = (l + a, r + b, ll + a * a, rr + b * b, lr + a * b);
            count += 1;
        }
        let (left, right) = (count * ll - l * l, count * rr - r * r);
        let both = left as f32 * right as f32;
        if both > 0.0 { (count * lr - l * r) as f32 / both.sqrt() } else { 0.0 }
    }
}

/// The rows of a window, if it lies in the picture.
fn window<'a>(
    picture: &Picture<'a>,
    (x, y): (isize, isize),
) -> Option<impl Iterator<Item = &'a [u8]>> {
    let (width, height) = (picture.width() as isize, picture.height() as isize);
    let inside = |at: isize, end: isize| at >= RADIUS && at + RADIUS < end;
    let picture = *picture;
    (inside(x, width) && inside(y, height)).then(|| {
        (y - RADIUS..=y + RADIUS).map(move |row| {
            &picture.row(row as usize)[(x - RADIUS) as usize..=(x + RADIUS) as usize]
        })
    })
}
