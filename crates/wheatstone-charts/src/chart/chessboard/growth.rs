//! From a piece of a board to the whole of it: corners are tested, misplaced ones dropped, and
//! missing ones looked for where their neighbours say that they are, so that no lens model is needed.

use super::{
    edges,
    saddle::{refine, sigma},
    seed::{Labels, Seed},
};
use crate::{
    chart::{Sigmas, growing},
    imaging::GrayImage,
};
use nalgebra::Vector2;
use wheatstone_core::geometry::Pixel;
use wheatstone_numeric::statistics::median;

/// The window of the saddle as a share of the distance of neighbours, and its bounds in pixels.
///
/// Measured on rendered boards (see the decision on chessboard detection): wider windows average more
/// noise, but the lens bends the edges in them.
const WINDOW: (f64, f64, f64) = (0.1, 1.0, 2.5);
/// How far a corner may be from where its neighbours say, as a share of their distance. Beyond a
/// half it would be nearer to another corner's place.
const MOST_DEVIATION: f64 = 0.35;
/// The least contrast of a corner, as a share of the board's median: shadows and vignetting halve it,
/// printing on the white margin and things behind the board have less.
const LEAST_CONTRAST: f64 = 0.25;
/// Sigmas above which a corner is dropped: in pixels, and as a multiple of the board's median. Corners that
/// were 9 to 35 px wrong on rendered boards had 0.3 px and 8 times; light that halves twice makes 4 times.
const MOST_UNCERTAIN: (f64, f64) = (0.2, 6.0);

/// A board as far as the picture shows it.
pub(in crate::chart) struct Grown {
    /// Its corners.
    pub(in crate::chart) labels: Labels,
    /// The lowest labels of a dark square.
    pub(in crate::chart) dark_square: (i32, i32),
    /// How certain they are.
    pub(in crate::chart) sigmas: Sigmas,
}

/// How many corners of a lattice are followed where a board has so many: enough for the board and what is
/// beside it, and to tell a mistaken count by, few enough that a tiled wall takes no longer than a board.
pub(in crate::chart) fn most_points(count: usize) -> usize {
    (4 * count).max(1_000)
}

/// Makes the most of a seed, though little more than `most_points` of it; `None` where it is no
/// chessboard. Colours of squares are looked at within `reach` of a side from their corners.
pub(in crate::chart) fn grow(
    image: &GrayImage,
    seed: &Seed,
    most_points: usize,
    reach: f64,
) -> Option<Grown> {
    let mut labels = seed.labels.clone();
    let mut contrasts: Vec<f64> =
        labels.keys().filter_map(|label| contrast(image, &labels, *label, reach)).collect();
    if contrasts.is_empty() {
        return None;
    }
    let middle = contrasts.len() / 2;
    let typical = *contrasts.select_nth_unstable_by(middle, f64::total_cmp).1;
    let is_corner = |labels: &Labels, label: (i32, i32)| {
        contrast(image, labels, label, reach).is_some_and(|found| {
            found * typical > 0.0 && found.abs() > LEAST_CONTRAST * typical.abs()
        })
    };
    let refused: Vec<_> =
        labels.keys().copied().filter(|label| !is_corner(&labels, *label)).collect();
    for label in refused {
        labels.remove(&label);
    }
    sharpen(image, &mut labels);
    let places = Places::new(&seed.corners);
    let mut taken: Vec<Pixel> = labels.values().copied().collect();
    let before = labels.len();
    while labels.len() < most_points {
        let mut added = false;
        for label in frontier(&labels) {
            let Some((at, spacing)) = propose(image, &labels, label, &places) else {
                continue;
            };
            if taken.iter().any(|other| (other - at).norm() < 0.5 * spacing) {
                continue;
            }
            labels.insert(label, at);
            if is_corner(&labels, label) {
                added = true;
                taken.push(at);
            } else {
                labels.remove(&label);
            }
        }
        if !added {
            break;
        }
    }
    if labels.len() > before {
        sharpen(image, &mut labels);
    }
    let sigmas = drop_uncertain(image, &mut labels);
    let dark_square = if typical > 0.0 { (1, 0) } else { (0, 0) };
    (labels.len() >= 4).then_some(Grown { labels, dark_square, sigmas })
}

/// Moves every corner to its saddle. Where there is none the corner stays: its squares were tested.
fn sharpen(image: &GrayImage, labels: &mut Labels) {
    let moved: Vec<_> = labels
        .iter()
        .filter_map(|(label, at)| {
            let (along, down) = steps(labels, *label)?;
            Some((*label, refine(image, *at, window(along.norm().min(down.norm())))?))
        })
        .collect();
    labels.extend(moved);
}

/// Drops corners that are far less certain than the others, at the picture's edge mostly, where a saddle
/// wanders off. Returns the sigmas of all.
fn drop_uncertain(image: &GrayImage, labels: &mut Labels) -> Sigmas {
    let mut sigmas = Sigmas::default();
    let all: Vec<((i32, i32), f64)> = labels
        .iter()
        .filter_map(|(label, at)| {
            let (along, down) = steps(labels, *label)?;
            let sigma = sigma(image, *at, window(along.norm().min(down.norm())));
            sigmas.add(*at, sigma);
            Some((*label, sigma))
        })
        .collect();
    if all.is_empty() {
        return sigmas;
    }
    let typical = median(&all.iter().map(|(_, sigma)| *sigma).collect::<Vec<_>>());
    for (label, sigma) in all {
        if sigma > MOST_UNCERTAIN.0.max(MOST_UNCERTAIN.1 * typical) {
            labels.remove(&label);
        }
    }
    sigmas
}

/// Moves every corner of plain squares to where its edges cross, unless there are `most_points`: a tiled wall is no
/// chart, how exactly its corners lie is not asked for, and it would take half the time.
pub(in crate::chart) fn settle(
    image: &GrayImage,
    most_points: usize,
    (labels, sigmas): (&mut Labels, &mut Sigmas),
) {
    if labels.len() >= most_points {
        return;
    }
    let found: Vec<_> = labels
        .keys()
        .filter_map(|label| Some((*label, edges::crossing(image, labels, *label)?)))
        .collect();
    for (label, (at, sigma)) in found {
        sigmas.add(at, sigma);
        labels.insert(label, at);
    }
}

pub(super) fn window(spacing: f64) -> f64 {
    (WINDOW.0 * spacing).clamp(WINDOW.1, WINDOW.2)
}

/// Empty places beside corners.
pub(in crate::chart) fn frontier(labels: &Labels) -> Vec<(i32, i32)> {
    growing::beside(labels.keys(), labels)
}

/// Corners from the picture's top to its bottom.
struct Places(Vec<Pixel>);

impl Places {
    fn new(corners: &[Pixel]) -> Self {
        let mut all = corners.to_vec();
        all.sort_by(|a, b| a.y.total_cmp(&b.y));
        Self(all)
    }

    /// The nearest to a place, nearer than `reach`.
    fn nearest(&self, place: Pixel, reach: f64) -> Option<Pixel> {
        let first = self.0.partition_point(|at| at.y <= place.y - reach);
        let beside = self.0[first..].iter().take_while(|at| at.y < place.y + reach);
        let far = |at: &Pixel| (at - place).norm();
        let near = beside.copied().filter(|at| far(at) < reach);
        near.min_by(|a, b| far(a).total_cmp(&far(b)))
    }
}

/// The corner that belongs to an empty place, and the distance to its neighbours.
fn propose(
    image: &GrayImage,
    labels: &Labels,
    label: (i32, i32),
    places: &Places,
) -> Option<(Pixel, f64)> {
    let (expected, spacing) = predict(labels, label)?;
    let near = |at: &Pixel| (at - expected).norm();
    let start = places.nearest(expected, MOST_DEVIATION * spacing);
    let found = refine(image, start.unwrap_or(expected), window(spacing)).or(start)?;
    (near(&found) < MOST_DEVIATION * spacing).then_some((found, spacing))
}

/// Where the corner of an empty place should be, and the distance to its neighbours: the mean of
/// what the lines through it say, to second order where they are long enough.
pub(in crate::chart) fn predict(
    labels: &Labels,
    (column, row): (i32, i32),
) -> Option<(Pixel, f64)> {
    let mut places = Vec::new();
    let mut spacing = f64::INFINITY;
    for (across, down) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
        let at = |n: i32| labels.get(&(column + n * across, row + n * down)).map(|p| p.coords);
        let (Some(one), Some(two)) = (at(1), at(2)) else { continue };
        spacing = spacing.min((two - one).norm());
        places.push(match (at(-1), at(3)) {
            (Some(before), _) => before + (one - before) / 2.0,
            (None, Some(three)) => 3.0 * one - 3.0 * two + three,
            (None, None) => 2.0 * one - two,
        });
    }
    let count = places.len() as f64;
    let sum: Vector2<f64> = places.into_iter().sum();
    (count > 0.0).then(|| (Pixel::from(sum / count), spacing))
}

/// Steps to the next column and the next row at a corner: half of what lies between its neighbours,
/// or to the one that there is.
pub(super) fn steps(
    labels: &Labels,
    (column, row): (i32, i32),
) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let here = labels.get(&(column, row))?;
    let step = |(across, down): (i32, i32)| {
        let ahead = labels.get(&(column + across, row + down)).map(|next| next - here);
        let behind = labels.get(&(column - across, row - down)).map(|last| here - last);
        match (ahead, behind) {
            (Some(ahead), Some(behind)) => Some((ahead + behind) / 2.0),
            (one, other) => one.or(other),
        }
    };
    // A corner at the end of a line borrows the step of the line beside it.
    let borrowed = |direction: (i32, i32)| {
        let beside = (direction.1, direction.0);
        [1, -1].into_iter().find_map(|side| {
            let from = (column + side * beside.0, row + side * beside.1);
            let to = (from.0 + direction.0, from.1 + direction.1);
            let back = (from.0 - direction.0, from.1 - direction.1);
            let base = labels.get(&from)?;
            let ahead = labels.get(&to).map(|next| next - base);
            ahead.or_else(|| labels.get(&back).map(|last| base - last))
        })
    };
    let along = step((1, 0)).or_else(|| borrowed((1, 0)))?;
    Some((along, step((0, 1)).or_else(|| borrowed((0, 1)))?))
}

/// By how much the darkest place in the two bright squares at a corner outshines the brightest in
/// the two dark ones; positive where squares whose labels add up to an even number are bright. `None`
/// where the four squares do not alternate.
fn contrast(image: &GrayImage, labels: &Labels, label: (i32, i32), reach: f64) -> Option<f64> {
    let here = labels.get(&label)?;
    let (along, down) = steps(labels, label)?;
    // Near the corner: boards with marks inside their bright squares are common. The middle of three
    // values does without a speck or an edge that one of them meets.
    let nearer = (reach / 0.26).min(1.0);
    let look = |across: f64, downwards: f64| {
        let way = along * across + down * downwards;
        let mut values =
            [0.12, 0.18, 0.26].map(|share| f64::from(image.sample(here + way * share * nearer)));
        values.sort_by(f64::total_cmp);
        values[1]
    };
    let (same, other) = ([look(1.0, 1.0), look(-1.0, -1.0)], [look(1.0, -1.0), look(-1.0, 1.0)]);
    let gap = |bright: [f64; 2], dark: [f64; 2]| bright[0].min(bright[1]) - dark[0].max(dark[1]);
    let sign = if (label.0 + label.1).rem_euclid(2) == 0 { 1.0 } else { -1.0 };
    [(gap(same, other), sign), (gap(other, same), -sign)]
        .into_iter()
        .find_map(|(gap, sign)| (gap > 0.0).then_some(gap * sign))
}
