//! Single pictures of charts whose poses were estimated: an estimated pose follows a faulty picture in part, so that it
//! and the others of the view err alike. Each picture is judged by the pose that the view's other pictures tell.

use super::{
    FAULTS,
    chart_size::explained,
    evidence::Evidence,
    finding::{Freedom, Proposal, before_and_after},
    stretch::{RIGID, Stretch, adjusted, in_other_views, shots_as_told},
    unexplained,
};
use crate::{
    dataset::Dataset,
    geometry::{Pose, Vector3},
};
use std::f64::consts::FRAC_PI_2;

/// An explanation of a picture does better than another where it leaves less than this share of what that one leaves:
/// medians of 24 errors scatter by an eighth, and cameras err alike in both. Chosen by simulated faults.
const BETTER: f64 = 0.67;

/// Replaces what the estimated pose of a view with errors makes of its single pictures by what the pose of its other
/// pictures does.
pub(super) fn judge_by_other_pictures(evidence: &Evidence, proposals: &mut Vec<Proposal>) {
    let doubtful = |view: &usize| {
        evidence.present(*view).len() > 1
            && !evidence.suspects(*view).is_empty()
            && evidence.has_estimated_pose(*view)
    };
    for view in (0..evidence.views.len()).filter(doubtful) {
        proposals.retain(|one| one.cells.len() != 1 || one.cells[0].0 != view);
        let cameras = evidence.present(view).into_iter();
        let each: Vec<Vec<Proposal>> =
            cameras.map(|camera| of_picture(evidence, (view, camera))).collect();
        let of_all = proposals.iter().filter(|one| one.cells.iter().any(|cell| cell.0 == view));
        let of_all = of_all.map(|one| one.left).fold(f64::INFINITY, f64::min);
        // What is wrong in all pictures alike has fewer numbers than what is wrong in one.
        let is_needed =
            |one: &Proposal| one.freedom == Freedom::Choice || one.left < BETTER * of_all;
        let mut found = in_either(&each).map_or_else(|| each.concat(), |one| vec![one]);
        found.retain(is_needed);
        proposals.extend(found);
        // A pose that was estimated badly is no fault of the recording.
        if pose_in(evidence, view, &evidence.present(view)).is_none() {
            proposals.extend(unexplained::view(evidence, view));
        }
    }
    for one in proposals.iter_mut().filter(|one| one.cells.len() > 1) {
        if let Some(other) = other_of_two(evidence, one) {
            one.what = format!(
                "in camera {}, or the other way in camera {} (two cameras cannot tell which): {}",
                one.cells[0].1 + 1,
                other + 1,
                one.what
            );
            let others: Vec<(usize, usize)> =
                one.cells.iter().map(|(view, _)| (*view, other)).collect();
            one.cells.extend(others);
        }
    }
}

/// The other camera, where a fault of several pictures of one might be of the other as well: where poses are estimated, two
/// cameras show only how one moved, or when it took its pictures, relative to the other.
fn other_of_two(evidence: &Evidence, one: &Proposal) -> Option<usize> {
    let camera = one.cells[0].1;
    let is_relative = matches!(one.code, "camera-moved" | "unsynchronised");
    let is_of_one = one.cells.iter().all(|cell| cell.1 == camera);
    if !is_relative || !is_of_one || evidence.data.cameras != 2 {
        return None;
    }
    let mut views = one.cells.iter().map(|cell| cell.0);
    views.all(|view| evidence.has_estimated_pose(view)).then_some(1 - camera)
}

/// What is wrong with one of two pictures, where each is explained as well by it as the other: a chart read turned in one
/// camera is one read turned in the other whose pose is turned too.
fn in_either(each: &[Vec<Proposal>]) -> Option<Proposal> {
    let [first, second] = each else { return None };
    let [one, other] = [simplest(first)?, simplest(second)?];
    let (better, worse) = if one.left <= other.left { (one, other) } else { (other, one) };
    let is_same = better.code == worse.code && better.freedom == worse.freedom;
    // Where nothing is adjusted, the two are one explanation, of which one pose was estimated better.
    let is_as_good = better.freedom == Freedom::Choice || better.left >= BETTER * worse.left;
    (is_same && is_as_good).then(|| Proposal {
        cells: [one, other].iter().flat_map(|one| one.cells.clone()).collect(),
        what: format!(
            "in one of the two pictures (two cameras cannot tell which): {}",
            better.what
        ),
        ..better.clone()
    })
}

fn simplest(proposals: &[Proposal]) -> Option<&Proposal> {
    proposals.iter().min_by(|a, b| a.simpler_first(b))
}

/// What is wrong with a picture if the view's others are right, and no other picture of the view is wrong then.
fn of_picture(evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
    let (view, camera) = picture;
    let others: Vec<usize> =
        evidence.present(view).into_iter().filter(|other| *other != camera).collect();
    let Some(placed) = pose_in(evidence, view, &others) else { return Vec::new() };
    let data = moved(evidence, view, &placed);
    let board = evidence.views[view].board.as_ref().map(|board| {
        let turn = Pose::from_rotation_vector(Vector3::zeros(), placed.turn).rotation;
        let mut board = board.clone();
        board.centre = placed.map(board.centre);
        board.along = board.along.map(|side| turn * side);
        board
    });
    let anew = evidence.with_view_moved(view, (&data, board));
    if !anew.cells[view][camera].suspicious {
        return Vec::new();
    }
    let whole_view: Vec<(usize, usize)> =
        evidence.present(view).into_iter().map(|camera| (view, camera)).collect();
    let mut found: Vec<Proposal> =
        FAULTS.iter().flat_map(|fault| fault.of_picture(&anew, picture)).collect();
    for one in &mut found {
        one.figures.extend(before_and_after(&anew, &one.cells, one.left));
        one.also.clone_from(&whole_view);
    }
    found
}

/// The pose of a view's chart in these cameras; `None` where no pose fits all of them. What was estimated may have followed
/// another picture, in which the chart was read turned, or seems to be tilted to the other side, or fit none.
fn pose_in(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Stretch> {
    let (shots, given) = shots_as_told(evidence, (view, cameras))?;
    let normal = given.along[0].cross(&given.along[1]);
    let quarters = [0.0, 2.0, 1.0, -1.0].map(|quarters| normal * (quarters * FRAC_PI_2));
    let tilts = given.other_tilts(evidence, cameras, given.middle);
    let turned = |turn: Vector3| Stretch { turn, ..Stretch::by_scale(given, 1.0) };
    let starts = quarters.into_iter().chain(tilts).map(turned);
    let starts = starts.chain(in_other_views(evidence, view, given));
    let from = |start: Stretch| {
        let placed = adjusted(&shots, start, RIGID);
        let left = explained(evidence, view, cameras, &|place| placed.map(place));
        (left <= 1.0).then_some(placed)
    };
    starts.into_iter().find_map(from)
}

/// The data with a view's points where its chart is placed.
fn moved(evidence: &Evidence, view: usize, placed: &Stretch) -> Dataset {
    let mut data = evidence.data.clone();
    for row in &evidence.views[view].rows {
        let world = &mut data.correspondences[*row].world;
        *world = world.map(|place| evidence.frame.world(placed.map(evidence.frame.scaled(place))));
    }
    data
}
