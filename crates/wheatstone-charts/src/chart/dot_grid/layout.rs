//! Which way a grid's labels go along the chart's rows and columns, and which dots of an asymmetric
//! chart the labels stand for.

use super::DotGrid;
use crate::chart::{ChartSearch, Detection};
use nalgebra::Vector2;
use std::collections::BTreeMap;
use wheatstone_core::geometry::Pixel;

/// The same dots under labels that go along rows and columns.
///
/// Seen from aslant, a cell's diagonal can be shorter than its sides, and labels follow what is short.
/// Of all ways to label the same grid the right one fills its rectangle best. Asymmetric charts have
/// dots at every second label: the cells that are found are their squares on edge.
pub(super) fn straightened<V: Clone>(
    labels: &BTreeMap<(i32, i32), V>,
    asymmetric: bool,
) -> BTreeMap<(i32, i32), V> {
    let relabel = |[a, b, c, d]: [i32; 4]| -> BTreeMap<(i32, i32), V> {
        let new = |(x, y): (i32, i32)| {
            let (x, y) = (a * x + b * y, c * x + d * y);
            if asymmetric { (x - y, x + y) } else { (x, y) }
        };
        labels.iter().map(|(label, value)| (new(*label), value.clone())).collect()
    };
    // As it is, sheared by one step, and both: all short cells of a lattice.
    let ways = [
        [1, 0, 0, 1],
        [1, 1, 0, 1],
        [1, -1, 0, 1],
        [1, 0, 1, 1],
        [1, 0, -1, 1],
        [2, 1, 1, 1],
        [1, 1, 1, 2],
        [2, -1, -1, 1],
        [1, -1, -1, 2],
    ];
    let mut best = relabel(ways[0]);
    for way in &ways[1..] {
        let other = relabel(*way);
        if rectangle(&other) < rectangle(&best) {
            best = other;
        }
    }
    best
}

/// Labels in the rectangle about all of them.
fn rectangle<V>(labels: &BTreeMap<(i32, i32), V>) -> i64 {
    let (width, height) = size(labels);
    i64::from(width) * i64::from(height)
}

/// Of the rectangle about all labels.
pub(super) fn size<V>(labels: &BTreeMap<(i32, i32), V>) -> (i32, i32) {
    let extent = |pick: fn(&(i32, i32)) -> i32| {
        let all = labels.keys().map(pick);
        all.clone().max().unwrap_or(-1) - all.min().unwrap_or(0) + 1
    };
    (extent(|label| label.0), extent(|label| label.1))
}

/// Every way in which the dots found can be an asymmetric chart, which must be there from its first
/// row and column to its last.
pub(super) fn place(chart: &DotGrid, dots: &BTreeMap<(i32, i32), Pixel>) -> ChartSearch {
    let mut turned = dots.clone();
    // A chart is seen from its face: y turns from x as in the picture.
    if direction(&turned, (1, 1)).perp(&direction(&turned, (-1, 1))) < 0.0 {
        turned = turned.into_iter().map(|((x, y), pixel)| ((y, x), pixel)).collect();
    }
    let mut readings = Vec::new();
    for _ in 0..4 {
        turned = turned.into_iter().map(|((x, y), pixel)| ((-y, x), pixel)).collect();
        let left = turned.keys().map(|label| label.0).min().unwrap_or(0);
        let top = turned.keys().map(|label| label.1).min().unwrap_or(0);
        let fits = size(&turned) == (2 * chart.columns as i32, chart.rows as i32);
        // The first row begins at the left.
        let even = |label: &(i32, i32)| (label.0 - left + label.1 - top) % 2 == 0;
        if !fits || !turned.keys().all(even) {
            continue;
        }
        let along = direction(&turned, (1, 1)) - direction(&turned, (-1, 1));
        let id = |(x, y): &(i32, i32)| (y - top) as usize * chart.columns + (x - left) as usize / 2;
        let mut points: Vec<_> = turned.iter().map(|(label, pixel)| (id(label), *pixel)).collect();
        points.sort_unstable_by_key(|(id, _)| *id);
        readings.push((along.x / along.norm(), Detection { points, ..Detection::default() }));
    }
    if readings.is_empty() {
        let (width, height) = size(dots);
        return ChartSearch::NotFound(format!(
            "found an asymmetric grid of {} dots over {width} x {height} half pitches, which is not the whole chart",
            dots.len()
        ));
    }
    readings.sort_by(|a, b| b.0.total_cmp(&a.0));
    ChartSearch::Found(readings.into_iter().map(|(_, reading)| reading).collect())
}

/// Mean step in the picture between dots whose labels differ by `step`.
fn direction(dots: &BTreeMap<(i32, i32), Pixel>, step: (i32, i32)) -> Vector2<f64> {
    let next = |label: &(i32, i32)| dots.get(&(label.0 + step.0, label.1 + step.1));
    let steps: Vec<Vector2<f64>> =
        dots.iter().filter_map(|(label, at)| Some(next(label)? - at)).collect();
    steps.iter().sum::<Vector2<f64>>() / steps.len().max(1) as f64
}
