//! A camera's picture of one view that belongs to another instant: to another view, or to none.

use super::{
    Fault,
    board_order::relabelled,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
};
use crate::geometry::Point3;

pub(super) struct Unsynchronised;

/// What to do about it.
const HINT: &str = "pair pictures of the same instant (by time stamp, with a hardware trigger, or with the chart at rest), or let these pictures be left out";

/// Other views that are tried for all suspicious pictures together, to either side: those next to it always.
const REACH: usize = 20_000;

/// Views from which on pictures may belong to the next view: so many are tried, then those between the best.
const TRIED: usize = 100;

impl Fault for Unsynchronised {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        if !evidence.are_pictures {
            return found;
        }
        let reach = reach(evidence);
        for cell in evidence.suspicious() {
            found.extend(another_view_within(evidence, cell, reach));
        }
        for camera in 0..evidence.data.cameras {
            found.extend(from_a_view_on(evidence, camera));
        }
        found
    }

    fn of_picture(&self, evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
        another_view_within(evidence, picture, reach(evidence))
    }
}

/// How many other views are tried for a picture, to either side.
fn reach(evidence: &Evidence) -> usize {
    REACH / evidence.suspicious().len().max(1)
}

/// Other views that a picture may belong to, of so many to either side and those next to it.
fn another_view_within(evidence: &Evidence, cell: (usize, usize), reach: usize) -> Vec<Proposal> {
    let last = evidence.views.len().min(cell.0.saturating_add(reach + 2));
    let others = cell.0.saturating_sub(reach + 1)..last;
    let others = others.filter(|other| *other != cell.0);
    others.filter_map(|other| another_view(evidence, cell, other)).collect()
}

/// For each point of a cell, where it was in another view.
pub(super) fn places_in(
    evidence: &Evidence,
    (view, camera): (usize, usize),
    other: usize,
) -> Vec<Option<Point3>> {
    let place = |row: usize| Some(evidence.frame.scaled(evidence.data.correspondences[row].world?));
    let rows = evidence.cells[view][camera].rows.iter();
    rows.map(|row| {
        if is_matched(evidence, view, other, *row) {
            row_in(evidence, view, other, *row).and_then(place)
        } else {
            by_place(evidence, view, other, place(*row)?)
        }
    })
    .collect()
}

/// Whether names or numbers say which point of another view a row's is.
fn is_matched(evidence: &Evidence, view: usize, other: usize, row: usize) -> bool {
    evidence.data.correspondences[row].id.is_some()
        || evidence.views[other].rows.len() == evidence.views[view].rows.len()
}

/// The row of the same point in another view: of the same name, or, where points have none, of the same number.
fn row_in(evidence: &Evidence, view: usize, other: usize, row: usize) -> Option<usize> {
    let data = evidence.data;
    let there = &evidence.views[other].rows;
    if let Some(id) = &data.correspondences[row].id {
        let is_named = |r: &&usize| data.correspondences[**r].id.as_ref() == Some(id);
        return there.iter().find(is_named).copied();
    }
    let own = &evidence.views[view].rows;
    let rank = own.iter().position(|r| *r == row)?;
    (there.len() == own.len()).then(|| there[rank])
}

/// The point at the same place of the chart, where the chart moved without turning much.
fn by_place(evidence: &Evidence, view: usize, other: usize, own: Point3) -> Option<Point3> {
    let (from, to) = (evidence.views[view].board.as_ref()?, evidence.views[other].board.as_ref()?);
    if (from.pitch[0] / to.pitch[0] - 1.0).abs() > 0.01 {
        return None;
    }
    // In the plane, measured from the origin of the world: a stage moves charts along their normal.
    let along = |axis: usize| own.coords.dot(&to.along[axis]);
    let flat = [along(0), along(1)];
    let centre = [0, 1].map(|axis| to.centre.coords.dot(&to.along[axis]));
    let step = [0, 1].map(|axis| flat[axis] - centre[axis]);
    Some(to.centre + to.along[0] * step[0] + to.along[1] * step[1])
}

fn another_view(evidence: &Evidence, cell: (usize, usize), other: usize) -> Option<Proposal> {
    // The other view may be of another camera model's sound part only: its world is what counts.
    let places = places_in(evidence, cell, other);
    let left = evidence.explained(cell, |index, (_, pixel)| Some((places[index]?, pixel)));
    if !evidence.accepts(cell, left) {
        return None;
    }
    let offset = other as i64 - cell.0 as i64;
    let what = match offset {
        1 => "the picture belongs to the next view".to_owned(),
        -1 => "the picture belongs to the view before".into(),
        _ => format!("the picture belongs to view `{}`", evidence.views[other].name),
    };
    let key = if offset.abs() == 1 { offset.to_string() } else { format!("to {other}") };
    Some(proposal(evidence, &[cell], (left, Freedom::Choice), key, what))
}

pub(super) fn proposal(
    evidence: &Evidence,
    cells: &[(usize, usize)],
    (left, freedom): (f64, Freedom),
    key: String,
    what: String,
) -> Proposal {
    let nowhere = |cell: &(usize, usize)| -> Vec<Change> { relabelled(evidence, *cell, |_| None) };
    Proposal {
        freedom,
        left,
        cells: cells.to_vec(),
        key,
        changes: cells.iter().flat_map(nowhere).collect(),
        ..Proposal::itself("unsynchronised", Severity::Fatal, what, HINT)
    }
}

/// The share of its error that a camera is left with at most when pictures are paired rightly.
const EXPLAINED: f64 = 0.15;

/// From some view on each picture belongs to the view after (or before): then one camera observes all
/// views well once they are paired so.
fn from_a_view_on(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let count = evidence.views.len();
    let suspicious = evidence.cells.iter().filter(|view| view[camera].suspicious).count();
    if count < 4 || suspicious == 0 && !evidence.is_lost(camera) {
        return None;
    }
    let own = evidence.mean_error(camera);
    // Of all views, of which one may have no partner: that changes it little.
    let all = evidence.overall(camera, None, |_, _, pair| Some(pair)).unwrap_or(f64::INFINITY);
    if EXPLAINED * own.max(all) < evidence.floor() {
        return None;
    }
    let (left, from, offset) = best_pairing(evidence, camera)?;
    let lone = if offset > 0 { count - 1 } else { from };
    let without = |view: usize| evidence.overall(camera, Some(view), |_, _, pair| Some(pair));
    let plain = without(lone);
    let before = own.max(plain.unwrap_or(0.0));
    // On a stage of equal steps a camera that moves by one explains them as well: one view that is wrong for another
    // reason, and has another's picture then, must not decide.
    let error = |view: usize| evidence.cells[view][camera].error;
    let seen = (0..count).filter(|view| error(*view).is_finite());
    let worst = seen.max_by(|a, b| error(*a).total_cmp(&error(*b)));
    let least = [plain, worst.and_then(without)].into_iter().flatten().reduce(f64::min);
    let good = evidence.seen.iter().flatten().map(|seen| seen.good()).fold(f64::INFINITY, f64::min);
    if left > EXPLAINED * before
        || left > 4.0 * good
        || least.is_some_and(|least| left > 0.4 * least)
    {
        return None;
    }
    let cells: Vec<(usize, usize)> = (from..count)
        .filter(|view| evidence.at(*view, camera).is_some())
        .map(|view| (view, camera))
        .collect();
    if cells.len() < 2 {
        return None;
    }
    let what = format!(
        "from view `{}` on the pictures belong to the view {}",
        evidence.views[from].name,
        if offset > 0 { "after" } else { "before" }
    );
    let mut found =
        proposal(evidence, &cells, (0.0, Freedom::Choice), format!("from {from}"), what);
    found.also = (0..count).map(|view| (view, camera)).collect();
    found.figures = overall_figures(before, left);
    found.hint = "pair pictures of the same instant (by time stamp, with a hardware trigger, or with the chart at rest), or let them be paired so".into();
    found.changes.extend(paired(evidence, &cells, offset));
    Some(found)
}

/// The pixels of these pictures at the same points of the views that they belong to.
fn paired(evidence: &Evidence, cells: &[(usize, usize)], offset: i64) -> Vec<Change> {
    let mut changes = Vec::new();
    for (view, camera) in cells {
        let other = usize::try_from(*view as i64 + offset).ok();
        let Some(other) = other.filter(|other| *other < evidence.views.len()) else { continue };
        for row in &evidence.cells[*view][*camera].rows {
            let to = evidence.data.correspondences[*row].pixels[*camera];
            if let Some(row) = row_in(evidence, *view, other, *row) {
                changes.push(Change::Pixel { row, camera: *camera, to });
            }
        }
    }
    changes
}

/// What is left of a camera's error where pictures from some view on are paired with the view after (or before),
/// from which, and which: the least.
fn best_pairing(evidence: &Evidence, camera: usize) -> Option<(f64, usize, i64)> {
    [1, -1]
        .into_iter()
        .filter_map(|offset| best_beginning(evidence, camera, offset))
        .min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The same for one of the two.
fn best_beginning(evidence: &Evidence, camera: usize, offset: i64) -> Option<(f64, usize, i64)> {
    let count = evidence.views.len();
    let shifted: Vec<Vec<Option<Point3>>> = (0..count)
        .map(|view| match usize::try_from(view as i64 + offset) {
            Ok(other) if other < count => places_in(evidence, (view, camera), other),
            _ => Vec::new(),
        })
        .collect();
    let left_from = |from: usize| {
        // A view without partner says nothing; it must not be the one that is wrong.
        let lone = if offset > 0 { count - 1 } else { from };
        let shown = |view: usize| !evidence.cells[view][camera].pairs.is_empty();
        let lone_is_sound = shown(lone) && !evidence.cells[lone][camera].suspicious;
        let paired = (from..count).filter(|view| *view != lone && shown(*view)).take(2).count();
        if lone_is_sound || paired < 2 {
            return None;
        }
        let left = evidence.overall(camera, Some(lone), |view, index, (world, pixel)| {
            if view < from {
                Some((world, pixel))
            } else {
                Some(((*shifted[view].get(index)?)?, pixel))
            }
        })?;
        Some((left, from, offset))
    };
    let best_of = |from: &mut dyn Iterator<Item = usize>| {
        from.filter_map(left_from).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut step = (count - 1).div_ceil(TRIED);
    let mut best = best_of(&mut (0..count - 1).step_by(step))?;
    while step > 1 {
        let (first, last) = (best.1.saturating_sub(step), (best.1 + step).min(count - 2));
        step = step.div_ceil(TRIED);
        let nearer = best_of(&mut (first..=last).step_by(step));
        best = nearer.filter(|nearer| nearer.0 < best.0).unwrap_or(best);
    }
    Some(best)
}

/// Mean of the views' median errors, before and after.
pub(super) fn overall_figures(before: f64, left: f64) -> Vec<(String, f64)> {
    vec![
        ("mean over the camera's views of the median error, px".into(), before),
        ("the same with this explanation, px".into(), left),
    ]
}
