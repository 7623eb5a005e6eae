//! From a rough camera and some matched points to all of them: point after point, each looked for where
//! those around it say that it is.

use super::{body::Body, marks::Marks, view::View};
use crate::{chart::PointId, imaging::GrayImage};
use nalgebra::{Matrix3, Vector2, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use wheatstone_core::geometry::{Pixel, Point3};
use wheatstone_numeric::statistics::{median, root_mean_square};

/// In pixels: how near a named point must be to its mark.
pub(super) const CLICKED: f64 = 12.0;

/// A point that someone has named, and where it is seen, roughly.
pub(super) type Click = (PointId, Pixel);

/// Points of the body with their marks in the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matched {
    /// By point: the mark's index.
    pub(super) marks: BTreeMap<usize, usize>,
    /// Root mean square distance of the marks from where their neighbours say, in steps from one point to
    /// the next.
    pub(super) disorder: f64,
    /// Median distance of the marks from where one camera without a lens observes them all, in steps.
    pub(super) curvature: f64,
}

/// How far a mark may be from where it is looked for, as a share of the distance to the next point. Beyond
/// a half it would be another's.
const MOST_DEVIATION: f64 = 0.3;
/// The same, for a mark among its matched neighbours, in the end.
const MOST_STRAY: f64 = 0.12;
/// Rounds: each goes at least one point further, so that this is the largest body in points across.
const MOST_ROUNDS: usize = 60;
/// Disorder above which marks are a crowd and no body: those of a crowd lie evenly within
/// [`MOST_DEVIATION`], which makes 0.2.
const MOST_DISORDER: f64 = 0.06;
/// Of [`Matched::curvature`]: lenses and water bend them by a third of a step where marks are dense; a body that is laid
/// askew bends by its own depth.
const MOST_CURVATURE: f64 = 1.0;
/// Matched neighbours that say where a point is.
const SAYING: usize = 8;

/// What a search for matches has at hand.
pub(super) struct Search<'a> {
    pub(super) body: &'a Body,
    pub(super) marks: &'a Marks,
    /// The picture's middle and width.
    pub(super) frame: (Pixel, f64),
    /// Of the body's points, those that are enough.
    pub(super) least: usize,
}

impl Search<'_> {
    pub(super) fn pairs(&self, marks: &BTreeMap<usize, usize>) -> Vec<(Point3, Pixel)> {
        marks.iter().map(|(id, mark)| (self.body.points[*id], self.marks.at(*mark))).collect()
    }

    /// Everything that can be matched, beginning with these points. `held` are named by someone, and are
    /// not given up.
    pub(super) fn grow(
        &self,
        view: &View,
        first: &BTreeMap<usize, usize>,
        held: &BTreeMap<usize, usize>,
    ) -> Option<Matched> {
        self.grow_once(view, first, held, true)
    }

    fn grow_once(
        &self,
        view: &View,
        first: &BTreeMap<usize, usize>,
        held: &BTreeMap<usize, usize>,
        again: bool,
    ) -> Option<Matched> {
        let mut marks = first.clone();
        let mut view = view.clone();
        let mut before = BTreeSet::new();
        for _ in 0..MOST_ROUNDS {
            let seen = self.seen(&view);
            marks = self.round(&seen, &marks, held);
            if marks.len() < 4 {
                return None;
            }
            let (centre, width) = self.frame;
            if let Some(fitted) = View::fit(&self.pairs(&marks), centre, width) {
                view = fitted;
            }
            // The same matches as in an earlier round: it goes on like this.
            if !before.insert(marks.iter().map(|(id, mark)| (*id, *mark)).collect::<Vec<_>>()) {
                break;
            }
        }
        if !view.is_right_handed() {
            return None;
        }
        let seen = self.seen(&view);
        let whole = marks.len();
        self.keep_agreeing(&seen, &mut marks, held);
        if marks.len() < whole && again {
            return self.grow_once(&view, &marks, held, false);
        }
        let seen = self.seen(&view);
        let strays = self.strays(&seen, &marks);
        marks.retain(|id, mark| {
            strays.get(id).is_some_and(|stray| *stray < MOST_STRAY) || held.get(id) == Some(mark)
        });
        let left: Vec<f64> = self.strays(&seen, &marks).into_values().collect();
        let disorder = root_mean_square(&left);
        let curvature = self.curvature(&seen, &marks);
        (marks.len() >= self.least && disorder < MOST_DISORDER && curvature < MOST_CURVATURE)
            .then_some(Matched { marks, disorder, curvature })
    }

    /// Keeps the largest part of the matches within which neighbours are off alike, and the parts of points
    /// that are held: a patch that was matched a step aside agrees with itself, but not with what is beside.
    fn keep_agreeing(
        &self,
        seen: &[Option<Pixel>],
        marks: &mut BTreeMap<usize, usize>,
        held: &BTreeMap<usize, usize>,
    ) {
        let off = |id: usize| Some(self.marks.at(*marks.get(&id)?) - seen[id]?);
        let mut part: BTreeMap<usize, usize> = BTreeMap::new();
        let mut sizes: Vec<usize> = Vec::new();
        for start in marks.keys() {
            if part.contains_key(start) {
                continue;
            }
            let number = sizes.len();
            sizes.push(0);
            let mut waiting = vec![*start];
            part.insert(*start, number);
            while let Some(id) = waiting.pop() {
                sizes[number] += 1;
                let (Some(own), Some(spacing)) = (off(id), self.spacing(seen, id)) else {
                    continue;
                };
                for other in &self.body.neighbours[id] {
                    let Some(its) = off(*other) else { continue };
                    if (its - own).norm() < MOST_DEVIATION * spacing && !part.contains_key(other) {
                        part.insert(*other, number);
                        waiting.push(*other);
                    }
                }
            }
        }
        let largest = (0..sizes.len()).max_by_key(|number| (sizes[*number], usize::MAX - number));
        let of_held: BTreeSet<usize> = held.keys().filter_map(|id| part.get(id).copied()).collect();
        marks.retain(|id, _| {
            let number = part.get(id).copied();
            number == largest || number.is_some_and(|number| of_held.contains(&number))
        });
    }

    pub(super) fn seen(&self, view: &View) -> Vec<Option<Pixel>> {
        self.body.points.iter().map(|point| view.project(point)).collect()
    }

    /// Distance from a point to the next one as they are seen.
    pub(super) fn spacing(&self, seen: &[Option<Pixel>], id: usize) -> Option<f64> {
        let own = seen[id]?;
        let near = self.body.neighbours[id].iter().take(SAYING);
        let steps = near.filter_map(|other| Some((seen[*other]? - own).norm()));
        // Two points in one line of sight are not neighbours in the picture.
        let least = steps.filter(|step| *step > 2.0).fold(f64::INFINITY, f64::min);
        least.is_finite().then_some(least)
    }

    /// Where a point is looked for: where the camera observes it, corrected by what its matched neighbours
    /// are off; to first order where there are enough of them.
    fn expected(
        &self,
        seen: &[Option<Pixel>],
        marks: &BTreeMap<usize, usize>,
        id: usize,
    ) -> Option<Pixel> {
        let own = seen[id]?;
        Some(own + self.offset(seen, marks, id, own)?)
    }

    /// How far the marks of the matched neighbours of `id` are from where the camera observes them, to first
    /// order at the place `own` of the picture.
    pub(super) fn offset(
        &self,
        seen: &[Option<Pixel>],
        marks: &BTreeMap<usize, usize>,
        id: usize,
        own: Pixel,
    ) -> Option<Vector2<f64>> {
        let around: Vec<(Vector2<f64>, Vector2<f64>)> = self.body.neighbours[id]
            .iter()
            .filter_map(|other| {
                let at = seen[*other]?;
                Some((at - own, self.marks.at(*marks.get(other)?) - at))
            })
            .take(SAYING)
            .collect();
        let reach = around.iter().map(|(step, _)| step.norm_squared()).fold(0.0, f64::max).sqrt();
        if around.is_empty() || reach == 0.0 {
            return None;
        }
        let (mut normal, mut right) = (Matrix3::zeros(), nalgebra::Matrix3x2::zeros());
        for (step, off) in &around {
            let terms = Vector3::new(1.0, step.x / reach, step.y / reach);
            normal += terms * terms.transpose();
            right += terms * off.transpose();
        }
        // A slope is not believed where the neighbours hardly show one.
        for axis in [1, 2] {
            normal[(axis, axis)] += 0.3;
        }
        let plane = normal.cholesky()?.solve(&right);
        Some(plane.row(0).transpose())
    }

    /// The marks of all points that have matched neighbours, or are matched.
    fn round(
        &self,
        seen: &[Option<Pixel>],
        marks: &BTreeMap<usize, usize>,
        held: &BTreeMap<usize, usize>,
    ) -> BTreeMap<usize, usize> {
        // By mark: whom it is nearest to.
        let mut claims: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
        for id in 0..self.body.points.len() {
            let (Some(at), Some(spacing)) =
                (self.expected(seen, marks, id), self.spacing(seen, id))
            else {
                continue;
            };
            let Some((mark, distance)) = self.marks.nearest(at, MOST_DEVIATION * spacing) else {
                continue;
            };
            let share = distance / spacing;
            if claims.get(&mark).is_none_or(|(other, _)| share < *other) {
                claims.insert(mark, (share, id));
            }
        }
        for (id, mark) in held {
            claims.retain(|_, (_, other)| other != id);
            claims.insert(*mark, (0.0, *id));
        }
        claims.into_iter().map(|(mark, (_, id))| (id, mark)).collect()
    }

    /// How far the marks are from where the camera alone observes them, in steps, in the median.
    fn curvature(&self, seen: &[Option<Pixel>], marks: &BTreeMap<usize, usize>) -> f64 {
        let off = |(id, mark): (&usize, &usize)| {
            Some((self.marks.at(*mark) - seen[*id]?).norm() / self.spacing(seen, *id)?)
        };
        median(&marks.iter().filter_map(off).collect::<Vec<_>>())
    }

    /// How far each mark is from where its neighbours say, in steps.
    fn strays(
        &self,
        seen: &[Option<Pixel>],
        marks: &BTreeMap<usize, usize>,
    ) -> BTreeMap<usize, f64> {
        let stray = |(id, mark): (&usize, &usize)| {
            let at = self.expected(seen, marks, *id)?;
            Some((*id, (self.marks.at(*mark) - at).norm() / self.spacing(seen, *id)?))
        };
        marks.iter().filter_map(stray).collect()
    }

    /// Marks that were not told from noise by their outline, looked for where their neighbours say, with the
    /// size that those have.
    pub(super) fn missed(
        &self,
        image: &GrayImage,
        matched: &Matched,
    ) -> BTreeMap<usize, (Pixel, f64)> {
        let (centre, width) = self.frame;
        let Some(view) = View::fit(&self.pairs(&matched.marks), centre, width) else {
            return BTreeMap::new();
        };
        let seen = self.seen(&view);
        let taken: BTreeSet<usize> = matched.marks.values().copied().collect();
        let look = |id: usize| {
            let around: Vec<usize> = self.body.neighbours[id]
                .iter()
                .filter_map(|other| matched.marks.get(other).copied())
                .take(SAYING)
                .collect();
            if around.len() < 3 {
                return None;
            }
            let (at, spacing) =
                (self.expected(&seen, &matched.marks, id)?, self.spacing(&seen, id)?);
            let beside = self.marks.nearest(at, 0.5 * spacing);
            if beside.is_some_and(|(mark, _)| taken.contains(&mark)) {
                return None;
            }
            let (found, sigma) = self.marks.measure_like(image, &around, at, 0.5 * spacing)?;
            ((found - at).norm() < MOST_STRAY * spacing).then_some((id, (found, sigma)))
        };
        let ids = (0..seen.len()).filter(|id| !matched.marks.contains_key(id));
        ids.filter_map(look).collect()
    }

    /// How many of the body's points, of `every`-th, have a mark where the camera observes them, and how far
    /// off these are in the median.
    pub(super) fn score(&self, view: &View, every: usize) -> (usize, f64) {
        let seen = self.seen(view);
        let off: Vec<f64> = (0..seen.len())
            .step_by(every)
            .filter_map(|id| {
                let spacing = self.spacing(&seen, id)?;
                let (_, distance) = self.marks.nearest(seen[id]?, MOST_DEVIATION * spacing)?;
                Some(distance / spacing)
            })
            .collect();
        (off.len(), if off.is_empty() { 1.0 } else { median(&off) })
    }
}
