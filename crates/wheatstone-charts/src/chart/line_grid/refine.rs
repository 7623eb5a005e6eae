//! Crossings to a hundredth of a pixel: where two smooth curves through the lines' middles meet.

use super::{
    grid::{Grid, Label, Node, SIDES, crosswise, onward},
    growth::{Look, Station, disturbed, follow, spread},
    level::View,
};
use nalgebra::{DMatrix, Matrix2, Vector2};
use std::collections::BTreeMap;
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::{least_squares::solve, statistics::median};

/// Stations along each line between two crossings.
const STATIONS: usize = 12;
/// See [`Look::settled`].
const EXACTLY: f64 = 0.1;
/// How far from a crossing stations count, in pixels, where lines go on to both sides and where
/// they end: enough of them against noise, few enough that a parabola fits a warped line.
const SPANS: [f64; 2] = [25.0, 60.0];
/// In pixels: what is left without noise (0.0017 px for noise of half a grey level), measured on rendered grids.
const OWN_FAULT: f64 = 0.0015;
/// Largest variance of a curve at its crossing, in those of one station. A line that ends there
/// comes to 2, one that is cut short by the picture's border to 10 and more.
const MOST_VARIANCE: f64 = 4.0;
/// The least such distance, in pitches.
const LEAST_SPANS: [f64; 2] = [0.5, 0.85];

/// Lines between neighbours, by their first crossing and the side on which the second lies.
pub(super) type Segments = BTreeMap<(Label, Label), Vec<Option<Station>>>;

/// Follows every line between two neighbours.
pub(super) fn segments(grid: &Grid, view: View) -> Segments {
    let mut found = Segments::new();
    for (label, node) in &grid.nodes {
        for side in [(1, 0), (0, 1)] {
            let Some(next) = grid.nodes.get(&onward(*label, side, 1)) else { continue };
            let cross = crosswise(side);
            let cross = (cross.0.abs(), cross.1.abs());
            let (Some(a), Some(b)) =
                (grid.step(*label, cross), grid.step(onward(*label, side, 1), cross))
            else {
                continue;
            };
            let step = next.pixel - node.pixel;
            let places = spread(STATIONS, disturbed(grid.width, step));
            let stations = follow(
                view,
                (node.pixel, step),
                [a, b],
                &places,
                Look { width: grid.width, settled: EXACTLY },
            );
            found.insert((*label, side), stations);
        }
    }
    found
}

/// Moves every crossing to where its lines meet; those whose lines cannot be measured are dropped.
pub(super) fn refine(grid: &mut Grid, view: View, segments: &Segments) {
    let nodes = grid.nodes.keys().filter_map(|label| {
        let place = Place::new(grid, *label)?;
        let along = place.curve(grid, segments, view, (1, 0))?;
        let across = place.curve(grid, segments, view, (0, 1))?;
        let pixel = place.intersection(along.0, across.0)?;
        // The line along says where the crossing is across it.
        let sigma = place.spread([across.1, along.1]);
        Some((*label, Node { pixel, sigma, ..grid.nodes[label] }))
    });
    grid.nodes = nodes.collect();
    let widths: Vec<f64> =
        segments.values().flatten().flatten().map(|station| station.dip.width).collect();
    grid.width = median(&widths);
}

/// A crossing and the frame of its two steps.
struct Place {
    label: Label,
    centre: Pixel,
    to_frame: Matrix2<f64>,
    from_frame: Matrix2<f64>,
}

impl Place {
    fn new(grid: &Grid, label: Label) -> Option<Self> {
        let centre = grid.pixel(label)?;
        let from_frame =
            Matrix2::from_columns(&[grid.step(label, (1, 0))?, grid.step(label, (0, 1))?]);
        Some(Self { label, centre, to_frame: from_frame.try_inverse()?, from_frame })
    }

    /// The line through the crossing along `side`, as a parabola: offset across it, in steps, over
    /// the way along it, in steps; and the variance of that offset at the crossing.
    fn curve(
        &self,
        grid: &Grid,
        segments: &Segments,
        view: View,
        side: Label,
    ) -> Option<([f64; 3], f64)> {
        let mut stations: Vec<Pixel> = Vec::new();
        let mut add = |from: Label| {
            let found = segments.get(&(from, side)).map(|line| line.iter().flatten());
            stations.extend(found.into_iter().flatten().map(|station| station.pixel));
        };
        let back = onward(self.label, side, -1);
        let sides =
            [segments.contains_key(&(back, side)), segments.contains_key(&(self.label, side))];
        if sides[0] {
            add(back);
        }
        if sides[1] {
            add(self.label);
        }
        match sides {
            [true, false] => add(onward(back, side, -1)),
            [false, true] => add(onward(self.label, side, 1)),
            _ => {}
        }
        // Beyond the last crossing lines may go on a little.
        let backward = (-side.0, -side.1);
        for (missing, side) in [(!sides[0], backward), (!sides[1], side)] {
            if missing {
                stations.extend(self.stub(grid, view, side));
            }
        }
        let ended = usize::from(sides != [true, true]);
        let step = (self.from_frame * Vector2::new(f64::from(side.0), f64::from(side.1))).norm();
        let span = (SPANS[ended] / step).max(LEAST_SPANS[ended]);
        let swap = side == (0, 1);
        let places = stations.iter().map(|station| self.to_frame * (station - self.centre));
        let offsets: Vec<(f64, f64)> = places
            .map(|place| if swap { (place.y, place.x) } else { (place.x, place.y) })
            .filter(|(along, _)| along.abs() <= span)
            .collect();
        parabola(&offsets)
    }

    /// Where the line goes on beyond the last crossing, in its first half pitch.
    fn stub(&self, grid: &Grid, view: View, side: Label) -> Vec<Pixel> {
        let cross = crosswise(side);
        let cross = (cross.0.abs(), cross.1.abs());
        let (Some(step), Some(across), Some(node)) = (
            grid.step(self.label, side),
            grid.step(self.label, cross),
            grid.nodes.get(&self.label),
        ) else {
            return Vec::new();
        };
        let nearest = disturbed(grid.width, step);
        let places = [nearest, nearest + 0.06, nearest + 0.12];
        let stations = follow(
            view,
            (self.centre, step),
            [across, across],
            &places,
            Look { width: grid.width, settled: EXACTLY },
        );
        let good = |s: &&Station| {
            s.dip.depth > 0.8 * node.depth
                && s.dip.offset.abs() < 0.05
                && (s.dip.width / grid.width - 1.0).abs() < 0.2
        };
        let stations: Vec<Station> = stations.into_iter().flatten().collect();
        let all = stations.len() == places.len() && stations.iter().filter(good).count() == 3;
        if all { stations.iter().map(|s| s.pixel).collect() } else { Vec::new() }
    }

    /// Standard deviation along each axis of the picture, of variances along the two steps.
    fn spread(&self, variances: [f64; 2]) -> f64 {
        let length = |step: usize| self.from_frame.column(step).norm_squared();
        ((length(0) * variances[0] + length(1) * variances[1]) / 2.0).sqrt()
    }

    /// Where the two curves meet.
    fn intersection(&self, along: [f64; 3], across: [f64; 3]) -> Option<Pixel> {
        let value = |c: [f64; 3], at: f64| c[0] + c[1] * at + c[2] * at * at;
        let (mut x, mut y) = (0.0, 0.0);
        // Each turn shrinks the error by the slopes' product, below 0.1.
        for _ in 0..12 {
            y = value(along, x);
            x = value(across, y);
        }
        let moved = Vector2::new(x, y);
        // Half of what prediction allows: lines that lead elsewhere are not this crossing's.
        (moved.norm() < 0.3).then(|| self.centre + self.from_frame * moved)
    }
}

/// The parabola through points of a line; a straight line where they are too few or too far off for
/// the curve to be known at 0, and nothing where even that is not. With it: its variance at 0.
fn parabola(points: &[(f64, f64)]) -> Option<([f64; 3], f64)> {
    (2..=3).rev().find_map(|terms| {
        let power = |x: f64, i: usize| [1.0, x, x * x][i];
        let row = |x: f64| (0..terms).map(move |i| power(x, i));
        let powers: Vec<f64> = points.iter().flat_map(|point| row(point.0)).collect();
        let offsets: Vec<f64> = points.iter().map(|point| point.1).collect();
        let solution = solve(&powers, terms, &offsets, 1)?;
        let normal = DMatrix::from_fn(terms, terms, |i, j| {
            points.iter().map(|point| power(point.0, i) * power(point.0, j)).sum::<f64>()
        });
        // The variance at 0, in those of one point: a place less sure than any point is a guess.
        let variance = normal.try_inverse()?[(0, 0)];
        let coefficient = |i: usize| solution.get(i).copied().unwrap_or(0.0);
        let curve = [coefficient(0), coefficient(1), coefficient(2)];
        let off = |(x, y): &(f64, f64)| y - (curve[0] + curve[1] * x + curve[2] * x * x);
        let sum: f64 = points.iter().map(|point| off(point) * off(point)).sum();
        let scatter = sum / (points.len().max(terms + 1) - terms) as f64;
        (variance < MOST_VARIANCE).then_some((curve, variance * scatter))
    })
}

/// Corrects for perspective: the middle of a line as seen is not the middle as printed, because
/// its nearer half is seen larger. With the grid's `width`, now as printed, and the second difference of places
/// along the grid, Taylor's series gives the shift as `width^2 / 8` of it.
///
/// Each with its standard deviation along each axis, in pixels.
pub(super) fn unbiased(grid: &Grid) -> Vec<(Label, Pixel, f64)> {
    let shift = |label: Label, side: Label| {
        let (here, next) = (grid.pixel(label)?, grid.pixel(onward(label, side, 1))?);
        let last = grid.pixel(onward(label, side, -1))?;
        Some((next - here) - (here - last))
    };
    let corrected = |label: &Label| {
        let second = |side: Label| {
            // The outermost crossings use their inner neighbour's.
            [0, 1, -1]
                .iter()
                .find_map(|away| shift(onward(*label, side, *away), side))
                .unwrap_or_default()
        };
        (second((1, 0)) + second((0, 1))) * (grid.width * grid.width / 8.0)
    };
    let told = |(label, node): (&Label, &Node)| {
        let sigma = (node.sigma * node.sigma + OWN_FAULT * OWN_FAULT).sqrt();
        (*label, node.pixel - corrected(label), sigma)
    };
    grid.nodes.iter().map(told).collect()
}

/// Drops crossings that lines do not hold: every joint of two neighbours must be a line, as dark
/// half way as elsewhere, and a crossing needs two joints.
pub(super) fn prune(grid: &mut Grid, segments: &Segments) {
    let sound: BTreeMap<_, bool> =
        segments.iter().map(|(key, line)| (*key, is_line(line))).collect();
    let joints = |label: Label| {
        let ends = SIDES.map(|side| {
            let forward = side.0 + side.1 > 0;
            let key =
                if forward { (label, side) } else { (onward(label, side, 1), (-side.0, -side.1)) };
            sound.get(&key).copied()
        });
        let count = |wanted: bool| ends.iter().filter(|end| **end == Some(wanted)).count();
        (count(true), count(false))
    };
    let bad: Vec<Label> = grid
        .nodes
        .keys()
        .filter(|label| {
            let (good, bad) = joints(**label);
            good == 0 || bad >= good
        })
        .copied()
        .collect();
    grid.nodes.retain(|label, _| !bad.contains(label));
    grid.keep_largest_group();
}

/// Whether stations between two crossings are those of one line: nearly all there, evenly deep.
/// Squares of a chessboard touch at their corners, and look like lines to a blurred eye; but where
/// they touch they are half as deep.
fn is_line(stations: &[Option<Station>]) -> bool {
    let depths: Vec<f64> = stations.iter().flatten().map(|s| s.dip.depth).collect();
    let typical = median(&depths);
    let even = depths.iter().filter(|d| (**d / typical - 1.0).abs() < 0.35).count();
    even + 1 >= stations.len()
}
