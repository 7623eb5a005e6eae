//! Epipolar curves: where the right picture shows what the left one shows, when that is not one row.
//!
//! Behind flat ports, tubes and odd lenses no rectification brings what both cameras see into one row for every distance. What is
//! left over depends smoothly on the pixel and on the disparity, so that a coarse lattice holds it.

use crate::{error::MatchError, picture::Picture, search_range::SearchRange};
use rayon::prelude::*;
use std::{collections::VecDeque, ops::Range};

/// Pixels from one node of the lattice to the next, along x and y.
const STEP: usize = 16;
/// Nodes from the first disparity to the last.
const DEPTHS: usize = 8;

/// How much lower the right picture shows things, for every pixel of the left one and every disparity.
///
/// What the left picture shows at (x, y) with disparity d, the right one shows at (x - d, y + v(x, y, d)); all are in
/// pixels, y grows downwards. v is known on a lattice, every 16 pixels along x and y and at 8 disparities from
/// the first to the last, and linear in between.
///
/// ```
/// use wheatstone_stereo::EpipolarCurves;
///
/// // Two pixels lower at disparity 64, and as much higher at disparity 0.
/// let curves = EpipolarCurves::new((640, 480), 0..65, |_, _, d| Some((d - 32.0) / 16.0))?;
/// assert!((curves.at(100.0, 50.0, 48.0) - 1.0).abs() < 1e-5);
/// assert_eq!(curves.largest(), 2.0);
/// # Ok::<(), wheatstone_stereo::MatchError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct EpipolarCurves {
    /// (width, height) of the pictures.
    size: (usize, usize),
    range: Range<i32>,
    /// Nodes along x.
    columns: usize,
    /// v at every node, [row][column][depth], in pixels.
    nodes: Vec<f32>,
}

impl EpipolarCurves {
    /// Curves for pictures of a size (width, height) and a range of disparities. `v` gives the vertical difference at
    /// (x, y, disparity), all in pixels; where it is not known, the nearest node of the lattice that is known stands for it. It is zero if none is.
    ///
    /// # Errors
    ///
    /// Where the size or the range is empty, the range is too large or leads out of the picture everywhere, or a difference is not finite.
    pub fn new(
        size: (usize, usize),
        range: Range<i32>,
        v: impl Fn(f32, f32, f32) -> Option<f32> + Sync,
    ) -> Result<Self, MatchError> {
        let (width, height) = size;
        if width == 0 || height == 0 {
            return Err(MatchError::Empty);
        }
        SearchRange::parse(&range, width)?;
        // The last node is on the last pixel or behind it, and not the only one.
        let (columns, rows) = (width.div_ceil(STEP) + 1, height.div_ceil(STEP) + 1);
        let mut curves =
            Self { size, range, columns, nodes: vec![f32::NAN; rows * columns * DEPTHS] };
        let (first, spacing) = curves.depths();
        let mut nodes = std::mem::take(&mut curves.nodes);
        nodes.par_chunks_mut(DEPTHS).enumerate().try_for_each(|(node, values)| {
            let (x, y) = (node % columns * STEP, node / columns * STEP);
            for (depth, value) in values.iter_mut().enumerate() {
                let known = v(x as f32, y as f32, first + spacing * depth as f32);
                if known.is_some_and(|known| !known.is_finite()) {
                    return Err(MatchError::CurveValue { x, y });
                }
                *value = known.unwrap_or(f32::NAN);
            }
            Ok(())
        })?;
        fill(&mut nodes, [1, DEPTHS, columns * DEPTHS]);
        curves.nodes = nodes;
        Ok(curves)
    }

    /// The vertical difference at a pixel of the left picture and a disparity, in pixels. Beyond the picture and the range it stays
    /// as it is at their ends.
    #[must_use]
    pub fn at(&self, x: f32, y: f32, disparity: f32) -> f32 {
        let stride = self.columns * DEPTHS;
        let (row, lower) = place(y / STEP as f32, self.nodes.len() / stride);
        let (column, right) = place(x / STEP as f32, self.columns);
        let (first, spacing) = self.depths();
        let (depth, deeper) = place((disparity - first) / spacing, DEPTHS);
        let between = |first: f32, second: f32, share: f32| first + share * (second - first);
        let [above, below] = [row, row + 1].map(|row| {
            let [before, after] = [column, column + 1].map(|column| {
                let nodes = &self.nodes[row * stride + column * DEPTHS + depth..][..2];
                between(nodes[0], nodes[1], deeper)
            });
            between(before, after, right)
        });
        between(above, below, lower)
    }

    /// The largest vertical difference up or down, in pixels.
    #[must_use]
    pub fn largest(&self) -> f32 {
        self.nodes.iter().fold(0.0, |largest, v| largest.max(v.abs()))
    }

    /// How far curves lead from their rows, in pixels: the vertical difference, up or down, that 95 of 100 stay below.
    #[must_use]
    pub fn bend(&self) -> f32 {
        let mut sizes: Vec<f32> = self.nodes.iter().map(|v| v.abs()).collect();
        let most = (sizes.len() * 95 / 100).min(sizes.len() - 1);
        *sizes.select_nth_unstable_by(most, f32::total_cmp).1
    }

    /// Whether these are curves for pictures and for all disparities of a range.
    pub(crate) fn check(&self, left: &Picture<'_>, range: &Range<i32>) -> Result<(), MatchError> {
        let pictures = (left.width(), left.height());
        if self.size != pictures {
            return Err(MatchError::CurveSize { curves: self.size, pictures });
        }
        if range.start < self.range.start || range.end > self.range.end {
            let [curves, search] = [&self.range, range].map(|range| (range.start, range.end));
            return Err(MatchError::CurveRange { curves, search });
        }
        Ok(())
    }

    /// The curves of one row.
    pub(crate) fn row(&self, y: f32) -> CurveRow {
        let stride = self.columns * DEPTHS;
        let (row, t) = place(y / STEP as f32, self.nodes.len() / stride);
        let [above, below] = [row, row + 1].map(|row| &self.nodes[row * stride..][..stride]);
        let nodes = above.iter().zip(below).map(|(above, below)| above + t * (below - above));
        let (first, spacing) = self.depths();
        CurveRow { first, spacing, nodes: nodes.collect() }
    }

    /// The most that v changes by along the row and by along the disparity, in pixels per pixel.
    pub(crate) fn steepest(&self) -> [f32; 2] {
        let most = |pairs: &mut dyn Iterator<Item = (&f32, &f32)>| {
            pairs.fold(0.0, |most: f32, (a, b)| most.max((a - b).abs()))
        };
        let rows = || self.nodes.chunks_exact(self.columns * DEPTHS);
        let columns = || self.nodes.chunks_exact(DEPTHS);
        let along_x = most(&mut rows().flat_map(|row| row.iter().zip(&row[DEPTHS..])));
        let along_depth = most(&mut columns().flat_map(|column| column.iter().zip(&column[1..])));
        [along_x / STEP as f32, along_depth / self.depths().1]
    }

    /// The disparity of the first node, and how many pixels of disparity are between nodes.
    fn depths(&self) -> (f32, f32) {
        let Range { start, end } = self.range;
        // A range of a single disparity has nodes too.
        let length = (i64::from(end) - 1 - i64::from(start)).max(1);
        (start as f32, length as f32 / (DEPTHS - 1) as f32)
    }
}

/// Curves of one row of the left picture.
pub(crate) struct CurveRow {
    first: f32,
    spacing: f32,
    /// [column][depth]
    nodes: Vec<f32>,
}

impl CurveRow {
    /// v at a pixel and a disparity.
    #[inline(always)]
    pub(crate) fn at(&self, x: f32, disparity: f32) -> f32 {
        let (column, right) = place(x / STEP as f32, self.nodes.len() / DEPTHS);
        let (depth, deeper) = place((disparity - self.first) / self.spacing, DEPTHS);
        let [before, after] = [column, column + 1].map(|column| {
            let nodes = &self.nodes[column * DEPTHS + depth..][..2];
            nodes[0] + deeper * (nodes[1] - nodes[0])
        });
        before + right * (after - before)
    }
}

/// Between which of some nodes a place lies: the first of two, and how far it is towards the second, 0 to 1.
#[inline(always)]
fn place(at: f32, nodes: usize) -> (usize, f32) {
    let at = at.clamp(0.0, (nodes - 1) as f32);
    let node = (at as usize).min(nodes - 2);
    (node, at - node as f32)
}

/// Gives every unknown value that of the nearest known one, counted in steps along the axes; zero if there is none.
/// `strides` lead along each axis, the last of them the farthest.
fn fill(nodes: &mut [f32], strides: [usize; 3]) {
    let mut front: VecDeque<usize> = (0..nodes.len()).filter(|&at| !nodes[at].is_nan()).collect();
    let ends = [strides[1], strides[2], nodes.len()];
    while let Some(at) = front.pop_front() {
        for (stride, end) in strides.into_iter().zip(ends) {
            let place = at % end / stride;
            let before = (place > 0).then(|| at - stride);
            let after = (place + 1 < end / stride).then(|| at + stride);
            for next in before.into_iter().chain(after) {
                if nodes[next].is_nan() {
                    nodes[next] = nodes[at];
                    front.push_back(next);
                }
            }
        }
    }
    nodes.iter_mut().for_each(|v| *v = if v.is_nan() { 0.0 } else { *v });
}

#[cfg(test)]
mod tests {
    use super::EpipolarCurves;

    #[test]
    fn what_is_linear_comes_back() {
        let v = |x: f32, y: f32, d: f32| 0.01 * x - 0.02 * y + 0.05 * d - 1.0;
        let curves = EpipolarCurves::new((50, 33), -7..20, |x, y, d| Some(v(x, y, d))).unwrap();
        for (x, y, d) in
            [(0.0, 0.0, -7.0), (49.0, 32.0, 19.0), (17.3, 20.9, 3.4), (16.0, 16.0, 0.0)]
        {
            assert!((curves.at(x, y, d) - v(x, y, d)).abs() < 1e-5, "{x} {y} {d}");
        }
        assert_eq!(curves.at(10.0, 10.0, 90.0), curves.at(10.0, 10.0, 19.0));
        let [along_x, along_disparity] = curves.steepest();
        assert!((along_x - 0.01).abs() < 1e-5 && (along_disparity - 0.05).abs() < 1e-5);
    }

    #[test]
    fn what_is_not_known_is_as_beside_it() {
        let known = |x: f32, _: f32, d: f32| (x < 100.0 && d >= 4.0).then_some(x);
        let curves = EpipolarCurves::new((200, 40), 0..8, known).unwrap();
        assert_eq!(curves.at(160.0, 20.0, 0.0), 96.0);
        assert_eq!(curves.at(32.0, 0.0, 1.0), 32.0);
        let unknown = EpipolarCurves::new((1, 1), 0..1, |_, _, _| None).unwrap();
        assert_eq!((unknown.at(0.0, 0.0, 0.0), unknown.bend()), (0.0, 0.0));
    }
}
