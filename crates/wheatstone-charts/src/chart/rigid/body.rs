//! What is known of a body before any picture: its points, their neighbours, and the patches of them
//! that lie on a lattice, flat or bent.

use crate::chart::growing;
use std::collections::{BTreeMap, BTreeSet};
use wheatstone_core::geometry::{Point3, Vector3};

/// Points by whole-numbered labels; where labels begin and which way they go means nothing.
pub(super) type Patch = BTreeMap<(i32, i32), usize>;

/// Nearest points that are kept for each: the two rings about a point of a square lattice.
const NEIGHBOURS: usize = 24;
/// Of those, the ones among which the sides of a lattice's cell are looked for.
const CELL_NEIGHBOURS: usize = 10;
/// How far a point may be from where its neighbours say, as a share of their distance, as for dots in
/// pictures.
const MOST_DEVIATION: f64 = 0.25;
/// Points below which a patch tells nothing.
const LEAST_PATCH: usize = 8;
/// Patches that are kept, the largest first: a body has few faces, and each a few ways to see its
/// lattice.
const MOST_PATCHES: usize = 12;

/// Depth of a thin body as a share of its width: perspective then moves its points by less than a step.
const THIN: f64 = 0.1;
/// Share of points that a turn must take to others: a dot or two that is left out tells too little.
const LEAST_SYMMETRIC: f64 = 0.95;

/// The 24 turns that take axes to axes; the first is none.
fn turns() -> Vec<nalgebra::Matrix3<f64>> {
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];
    let signs =
        (0..8).map(|bits| [0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { -1.0 } else { 1.0 }));
    let signs: Vec<[f64; 3]> = signs.collect();
    let all = orders.into_iter().flat_map(|order| {
        signs.clone().into_iter().map(move |sign| {
            let mut turn = nalgebra::Matrix3::zeros();
            (0..3).for_each(|row| turn[(row, order[row])] = sign[row]);
            turn
        })
    });
    all.filter(|turn| turn.determinant() > 0.0).collect()
}

/// Of each point, the nearest others, nearest first.
fn nearby(points: &[Point3]) -> Vec<Vec<usize>> {
    let near = |at: &Point3| {
        let mut all: Vec<(f64, usize)> = points
            .iter()
            .enumerate()
            .map(|(index, other)| ((other - at).norm_squared(), index))
            .filter(|(distance, _)| *distance > 0.0)
            .collect();
        let count = NEIGHBOURS.min(all.len());
        if count < all.len() {
            all.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            all.truncate(count);
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        all.into_iter().map(|(_, index)| index).collect::<Vec<_>>()
    };
    points.iter().map(near).collect()
}

/// The points and how they lie to each other.
pub(super) struct Body {
    pub(super) points: Vec<Point3>,
    /// Of each point, the nearest others, nearest first.
    pub(super) neighbours: Vec<Vec<usize>>,
    pub(super) patches: Vec<Patch>,
    /// Whether all points lie on one plane z = constant: then it is seen from its face.
    pub(super) flat: bool,
    /// Turns about the axes that take nearly all points to others: of each point, which.
    pub(super) symmetries: Vec<Vec<Option<usize>>>,
}

impl Body {
    pub(super) fn new(points: Vec<Point3>) -> Self {
        let neighbours = nearby(&points);
        let heights = || points.iter().map(|point| point.z);
        let flat = heights().fold(f64::MIN, f64::max) == heights().fold(f64::MAX, f64::min);
        let mut body =
            Self { points, neighbours, patches: Vec::new(), flat, symmetries: Vec::new() };
        body.patches = body.find_patches();
        if let Some(flattened) = body.flattened() {
            body.patches.extend(flattened.find_patches());
            body.patches.sort_by_key(|patch| std::cmp::Reverse(patch.len()));
            body.patches.truncate(MOST_PATCHES);
        }
        body.symmetries = body.find_symmetries();
        body
    }

    /// A thin body without its depth: plates of two levels look like one lattice.
    fn flattened(&self) -> Option<Self> {
        let extent = |axis: usize| {
            let all = self.points.iter().map(|point| point[axis]);
            all.clone().fold(f64::MIN, f64::max) - all.fold(f64::MAX, f64::min)
        };
        if self.flat || extent(2) > THIN * extent(0).max(extent(1)) {
            return None;
        }
        let points: Vec<Point3> =
            self.points.iter().map(|point| Point3::new(point.x, point.y, 0.0)).collect();
        let neighbours = nearby(&points);
        let (patches, symmetries) = (Vec::new(), Vec::new());
        Some(Self { points, neighbours, patches, flat: true, symmetries })
    }

    /// The turns by quarters and halves about the body's middle that leave it as it is.
    fn find_symmetries(&self) -> Vec<Vec<Option<usize>>> {
        let low = self.points.iter().fold(Vector3::repeat(f64::MAX), |low, p| low.inf(&p.coords));
        let high =
            self.points.iter().fold(Vector3::repeat(f64::MIN), |high, p| high.sup(&p.coords));
        let middle = (low + high) / 2.0;
        let step = |id: usize| {
            let nearest = self.neighbours[id].first();
            nearest.map_or(0.0, |other| (self.points[*other] - self.points[id]).norm())
        };
        let mut found = Vec::new();
        for turn in turns().into_iter().skip(1) {
            // A flat body is seen from its face.
            if self.flat && turn[(2, 2)] < 0.5 {
                continue;
            }
            let image = |id: usize| -> Option<usize> {
                let place = middle + turn * (self.points[id].coords - middle);
                let off = |other: &usize| (self.points[*other].coords - place).norm();
                let all = 0..self.points.len();
                let nearest = all.min_by(|a, b| off(a).total_cmp(&off(b)))?;
                (off(&nearest) < 0.1 * step(id)).then_some(nearest)
            };
            // Ten points tell for most turns that they are none.
            let few = (0..self.points.len()).step_by((self.points.len() / 10).max(1));
            let (count, kept) =
                few.fold((0, 0), |(n, k), id| (n + 1, k + usize::from(image(id).is_some())));
            if kept * 10 < count * 7 {
                continue;
            }
            let to: Vec<Option<usize>> = (0..self.points.len()).map(image).collect();
            if to.iter().flatten().count() as f64 >= LEAST_SYMMETRIC * to.len() as f64 {
                found.push(to);
            }
        }
        found
    }

    /// Patches from every point's cells, each set of points and cell once.
    fn find_patches(&self) -> Vec<Patch> {
        let mut patches: Vec<Patch> = Vec::new();
        let mut known: BTreeSet<(usize, usize)> = BTreeSet::new();
        for seed in 0..self.points.len() {
            for [first, second] in self.cells(seed) {
                // A step between two points belongs to one lattice of each kind.
                if known.contains(&(seed, first)) && known.contains(&(seed, second)) {
                    continue;
                }
                let patch = self.grow(seed, first, second);
                for ((column, row), index) in &patch {
                    for step in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                        if let Some(next) = patch.get(&(column + step.0, row + step.1)) {
                            known.insert((*index, *next));
                        }
                    }
                }
                if patch.len() >= LEAST_PATCH {
                    patches.push(patch);
                }
            }
        }
        patches.sort_by_key(|patch| std::cmp::Reverse(patch.len()));
        patches.truncate(MOST_PATCHES);
        patches
    }

    /// Pairs of neighbours that are two sides of a cell whose fourth point exists, shortest first.
    fn cells(&self, seed: usize) -> Vec<[usize; 2]> {
        let near = &self.neighbours[seed];
        let near = &near[..near.len().min(CELL_NEIGHBOURS)];
        let step = |index: usize| self.points[index] - self.points[seed];
        let mut cells = Vec::new();
        for (rank, second) in near.iter().enumerate() {
            for first in &near[..rank] {
                let (along, down) = (step(*first), step(*second));
                // Sides within 20 degrees of each other are two steps of one line.
                if along.cross(&down).norm() < 0.34 * along.norm() * down.norm() {
                    continue;
                }
                let radius = MOST_DEVIATION * along.norm().min(down.norm());
                let last = self.points[seed] + along + down;
                if self.nearest(*first, last, radius).is_some() {
                    cells.push([*first, *second]);
                }
            }
        }
        cells.truncate(6);
        cells
    }

    /// The point nearest to a place among the neighbours of `beside`, within `radius`.
    fn nearest(&self, beside: usize, at: Point3, radius: f64) -> Option<usize> {
        let distance = |index: &usize| (self.points[*index] - at).norm();
        let nearest =
            self.neighbours[beside].iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (distance(nearest) <= radius).then_some(*nearest)
    }

    fn grow(&self, seed: usize, first: usize, second: usize) -> Patch {
        let start = Patch::from([((0, 0), seed), ((1, 0), first), ((0, 1), second)]);
        growing::grown(start, |labels, place| {
            let (expected, spacing, beside) = self.predict(labels, place)?;
            self.nearest(beside, expected, MOST_DEVIATION * spacing)
        })
    }

    /// Where the point of an empty place should be, the distance to its neighbours, and one of them.
    fn predict(&self, labels: &Patch, (column, row): (i32, i32)) -> Option<(Point3, f64, usize)> {
        let index = |c: i32, r: i32| labels.get(&(column + c, row + r)).copied();
        let at = |c: i32, r: i32| index(c, r).map(|it| self.points[it].coords);
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        let (mut spacing, mut beside) = (f64::INFINITY, None);
        for (c, r) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let Some(one) = at(c, r) else { continue };
            let place = if let Some(two) = at(2 * c, 2 * r) {
                spacing = spacing.min((two - one).norm());
                at(3 * c, 3 * r).map_or(2.0 * one - two, |three| 3.0 * one - 3.0 * two + three)
            } else if let Some((side, diagonal)) = [1, -1]
                .into_iter()
                .find_map(|s| Some((at(s * r, s * c)?, at(c + s * r, r + s * c)?)))
            {
                spacing = spacing.min((diagonal - side).norm());
                one + side - diagonal
            } else {
                continue;
            };
            beside = beside.or(index(c, r));
            sum += place;
            count += 1.0;
        }
        (count > 0.0).then_some((Point3::from(sum / count), spacing, beside?))
    }
}
