//! Where a rectified picture takes its pixels from.

use super::{Rectification, VirtualPair, maps::Maps};
use crate::geometry::Pixel;
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;

/// For each pixel of a virtual camera's picture, row by row, the place in the model's picture that it
/// shows: what OpenCV's `remap` takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The place's x in pixels, (0, 0) the centre of the top-left pixel; [`Table::NOWHERE`] for nothing.
    pub x: Vec<f32>,
    /// The place's y.
    pub y: Vec<f32>,
    /// The share of the table's pixels that show something.
    pub filled: f64,
    /// The share of those that lie in the part of the picture that the model was shown.
    pub shown: f64,
}

impl Table {
    /// What stands for no place: outside of every picture, so that OpenCV puts its border there.
    pub const NOWHERE: f32 = -1.0;

    /// Of the left (0) or right (1) virtual camera.
    pub(super) fn of(made: &Rectification, side: usize) -> Self {
        let [width, height] = made.pair.size.map(|side| side as usize);
        let source = made.sources[side];
        let row = |y: usize| -> Vec<Option<Pixel>> {
            let at = |x: usize| made.source(side, Pixel::new(x as f64, y as f64));
            (0..width).map(at).collect()
        };
        let places: Vec<Option<Pixel>> = (0..height).into_par_iter().flat_map_iter(row).collect();
        let grid = &made.grids[side];
        let holds = |region: &[[f64; 2]; 2], at: Pixel| {
            (0..2).all(|axis| at[axis] >= region[axis][0] && at[axis] <= region[axis][1])
        };
        // Beyond what a model knows it may fold its picture over: what is turned round shows nothing.
        let unfolded = |index: usize, at: Pixel| {
            let beside = |ahead: bool, step: usize| {
                let other = if ahead { index.checked_add(step) } else { index.checked_sub(step) }?;
                let change = places.get(other).copied().flatten()? - at;
                Some(if ahead { change } else { -change })
            };
            let across = beside(index % width + 1 < width, 1);
            let down = beside(index / width + 1 < height, width);
            across.zip(down).is_some_and(|(across, down)| across.perp(&down) * grid.hand > 0.0)
        };
        let (mut x, mut y) = (vec![Self::NOWHERE; places.len()], vec![Self::NOWHERE; places.len()]);
        let (mut filled, mut shown) = (0, 0);
        for (index, place) in places.iter().enumerate() {
            let here = Pixel::new((index % width) as f64, (index / width) as f64);
            let held = place.filter(|at| {
                holds(&source.picture, *at) && unfolded(index, *at) && grid.holds(here)
            });
            let Some(at) = held else { continue };
            (x[index], y[index]) = (at.x as f32, at.y as f32);
            filled += 1;
            shown += usize::from(holds(&source.shown, at));
        }
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        Self {
            width,
            height,
            x,
            y,
            filled: share(filled, places.len()),
            shown: share(shown, filled),
        }
    }
}

/// A coarse table, from which the way back is begun, and which knows where the map folds over.
pub(super) struct Grid {
    /// What each node shows; none beyond a fold, as seen from the middle.
    shows: Vec<Option<Pixel>>,
    /// Distance of nodes along x and y, in rectified pixels.
    step: [f64; 2],
    /// 1 where the table keeps the sense of turning, -1 where it shows a mirrored picture.
    hand: f64,
}

/// Cells along each side of the picture, and how many more there are around it.
const CELLS: usize = 20;
const AROUND: usize = 6;

/// Nodes a row, and a column.
const NODES: usize = CELLS + 2 * AROUND + 1;

impl Grid {
    pub(super) fn of(maps: &Maps, pair: &VirtualPair, side: usize) -> Self {
        let step = pair.size.map(|size| f64::from(size) / CELLS as f64);
        let shows = |at: Pixel| maps.project(side, pair.place(side, at));
        let turn = |at: Pixel| slopes(at, shows).map(|slopes| slopes.determinant());
        let middle = NODES * (NODES / 2) + NODES / 2;
        let hand = if turn(node(middle, step)).is_some_and(|turn| turn < 0.0) { -1.0 } else { 1.0 };
        // Spreads from the middle over what is not turned round.
        let mut found: Vec<Option<Pixel>> = vec![None; NODES * NODES];
        let mut next = vec![middle];
        while let Some(index) = next.pop() {
            let at = node(index, step);
            let unfolded = turn(at).is_some_and(|turn| turn * hand > 0.0);
            if found[index].is_some() || !unfolded {
                continue;
            }
            found[index] = shows(at);
            let (column, row) = (index % NODES, index / NODES);
            next.extend((column > 0).then(|| index - 1));
            next.extend((column + 1 < NODES).then_some(index + 1));
            next.extend((row > 0).then(|| index.saturating_sub(NODES)));
            next.extend((row + 1 < NODES).then_some(index + NODES));
        }
        Self { shows: found, step, hand }
    }

    /// Whether a pixel of the picture lies on the near side of all folds, by the nodes about it.
    fn holds(&self, at: Pixel) -> bool {
        let cell =
            [0, 1].map(|axis| (at[axis] / self.step[axis]).floor().max(0.0) as usize + AROUND);
        let corner = |x: usize, y: usize| {
            self.shows.get((cell[1] + y) * NODES + cell[0] + x).is_some_and(Option::is_some)
        };
        corner(0, 0) || corner(1, 0) || corner(0, 1) || corner(1, 1)
    }

    /// Where `shows` gives `pixel`, sought from the nearest node.
    pub(super) fn invert(
        &self,
        pixel: Pixel,
        shows: impl Fn(Pixel) -> Option<Pixel>,
    ) -> Option<Pixel> {
        const STEPS: usize = 30;
        let far = |(index, shown): (usize, &Option<Pixel>)| {
            Some((((*shown)? - pixel).norm_squared(), index))
        };
        let nodes = self.shows.iter().enumerate().filter_map(far);
        let mut at = node(nodes.min_by(|a, b| a.0.total_cmp(&b.0))?.1, self.step);
        let mut off = pixel - shows(at)?;
        for _ in 0..STEPS {
            // A ten-thousandth of what the tables themselves resolve.
            if off.norm() < 1e-9 {
                break;
            }
            let mut step: Vector2<f64> = slopes(at, &shows)?.try_inverse()? * off;
            // Halved until it helps: far from the place the lens is not linear.
            let better = (0..10).find_map(|_| {
                let (moved, tried) = (at + step, step);
                step = tried / 2.0;
                let left = pixel - shows(moved)?;
                (left.norm() < off.norm()).then_some((moved, left))
            });
            let Some(found) = better else { break };
            (at, off) = found;
        }
        (off.norm() < 1e-6).then_some(at)
    }
}

/// Where a node lies in the rectified picture.
fn node(index: usize, step: [f64; 2]) -> Pixel {
    let along = |place: usize, step: f64| (place as f64 - AROUND as f64) * step;
    Pixel::new(along(index % NODES, step[0]), along(index / NODES, step[1]))
}

/// How the place that is shown changes with the pixel that shows it.
fn slopes(at: Pixel, shows: impl Fn(Pixel) -> Option<Pixel>) -> Option<Matrix2<f64>> {
    const STEP: f64 = 0.05;
    let by = |x: f64, y: f64| {
        let step = Vector2::new(x, y);
        Some((shows(at + step)? - shows(at - step)?) / (2.0 * STEP))
    };
    Some(Matrix2::from_columns(&[by(STEP, 0.0)?, by(0.0, STEP)?]))
}
