//! From patches to a grid of them: a cell of four, then dot by dot where neighbours say that one is.

use super::blobs::Blob;
use crate::chart::growing;
use nalgebra::Vector2;
use std::collections::{BTreeMap, BTreeSet};
use wheatstone_core::geometry::Pixel;

/// Dots by their labels; where labels begin and which way they go means nothing.
pub(in crate::chart) type Labels = BTreeMap<(i32, i32), Blob>;

/// How far a dot may be from where its neighbours say, as a share of their distance. A lens bends and a
/// tilt shortens steps by a tenth at most from one to the next; beyond a half it would be another dot.
const MOST_DEVIATION: f64 = 0.25;
/// The same, for the middle dot of three in the median over the grid: dots of a grid lie in line, patches
/// that were caught by [`MOST_DEVIATION`] in a crowd lie anywhere in it, which makes 0.12.
const MOST_DISORDER: f64 = 0.09;
/// Ratio of areas of neighbours: some plates mark one dot by twice the diameter.
const MOST_UNLIKE: f64 = 6.0;
/// Ratio of contrasts of neighbours: light does not change faster.
const MOST_FADING: f64 = 4.0;
/// Distance of neighbours, in square roots of their area: dots a fourteenth of the pitch wide are the
/// smallest that are looked for.
const FARTHEST: f64 = 16.0;
/// Neighbours among which the two sides of a cell are looked for: the eight around a dot.
const NEIGHBOURS: usize = 8;

/// Takes the largest grid out of the patches, if it has `least` dots.
pub(super) fn take_largest(blobs: &mut Vec<Blob>, least: usize) -> Option<Labels> {
    let indices = largest(blobs, least)?;
    let labels = indices.iter().map(|(label, index)| (*label, blobs[*index])).collect();
    let taken: BTreeSet<usize> = indices.into_values().collect();
    let left = blobs.iter().enumerate().filter(|(index, _)| !taken.contains(index));
    *blobs = left.map(|(_, blob)| *blob).collect();
    Some(labels)
}

/// The largest grid among the patches, if it has `least` dots, by indices of the patches.
fn largest(blobs: &[Blob], least: usize) -> Option<BTreeMap<(i32, i32), usize>> {
    let cloud = Cloud::new(blobs)?;
    let mut taken = vec![false; blobs.len()];
    let mut best: BTreeMap<(i32, i32), usize> = BTreeMap::new();
    for seed in 0..blobs.len() {
        if taken[seed] {
            continue;
        }
        for cell in cloud.cells(seed).into_iter().take(2) {
            let labels = cloud.grow(cell);
            // What is smaller than this may have begun with a wrong cell.
            if labels.len() >= least.min(8) {
                labels.values().for_each(|index| taken[*index] = true);
            }
            if labels.len() > best.len() && labels.len() >= least && cloud.in_order(&labels) {
                best = labels;
            }
        }
        // Nothing that is left can be larger.
        if best.len() * 2 > blobs.len() {
            break;
        }
    }
    (!best.is_empty()).then_some(best)
}

/// The largest grids among the patches, at most `most` of them with `least` dots or more, by indices of
/// the patches.
pub(in crate::chart) fn patches(
    blobs: &[Blob],
    least: usize,
    most: usize,
) -> Vec<BTreeMap<(i32, i32), usize>> {
    let Some(cloud) = Cloud::new(blobs) else { return Vec::new() };
    let mut taken = vec![0_usize; blobs.len()];
    let (mut found, mut grown) = (Vec::new(), 0);
    for seed in 0..blobs.len() {
        // Every patch a few times over is enough, however many lattices a texture has.
        if grown > 8 * blobs.len() {
            break;
        }
        // Twice: with another cell the same dots make another lattice.
        if taken[seed] >= 2 {
            continue;
        }
        for cell in cloud.cells(seed).into_iter().take(3) {
            let labels = cloud.grow(cell);
            grown += labels.len();
            if labels.len() >= least && cloud.in_order(&labels) {
                labels.values().for_each(|index| taken[*index] += 1);
                found.push(labels);
            }
        }
    }
    found.sort_by_key(|labels: &BTreeMap<_, _>| std::cmp::Reverse(labels.len()));
    found.dedup();
    found.truncate(most);
    found
}

/// Patches, sorted into boxes to find them by place.
struct Cloud<'a> {
    blobs: &'a [Blob],
    low: Pixel,
    side: f64,
    across: usize,
    down: usize,
    boxes: Vec<Vec<usize>>,
}

impl<'a> Cloud<'a> {
    fn new(blobs: &'a [Blob]) -> Option<Self> {
        let (mut low, mut high) = (blobs.first()?.centre, blobs.first()?.centre);
        for blob in blobs {
            low = low.inf(&blob.centre);
            high = high.sup(&blob.centre);
        }
        let size = high - low;
        let side = (size.x * size.y / blobs.len() as f64).sqrt().max(size.max() / 1e3).max(1.0);
        let count = |extent: f64| (extent / side) as usize + 1;
        let (across, down) = (count(size.x), count(size.y));
        let mut own =
            Self { blobs, low, side, across, down, boxes: vec![Vec::new(); across * down] };
        for (index, blob) in blobs.iter().enumerate() {
            let (x, y) = own.place(blob.centre);
            own.boxes[y * across + x].push(index);
        }
        Some(own)
    }

    fn place(&self, at: Pixel) -> (usize, usize) {
        let count = |from: f64, most: usize| ((from / self.side).max(0.0) as usize).min(most - 1);
        (count(at.x - self.low.x, self.across), count(at.y - self.low.y, self.down))
    }

    /// Patches within `radius` of a place, with their distances, nearest first.
    fn near(&self, at: Pixel, radius: f64) -> Vec<(f64, usize)> {
        let reach = Vector2::new(radius, radius);
        let ((left, top), (right, bottom)) = (self.place(at - reach), self.place(at + reach));
        let mut found: Vec<(f64, usize)> = (top..=bottom)
            .flat_map(|y| (left..=right).map(move |x| y * self.across + x))
            .flat_map(|place| self.boxes[place].iter())
            .map(|index| ((self.blobs[*index].centre - at).norm(), *index))
            .filter(|(distance, _)| *distance <= radius)
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    fn alike(&self, one: usize, other: usize) -> bool {
        let within = |a: f64, b: f64, most: f64| a < b * most && b < a * most;
        let (one, other) = (&self.blobs[one], &self.blobs[other]);
        within(one.area(), other.area(), MOST_UNLIKE)
            && within(one.contrast, other.contrast, MOST_FADING)
    }

    /// The patch nearest to a place within `radius`, if it is like `model`.
    fn like(&self, model: usize, at: Pixel, radius: f64) -> Option<usize> {
        let found = self.near(at, radius).into_iter().map(|(_, index)| index);
        found.into_iter().find(|index| self.alike(model, *index))
    }

    /// The eight nearest that are alike. The radius grows with the crowd's thinness.
    fn neighbours(&self, seed: usize) -> Vec<usize> {
        let most = FARTHEST * self.blobs[seed].area().sqrt();
        let mut radius = (2.0 * self.side).min(most);
        loop {
            let near = self.near(self.blobs[seed].centre, radius).into_iter().map(|(_, it)| it);
            let alike = near.filter(|it| *it != seed && self.alike(seed, *it));
            let found: Vec<usize> = alike.take(NEIGHBOURS).collect();
            if found.len() == NEIGHBOURS || radius >= most {
                return found;
            }
            radius = (2.0 * radius).min(most);
        }
    }

    /// Cells of four with this patch at one corner, by their sides' length.
    fn cells(&self, seed: usize) -> Vec<[usize; 4]> {
        let neighbours = self.neighbours(seed);
        let at = |index: usize| self.blobs[index].centre;
        let mut cells = Vec::new();
        for (rank, second) in neighbours.iter().enumerate() {
            for first in &neighbours[..rank] {
                let (along, down) = (at(*first) - at(seed), at(*second) - at(seed));
                // Sides within 20 degrees of each other are two steps of one line.
                if along.perp(&down).abs() < 0.34 * along.norm() * down.norm() {
                    continue;
                }
                let radius = MOST_DEVIATION * along.norm().min(down.norm());
                let Some(last) = self.like(seed, at(seed) + along + down, radius) else { continue };
                cells.push([seed, *first, *second, last]);
            }
        }
        cells
    }

    fn grow(&self, [corner, first, second, last]: [usize; 4]) -> BTreeMap<(i32, i32), usize> {
        let seed =
            BTreeMap::from([((0, 0), corner), ((1, 0), first), ((0, 1), second), ((1, 1), last)]);
        growing::grown(seed, |labels, place| {
            let (expected, spacing, model) = self.predict(labels, place)?;
            self.like(model, expected, MOST_DEVIATION * spacing)
        })
    }

    /// Where the dot of an empty place should be, the distance to its neighbours, and one of them: the
    /// mean of what the lines through it and the cells beside it say.
    fn predict(
        &self,
        labels: &BTreeMap<(i32, i32), usize>,
        (column, row): (i32, i32),
    ) -> Option<(Pixel, f64, usize)> {
        let (mut sum, mut count) = (Vector2::zeros(), 0.0);
        let (mut spacing, mut model) = (f64::INFINITY, None);
        let index = |c: i32, r: i32| labels.get(&(column + c, row + r)).copied();
        let at = |c: i32, r: i32| index(c, r).map(|it| self.blobs[it].centre.coords);
        for (c, r) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let Some(one) = at(c, r) else { continue };
            model = model.or(index(c, r));
            if let Some(two) = at(2 * c, 2 * r) {
                spacing = spacing.min((two - one).norm());
                sum += match (at(-c, -r), at(3 * c, 3 * r)) {
                    (Some(before), _) => before + (one - before) / 2.0,
                    (None, Some(three)) => 3.0 * one - 3.0 * two + three,
                    (None, None) => 2.0 * one - two,
                };
                count += 1.0;
            } else if let Some((beside, diagonal)) = [1, -1]
                .into_iter()
                .find_map(|s| Some((at(s * r, s * c)?, at(c + s * r, r + s * c)?)))
            {
                spacing = spacing.min((diagonal - beside).norm());
                sum += one + beside - diagonal;
                count += 1.0;
            }
        }
        (count > 0.0).then_some((Pixel::from(sum / count), spacing, model?))
    }

    /// Whether the dots lie in line: those between two others do in the median.
    fn in_order(&self, labels: &BTreeMap<(i32, i32), usize>) -> bool {
        let at = |label: (i32, i32)| labels.get(&label).map(|it| self.blobs[*it].centre);
        let mut disorder: Vec<f64> = labels
            .keys()
            .flat_map(|(c, r)| {
                [(1, 0), (0, 1)].map(|(dc, dr)| {
                    let (before, here, after) =
                        (at((c - dc, r - dr))?, at((*c, *r))?, at((c + dc, r + dr))?);
                    let middle = nalgebra::center(&before, &after);
                    Some((here - middle).norm() / (after - middle).norm())
                })
            })
            .flatten()
            .collect();
        disorder.sort_by(f64::total_cmp);
        disorder.get(disorder.len() / 2).is_none_or(|median| *median < MOST_DISORDER)
    }
}
