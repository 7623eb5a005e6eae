//! What is fitted and what is judged: whole views, or slabs of space, never single points. Points of
//! one chart placement are near-copies, and an exam that holds copies of the lessons tests nothing.

use super::Dataset;
use crate::geometry::Vector3;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use wheatstone_numeric::{random::Random, statistics};

/// Whether points lie among those that the fit has seen, or beyond them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum FoldKind {
    /// Views on both sides were fitted.
    Interpolation,
    /// This is the outermost view.
    Extrapolation,
}

/// Points set apart from a fit, to judge it by.
#[derive(Clone, Debug, PartialEq)]
pub struct Fold {
    /// The view's name, or the slab's bounds.
    pub view: String,
    /// Whether it lies among the others.
    pub kind: FoldKind,
    /// Indices into the dataset's correspondences.
    pub held_out: Vec<usize>,
}

impl Fold {
    /// The points to fit to, and those set apart.
    #[must_use]
    pub fn divide(&self, data: &Dataset) -> (Dataset, Dataset) {
        let mut held_out = vec![false; data.correspondences.len()];
        for index in &self.held_out {
            held_out[*index] = true;
        }
        (data.subset(|index, _| !held_out[index]), data.subset(|index, _| held_out[index]))
    }
}

/// More folds than this cost time and tell no more: neighbouring views then share one.
const MOST_FOLDS: usize = 12;

/// Slabs where a file has no views: with seven, as many as the paper has chart planes, each
/// training part still reaches over 5/7 of the range.
const SLABS: usize = 7;

/// One point of so many, where there are more than `most` pixels, and how many that is: one where all are taken.
pub(crate) fn sample(data: &Dataset, most: usize, seed: u64) -> (usize, Cow<'_, Dataset>) {
    let every = (data.correspondences.len() * data.cameras).div_ceil(most).max(1);
    if every == 1 {
        return (every, Cow::Borrowed(data));
    }
    // Drawn, since every so-manieth may all lie in a few columns of a chart.
    let mut random = Random::new(seed);
    let drawn: Vec<bool> = data.correspondences.iter().map(|_| random.below(every) == 0).collect();
    (every, Cow::Owned(data.subset(|row, _| drawn[row])))
}

/// Divides the points whose place is known into folds, by view where there are views and by slab
/// along the longest axis where there are none, in order along that axis. The first and the last
/// fold are extrapolation.
#[must_use]
pub fn folds(data: &Dataset) -> Vec<Fold> {
    let groups = if data.views.len() >= 2 { by_view(data) } else { by_slab(data) };
    let groups = merge(groups, MOST_FOLDS);
    let last = groups.len().saturating_sub(1);
    let kind = |place: usize| {
        if place == 0 || place == last { FoldKind::Extrapolation } else { FoldKind::Interpolation }
    };
    groups
        .into_iter()
        .enumerate()
        .map(|(place, (view, held_out))| Fold { view, kind: kind(place), held_out })
        .collect()
}

/// Folds across the views: slabs along the two axes on which the views do not differ most. They tell
/// how a fit does beside the points that it saw, where there are too few views to tell much by
/// leaving one out.
#[must_use]
pub fn folds_across(data: &Dataset) -> Vec<Fold> {
    const ACROSS: usize = 3;
    let along = if data.views.len() >= 2 {
        let axis = longest_axis(view_centres(data).into_iter().flatten());
        axis.iamax()
    } else {
        longest_extent(data)
    };
    let slabs = (0..3).filter(|axis| *axis != along).flat_map(|axis| slabs(data, axis, ACROSS));
    slabs.map(|(view, held_out)| Fold { view, kind: FoldKind::Interpolation, held_out }).collect()
}

/// In how few layers the known points lie: the least number of separate levels along any world axis.
/// Gaps of a twentieth of the extent separate levels; points that fill an axis are no layers.
#[must_use]
pub fn fewest_layers(data: &Dataset) -> Option<usize> {
    let layers = |axis: usize| {
        let mut values: Vec<f64> = data.known().map(|(world, _)| world[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        let gap = extent(data, axis) / 20.0;
        1 + values.windows(2).filter(|pair| pair[1] - pair[0] > gap).count()
    };
    (0..3).map(layers).filter(|count| *count > 1).min()
}

type Group = (String, Vec<usize>);

/// Between the names of views that share a fold.
const BETWEEN: &str = ", ";

/// How many views there are in how many folds of these names, where some of them share one.
pub fn grouped<'n>(folds: impl IntoIterator<Item = &'n str>) -> Option<[usize; 2]> {
    let (views, folds) = folds
        .into_iter()
        .fold((0, 0), |(views, folds), name| (views + name.split(BETWEEN).count(), folds + 1));
    (views > folds).then_some([views, folds])
}

/// The middle of each view's known points, where it has any.
fn view_centres(data: &Dataset) -> Vec<Option<Vector3>> {
    let mut sums = vec![(Vector3::zeros(), 0.0); data.views.len()];
    for (world, row) in data.known() {
        sums[row.view].0 += world.coords;
        sums[row.view].1 += 1.0;
    }
    sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
}

/// Views, ordered along the line on which they differ most.
fn by_view(data: &Dataset) -> Vec<Group> {
    let centres = view_centres(data);
    let axis = longest_axis(centres.iter().flatten().copied());
    let mut members = vec![Vec::new(); data.views.len()];
    for (index, row) in data.correspondences.iter().enumerate() {
        if row.world.is_some() {
            members[row.view].push(index);
        }
    }
    let mut views: Vec<(f64, Group)> = data
        .views
        .iter()
        .zip(members)
        .zip(centres)
        .filter_map(|((name, held_out), centre)| {
            Some((centre?.dot(&axis), (name.clone(), held_out)))
        })
        .collect();
    views.sort_by(|a, b| a.0.total_cmp(&b.0));
    views.into_iter().map(|(_, group)| group).collect()
}

/// Extent of the known points along a world axis.
fn extent(data: &Dataset, axis: usize) -> f64 {
    let values: Vec<f64> = data.known().map(|(world, _)| world[axis]).collect();
    statistics::percentile(&values, 1.0) - statistics::percentile(&values, 0.0)
}

/// The world axis on which the points differ most.
fn longest_extent(data: &Dataset) -> usize {
    let longer = |a: &usize, b: &usize| extent(data, *a).total_cmp(&extent(data, *b));
    (0..3).rev().max_by(longer).unwrap_or(2)
}

/// Slabs along the longest axis.
fn by_slab(data: &Dataset) -> Vec<Group> {
    slabs(data, longest_extent(data), SLABS)
}

/// At most `most` slabs of equally many points along a world axis, never dividing points that lie on
/// one level.
fn slabs(data: &Dataset, axis: usize, most: usize) -> Vec<Group> {
    let mut points: Vec<(f64, usize)> = data
        .correspondences
        .iter()
        .enumerate()
        .filter_map(|(index, row)| Some((row.world?[axis], index)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // Readings of one level of a stage or a chart differ by rounding only.
    let same_level = 1e-6 * extent(data, axis);
    let mut levels: Vec<Vec<(f64, usize)>> = Vec::new();
    for point in points {
        match levels.last_mut() {
            Some(level) if point.0 - level[level.len() - 1].0 <= same_level => level.push(point),
            _ => levels.push(vec![point]),
        }
    }
    let name = |slab: &[(f64, usize)]| {
        let letter = ["X", "Y", "Z"][axis];
        let (low, high) = (slab[0].0, slab[slab.len() - 1].0);
        if high - low <= same_level {
            format!("{letter} = {}", short(low))
        } else {
            format!("{letter} = {} .. {}", short(low), short(high))
        }
    };
    let count = most.min(levels.len());
    let groups: Vec<(String, Vec<(f64, usize)>)> =
        merge(levels.into_iter().map(|level| (String::new(), level)).collect(), count);
    groups
        .into_iter()
        .map(|(_, slab)| (name(&slab), slab.iter().map(|point| point.1).collect()))
        .collect()
}

/// Four significant digits.
fn short(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { libm::log10(value.abs()).floor() as i32 };
    let places = (3 - digits).clamp(0, 12) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// Joins neighbours until there are at most `most` groups with about equally many members.
fn merge<T>(groups: Vec<(String, Vec<T>)>, most: usize) -> Vec<(String, Vec<T>)> {
    if groups.len() <= most {
        return groups;
    }
    let total: usize = groups.iter().map(|(_, members)| members.len()).sum();
    let mut merged: Vec<(String, Vec<T>)> = Vec::new();
    let mut before = 0;
    for (name, members) in groups {
        // The fold in which the middle of this group falls.
        let place = (2 * before + members.len()) * most / (2 * total.max(1));
        before += members.len();
        if merged.is_empty() || place >= merged.len() {
            merged.push((name, members));
        } else if let Some((names, all)) = merged.last_mut() {
            *names = format!("{names}{BETWEEN}{name}");
            all.extend(members);
        }
    }
    merged
}

/// The direction in which points differ most, by power iteration on their scatter.
fn longest_axis(points: impl Iterator<Item = Vector3> + Clone) -> Vector3 {
    let count = points.clone().count().max(1) as f64;
    let centre = points.clone().sum::<Vector3>() / count;
    let scatter =
        points.map(|p| (p - centre) * (p - centre).transpose()).sum::<nalgebra::Matrix3<f64>>();
    let longest =
        (0..3).max_by(|a, b| scatter[(*a, *a)].total_cmp(&scatter[(*b, *b)])).unwrap_or(2);
    let mut axis = scatter.column(longest).into_owned();
    for _ in 0..100 {
        let norm = axis.norm();
        if norm == 0.0 {
            return Vector3::z();
        }
        axis = scatter * (axis / norm);
    }
    let axis = axis.normalize();
    // Upwards along the coordinate that it follows most, so that folds come in rising order.
    if axis[axis.iamax()] < 0.0 { -axis } else { axis }
}
