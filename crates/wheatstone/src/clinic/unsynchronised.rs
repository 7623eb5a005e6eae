//! A camera's picture of one view that belongs to another instant: to another view, or to none.

use super::{
    Fault,
    board_order::relabelled,
    evidence::{Evidence, LEAST},
    finding::{Change, Freedom, Proposal, Severity},
    robust_camera::RobustCamera,
};
use crate::geometry::Point3;

pub(super) struct Unsynchronised;

/// What to do about it.
const HINT: &str = "pair pictures of the same instant (by time stamp, with a hardware trigger, or with the chart at rest); `wheatstone check --fix OUT` leaves these pictures out";

impl Fault for Unsynchronised {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for cell in evidence.suspicious() {
            for other in (0..evidence.views.len()).filter(|other| *other != cell.0) {
                found.extend(another_view(evidence, cell, other));
            }
        }
        for camera in 0..evidence.data.cameras {
            found.extend(from_a_view_on(evidence, camera));
        }
        found
    }
}

/// For each point of a cell, where it was in another view.
pub(super) fn places_in(
    evidence: &Evidence,
    (view, camera): (usize, usize),
    other: usize,
) -> Vec<Option<Point3>> {
    let data = evidence.data;
    let there = &evidence.views[other].rows;
    let own = &evidence.views[view].rows;
    let place = |row: usize| Some(evidence.frame.scaled(data.correspondences[row].world?));
    let same_rank = there.len() == own.len();
    let cell = &evidence.cells[view][camera];
    cell.rows
        .iter()
        .map(|row| match &data.correspondences[*row].id {
            Some(id) => {
                let named = |r: &&usize| data.correspondences[**r].id.as_ref() == Some(id);
                there.iter().find(named).and_then(|r| place(*r))
            }
            None if same_rank => {
                let rank = own.iter().position(|r| r == row)?;
                place(there[rank])
            }
            None => by_place(evidence, view, other, place(*row)?),
        })
        .collect()
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
    if left > 1.0 || left > 0.5 * evidence.excess(cell) {
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
        code: "unsynchronised",
        severity: Severity::Fatal,
        what,
        hint: HINT.into(),
        figures: Vec::new(),
        changes: cells.iter().flat_map(nowhere).collect(),
    }
}

/// Where most of a camera's views are shifted alike, it is the first few that stand out. Then those
/// tell where the camera is, and the others fit their neighbours' places.
fn from_a_view_on(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let count = evidence.views.len();
    let suspicious: Vec<bool> =
        (0..count).map(|view| evidence.cells[view][camera].suspicious).collect();
    let first_sound = suspicious.iter().position(|suspicious| !suspicious)?;
    let sound: Vec<usize> = (first_sound..count).collect();
    if first_sound == 0 || sound.len() < 2 || sound.iter().any(|view| suspicious[*view]) {
        return None;
    }
    let seen = evidence.seen[camera].as_ref()?;
    let head: Vec<_> = (0..first_sound)
        .flat_map(|view| evidence.cells[view][camera].pairs.iter().copied())
        .collect();
    let before: RobustCamera = seen.camera.moved(&head, 20);
    let before_good = head.len() >= LEAST && before.median_error(&head) <= seen.good();
    if !before_good {
        return None;
    }
    for offset in [1_i64, -1] {
        let mut worst = 0.0_f64;
        let mut cells = Vec::new();
        for view in &sound {
            let other = *view as i64 + offset;
            let Some(other) = usize::try_from(other).ok().filter(|other| *other < count) else {
                continue;
            };
            let places = places_in(evidence, (*view, camera), other);
            let pairs: Vec<_> = places
                .iter()
                .zip(&evidence.cells[*view][camera].pairs)
                .filter_map(|(place, (_, pixel))| Some(((*place)?, *pixel)))
                .collect();
            if pairs.len() >= LEAST {
                worst = worst.max(before.median_error(&pairs) / seen.good());
                cells.push((*view, camera));
            }
        }
        // The camera before stands on few points: it may err twice as much.
        if cells.len() >= 2 && worst <= 2.0 {
            let whole: Vec<(usize, usize)> = sound.iter().map(|view| (*view, camera)).collect();
            let what = format!(
                "from view `{}` on the pictures belong to the view {}",
                evidence.views[first_sound].name,
                if offset > 0 { "after" } else { "before" }
            );
            let mut found = proposal(
                evidence,
                &whole,
                (worst / 2.0, Freedom::Choice),
                offset.to_string(),
                what,
            );
            // The first views are explained by it too.
            found.key = format!("from {first_sound}");
            return Some(found);
        }
    }
    None
}
