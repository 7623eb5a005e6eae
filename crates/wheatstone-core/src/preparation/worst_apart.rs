//! A large fault of some views bends the cameras and charts that are adjusted together with them: other views seem to have
//! faults, or nothing explains these. Then the charts are placed once more without the views that err most.

use super::{
    after_placing::{Placed, rows_placed},
    checks::{self, Examination, Finding, Severity},
};
use crate::{
    Error, Result,
    dataset::Dataset,
    fit::bundle::{CameraMotion, PoseChange},
    geometry::{Point3, Pose},
};
use std::collections::BTreeMap;

/// Views that are set apart at most: each costs a placement, which is what limits them.
const APART: usize = 3;

/// Of so many views at most one is set apart: those that stay must be the most.
const SHARE: usize = 3;

/// What shows in charts that were placed, by an examination of them, and in the cameras' relative poses; `rows` tells from
/// which of the `recorded` rows each comes.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub(super) fn examine_placed(
    (recorded, rows): (&Dataset, &[usize]),
    (placed, estimated): &Placed,
    examine: &dyn Fn(&Dataset) -> Examination,
    place: &dyn Fn(&Dataset) -> Result<Placed>,
) -> Result<Examination> {
    let mut best = examine(placed);
    let of_views = |motion: &&CameraMotion| motion.change == PoseChange::FewViews;
    let lasting = estimated.motion.as_ref().filter(|motion| !of_views(motion));
    if lasting.is_some_and(|motion| checks::name_motion(&mut best.findings, motion, placed)) {
        return Ok(best);
    }
    let mut apart: Vec<usize> = Vec::new();
    let mut now = placed.clone();
    let most = APART.min(recorded.views.len() / SHARE);
    while apart.len() < most && unclear(&best) > CLEAR {
        let is_next = |view: &usize| !apart.contains(view);
        let Some(worst) = checks::worst_views(&now).into_iter().find(is_next) else { break };
        apart.push(worst);
        let Some(anew) = placed_without(&apart, (recorded, rows), placed, place)? else { break };
        let found = examine(&anew);
        if unclear(&found).0 > 0 && unclear(&found) < unclear(&best) {
            best = found;
        }
        now = anew;
    }
    if let Some(motion) = estimated.motion.as_ref().filter(of_views) {
        checks::name_motion(&mut best.findings, motion, placed);
    }
    Ok(best)
}

/// One fault with a name.
const CLEAR: (usize, usize) = (1, 0);

/// How many fatal faults of views there are, and how many views have one of which nothing is known but that.
fn unclear(examination: &Examination) -> (usize, usize) {
    let is_of_views = |one: &&Finding| one.severity == Severity::Fatal && !one.views.is_empty();
    let found = || examination.findings.iter().filter(is_of_views);
    let unexplained = found().filter(|finding| finding.code == "view-unexplained");
    (found().count(), unexplained.map(|finding| finding.views.len()).sum())
}

/// All charts where they are placed without some views, whose own keep their poses among the others. `None` where the rest
/// cannot be placed.
fn placed_without(
    views: &[usize],
    (recorded, rows): (&Dataset, &[usize]),
    placed: &Dataset,
    place: &dyn Fn(&Dataset) -> Result<Placed>,
) -> Result<Option<Dataset>> {
    let is_kept = |row: &usize| !views.contains(&recorded.correspondences[*row].view);
    let kept: Vec<usize> = (0..recorded.correspondences.len()).filter(is_kept).collect();
    let rest = recorded.subset(|_, row| !views.contains(&row.view));
    let (rest_placed, estimated) = match place(&rest) {
        Ok(found) => found,
        Err(Error::TooFew { .. } | Error::Degenerate { .. }) => return Ok(None),
        Err(other) => return Err(other),
    };
    let of_rest = rows_placed(&rest, &estimated).into_iter().map(|row| kept[row]);
    let places: BTreeMap<usize, Point3> = of_rest
        .zip(&rest_placed.correspondences)
        .filter_map(|(row, c)| Some((row, c.world?)))
        .collect();
    let both = rows.iter().zip(&placed.correspondences);
    let pairs: Vec<(Point3, Point3)> =
        both.filter_map(|(row, c)| Some((c.world?, *places.get(row)?))).collect();
    let Some(moved) = Pose::aligning(&pairs) else { return Ok(None) };
    let mut apart = placed.clone();
    for (row, c) in rows.iter().zip(&mut apart.correspondences) {
        let world = c.world.map(|world| moved.transform(world));
        c.world = places.get(row).copied().or(world);
    }
    Ok(Some(apart))
}
