//! Looks for a body in a picture, with or without points that someone has named.
//!
//! Where the body's points, or patches of them, lie on a lattice, so do their marks: patches of marks are
//! laid onto patches of the body in every way in which their labels agree, a rough camera follows from
//! each, and those cameras under which most of the body's points have marks are followed to the end. What
//! looks the same from another side is told as several readings.

use super::{
    body::{Body, Patch},
    evidence::decided,
    marks::{self, Marks},
    matching::{CLICKED, Click, Matched, Search},
    pose_hypotheses::{PoseHypothesis, ways},
    view::View,
};
use crate::{
    chart::{ChartSearch, Detection, PointId},
    imaging::GrayImage,
};
use rayon::prelude::*;
use std::collections::BTreeMap;
use wheatstone_core::geometry::{Pixel, Vector3};

/// Share of the body's points that must be matched: a closed body hides half, and shadow more.
const LEAST_SHARE: f64 = 0.2;
/// Points below which a match may be chance.
const LEAST_MATCHED: usize = 8;
/// Marks below which a patch of them tells nothing.
const LEAST_PATCH: usize = 8;
/// Patches of marks that are looked at, the largest first.
const MOST_PATCHES: usize = 6;
/// Cameras that are followed to the end.
const MOST_FOLLOWED: usize = 10;
/// Cameras that are compared by all of the body's points.
const MOST_COMPARED: usize = 80;
/// Steps that a reading is moved to find the truth beside it: as far as a rough camera is off.
const MOST_STEPS: usize = 6;
/// Readings that are moved at a time.
const MOST_RIVALS: usize = 4;
/// Sets of marks, of one size and colour, that are searched.
const MOST_SETS: usize = 3;
/// Looks for a body among the dark and the bright marks that were seen at each size of the picture.
pub(super) fn find(
    body: &Body,
    sizes: &[[Marks; 2]],
    image: &GrayImage,
    clicks: &[Click],
) -> ChartSearch {
    let frame = (
        Pixel::new((image.width() as f64 - 1.0) / 2.0, (image.height() as f64 - 1.0) / 2.0),
        image.width().max(image.height()) as f64,
    );
    let count = body.points.len();
    let least = LEAST_MATCHED.min(count).max((LEAST_SHARE * count as f64) as usize);
    let sets: Vec<(usize, usize)> =
        (0..sizes.len()).flat_map(|size| [(size, 0), (size, 1)]).collect();
    let at =
        |(size, side): (usize, usize)| Search { body, marks: &sizes[size][side], frame, least };
    let mut best: Vec<(Matched, usize, usize)> = Vec::new();
    for (size, side) in &sets {
        let matched = clicked(&at((*size, *side)), clicks);
        best.extend(matched.map(|matched| (matched, *size, *side)));
    }
    let led = !best.is_empty();
    if !led {
        best = recognised(&sets, at, clicks);
    }
    let Some((size, side)) = best
        .iter()
        .max_by_key(|(matched, size, side)| (matched.marks.len(), 9 - size, 1 - side))
        .map(|(_, size, side)| (*size, *side))
    else {
        return ChartSearch::NotFound(unseen(clicks, count));
    };
    best.retain(|(_, other, polarity)| (*other, *polarity) == (size, side));
    // Marks of other sizes may be seen better a size away.
    let mut all = sizes[size][side].clone();
    for beside in [size.checked_sub(1), Some(size + 1)].into_iter().flatten() {
        if let Some(other) = sizes.get(beside) {
            all = marks::united(&all, &other[side]);
        }
    }
    let search = Search { body, marks: &all, frame, least };
    let regrown = best.into_iter().filter_map(|(matched, ..)| {
        let old = &sizes[size][side];
        let same = |mark: &usize| all.nearest(old.at(*mark), 1.0).map(|it| it.0);
        let first: BTreeMap<usize, usize> =
            matched.marks.iter().filter_map(|(id, mark)| Some((*id, same(mark)?))).collect();
        let view = View::fit(&search.pairs(&first), frame.0, frame.1)?;
        search.grow(&view, &first, &BTreeMap::new())
    });
    let found = rivals(regrown.collect(), count);
    told(&search, image, if led { found } else { decided(&search, image, found, clicks) }, clicks)
}

fn unseen(clicks: &[Click], count: usize) -> String {
    if clicks.is_empty() {
        format!(
            "the {count} points of the list could not be identified reliably: name four or more of them in a start file, with the view of each in its column `view`"
        )
    } else {
        format!(
            "the {count} points of the list could not be identified reliably from the {} in the start file: name four or more that are not on one line, with the view of each in its column `view`",
            clicks.len()
        )
    }
}

/// What is recognised in the sets of marks, those with the largest patches first, until most is found.
fn recognised<'a>(
    sets: &[(usize, usize)],
    at: impl Fn((usize, usize)) -> Search<'a>,
    clicks: &[Click],
) -> Vec<(Matched, usize, usize)> {
    let mut promising: Vec<_> = sets
        .iter()
        .map(|set| {
            let patches = at(*set).marks.patches(LEAST_PATCH, MOST_PATCHES);
            (patches.first().map_or(0, Patch::len), *set, patches)
        })
        .filter(|(size, ..)| *size > 0)
        .collect();
    promising.sort_by_key(|(size, ..)| std::cmp::Reverse(*size));
    let mut found = Vec::new();
    for (_, set, patches) in promising.into_iter().take(MOST_SETS) {
        let search = at(set);
        let mut ways = ways(&search, &patches);
        ways.retain(|way| can_agree(&search, way, clicks));
        let sort = |ways: &mut Vec<PoseHypothesis>| {
            ways.sort_by(|a, b| b.score.0.cmp(&a.score.0).then(a.score.1.total_cmp(&b.score.1)));
        };
        sort(&mut ways);
        ways.truncate(MOST_COMPARED);
        ways.iter_mut().for_each(|way| way.score = search.score(&way.view, 1));
        sort(&mut ways);
        ways.truncate(MOST_FOLLOWED);
        let mut grown: Vec<Matched> = ways
            .par_iter()
            .filter_map(|way| search.grow(&way.view, &way.pairs, &BTreeMap::new()))
            .collect();
        // A step aside hides a row or two, not half of the body.
        grown.retain(|matched| 2 * matched.marks.len() >= search.body.points.len());
        let readings = beside(&search, grown, clicks);
        let most = readings.first().map_or(0, |matched| matched.marks.len());
        found.extend(readings.into_iter().map(|matched| (matched, set.0, set.1)));
        if most * 10 >= search.body.points.len() * 8 {
            break;
        }
    }
    found
}

/// The best of these readings, of those one step of a lattice off, which have nearly as many marks and may
/// hide the truth, and of the body's symmetries.
fn beside(search: &Search, grown: Vec<Matched>, clicks: &[Click]) -> Vec<Matched> {
    let count = search.body.points.len();
    let best = |all: Vec<Matched>| {
        let (agreeing, others): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|matched| agrees(search, matched, clicks));
        let mut best = rivals(if agreeing.is_empty() { others } else { agreeing }, count);
        best.truncate(MOST_RIVALS);
        best
    };
    let mut readings = best(grown);
    for _ in 0..MOST_STEPS {
        let others: Vec<Vec<Matched>> = readings
            .par_iter()
            .map(|matched| {
                stepped(search, matched).into_iter().chain(twins(search, matched)).collect()
            })
            .collect();
        let counts = |all: &[Matched]| all.iter().map(|it| it.marks.len()).collect::<Vec<_>>();
        let before = counts(&readings);
        readings = best(readings.into_iter().chain(others.into_iter().flatten()).collect());
        if counts(&readings) == before {
            break;
        }
    }
    readings.retain(|matched| agrees(search, matched, clicks));
    readings
}

/// What comes of a reading when every mark is given to the point one step of a lattice on.
fn stepped(search: &Search, matched: &Matched) -> Vec<Matched> {
    let body = search.body;
    let mut steps: Vec<Vector3> = Vec::new();
    for patch in body.patches.iter().take(3) {
        for (column, row) in [(1, 0), (0, 1)] {
            let all: Vec<Vector3> = patch
                .iter()
                .filter_map(|((c, r), id)| {
                    Some(body.points[*patch.get(&(c + column, r + row))?] - body.points[*id])
                })
                .collect();
            let step = all.iter().sum::<Vector3>() / all.len().max(1) as f64;
            let near = |other: &Vector3| {
                (other - step).norm().min((other + step).norm()) < 0.1 * step.norm()
            };
            if step.norm() > 0.0 && !steps.iter().any(near) {
                steps.push(step);
            }
        }
    }
    let both_ways = steps.into_iter().flat_map(|step| [step, -step]);
    let moved = both_ways.filter_map(|step| {
        let next = |id: usize| {
            let place = body.points[id] + step;
            let off = |other: &&usize| (body.points[**other] - place).norm();
            let nearest = body.neighbours[id].iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
            (off(&nearest) < 0.25 * step.norm()).then_some(*nearest)
        };
        let marks: BTreeMap<usize, usize> =
            matched.marks.iter().filter_map(|(id, mark)| Some((next(*id)?, *mark))).collect();
        let view = View::fit(&search.pairs(&marks), search.frame.0, search.frame.1)?;
        search.grow(&view, &marks, &BTreeMap::new())
    });
    moved.collect()
}

/// The readings that the body's own symmetries make of this one.
fn twins(search: &Search, matched: &Matched) -> Vec<Matched> {
    let turned = search.body.symmetries.iter().filter_map(|to| {
        let marks: BTreeMap<usize, usize> =
            matched.marks.iter().filter_map(|(id, mark)| Some((to[*id]?, *mark))).collect();
        let view = View::fit(&search.pairs(&marks), search.frame.0, search.frame.1)?;
        search.grow(&view, &marks, &BTreeMap::new())
    });
    turned.collect()
}

/// Whether a camera observes the named points nearer to where they are said to be than to their neighbours.
fn can_agree(search: &Search, way: &PoseHypothesis, clicks: &[Click]) -> bool {
    let seen = if clicks.is_empty() { Vec::new() } else { search.seen(&way.view) };
    clicks.iter().all(|(id, at)| {
        let spacing = search.spacing(&seen, *id).unwrap_or(0.0);
        seen[*id].is_some_and(|seen| (seen - at).norm() < CLICKED.max(1.5 * spacing))
    })
}

/// Whether the named points are where they are said to be.
fn agrees(search: &Search, matched: &Matched, clicks: &[Click]) -> bool {
    clicks.iter().all(|(id, at)| {
        let meant = search.marks.nearest(*at, CLICKED).map(|(mark, _)| mark);
        meant.is_none_or(|mark| matched.marks.get(id) == Some(&mark))
    })
}

/// What the named points alone lead to.
fn clicked(search: &Search, clicks: &[Click]) -> Option<Matched> {
    let held: BTreeMap<usize, usize> = clicks
        .iter()
        .filter_map(|(id, at)| Some((*id, search.marks.nearest(*at, CLICKED)?.0)))
        .collect();
    if held.len() < 4 {
        return None;
    }
    let view = View::fit(&search.pairs(&held), search.frame.0, search.frame.1)?;
    search.grow(&view, &held, &held)
}

/// The best readings: those that no other beats clearly, each once.
fn rivals(mut found: Vec<Matched>, count: usize) -> Vec<Matched> {
    found.sort_by(|a, b| b.marks.len().cmp(&a.marks.len()).then(a.disorder.total_cmp(&b.disorder)));
    let Some(most) = found.first().map(|best| best.marks.len()) else { return found };
    let missing = (count - most) as f64;
    // Two standard deviations of a count.
    let most_missing = missing + 2.0 * (missing + 1.0).sqrt();
    let least = found.iter().map(|it| it.disorder).fold(f64::INFINITY, f64::min);
    let straightest = found.iter().map(|it| it.curvature).fold(f64::INFINITY, f64::min);
    let mut kept: Vec<Matched> = Vec::new();
    for matched in found {
        let same = |other: &Matched| {
            let both = matched.marks.iter().filter(|(id, mark)| other.marks.get(id) == Some(mark));
            2 * both.count() > matched.marks.len()
        };
        let counts = (count - matched.marks.len()) as f64 <= most_missing;
        // A camera that observes the body wrongly observes it twice as badly, or no worse at all.
        let orderly = matched.disorder < 2.0 * least + 0.002;
        let straight = matched.curvature < 3.0 * straightest + 0.05;
        if counts && orderly && straight && !kept.iter().any(same) {
            kept.push(matched);
        }
    }
    kept
}

/// Readings with their centres and sigmas, the one upright first.
fn told(search: &Search, image: &GrayImage, found: Vec<Matched>, clicks: &[Click]) -> ChartSearch {
    let mut measured: BTreeMap<usize, (Pixel, f64)> = BTreeMap::new();
    let mut readings: Vec<(f64, Detection)> = Vec::new();
    for matched in &found {
        let mut all: BTreeMap<PointId, (Pixel, f64)> = search.missed(image, matched);
        for (id, mark) in &matched.marks {
            let one = measured.entry(*mark).or_insert_with(|| search.marks.measure(image, *mark));
            all.insert(*id, *one);
        }
        let detection = Detection {
            points: all.iter().map(|(id, (pixel, _))| (*id, *pixel)).collect(),
            sigmas: all.values().map(|(_, sigma)| *sigma).collect(),
        };
        readings.push((uprightness(search.body, &detection), detection));
    }
    readings.retain(|(_, reading)| reading.points.len() >= search.least);
    if readings.is_empty() {
        return ChartSearch::NotFound(unseen(clicks, search.body.points.len()));
    }
    readings.sort_by(|a, b| b.0.total_cmp(&a.0));
    ChartSearch::Found(readings.into_iter().map(|(_, reading)| reading).collect())
}

/// How far the body's x goes to the right and its y down, as cosines, summed.
fn uprightness(body: &Body, detection: &Detection) -> f64 {
    let count = detection.points.len().max(1) as f64;
    let points = || detection.points.iter().map(|(id, pixel)| (body.points[*id], *pixel));
    let middle = points().map(|(_, pixel)| pixel.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let centre = points().map(|(point, _)| point.coords).sum::<nalgebra::Vector3<f64>>() / count;
    let cosine = |axis: usize| {
        let (mut along, mut own, mut seen) = (0.0, 0.0, 0.0);
        for (point, pixel) in points() {
            let (a, b) = (point[axis] - centre[axis], pixel[axis] - middle[axis]);
            along += a * b;
            own += a * a;
            seen += b * b;
        }
        along / (own * seen).sqrt().max(f64::MIN_POSITIVE)
    };
    cosine(0) + 0.5 * cosine(1)
}
