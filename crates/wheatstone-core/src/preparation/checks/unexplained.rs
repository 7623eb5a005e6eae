//! Cameras whose views agree on no lens and place, for whatever reason: nothing that is badly wrong may
//! pass in silence because its name is not known.

use super::{
    Fault,
    board_order::relabelled,
    evidence::Evidence,
    finding::{Freedom, Proposal, Severity},
    pairs::{Pair, extent},
};

pub(super) struct Unexplained;

/// Share of the picture's part with points beyond which errors are no lens's: odd ones leave a tenth.
const GREAT: f64 = 0.02;

/// Beyond this no optics are to blame: points paired at random are off by a third.
const WRONG: f64 = 0.08;

impl Fault for Unexplained {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let cameras = (0..evidence.data.cameras).filter_map(|camera| unexplained(evidence, camera));
        let views = (0..evidence.views.len()).filter(|view| !evidence.has_estimated_pose(*view));
        cameras.chain(views.filter_map(|view| pictures(evidence, view))).collect()
    }
}

/// Error over the good level beyond which a view whose pose was estimated has another reason than its lens: none of 50
/// simulated captures without fault is named by it.
const FAR: f64 = 10.0;

/// Pictures of a view at a given place that are farther off than any lens explains, where nothing with a name explains
/// it: they are left out.
fn pictures(evidence: &Evidence, view: usize) -> Option<Proposal> {
    let is_far = |camera: &usize| {
        let error = evidence.cells[view][*camera].error;
        error > GREAT * extent_of(evidence, *camera)
            && evidence.excess((view, *camera)) > FAR
            && !evidence.is_lost(*camera)
    };
    let far: Vec<(usize, usize)> =
        evidence.suspects(view).into_iter().filter(is_far).map(|camera| (view, camera)).collect();
    (!far.is_empty()).then(|| {
        left_out(
            evidence,
            far,
            "the points are not where those of the other views put them, and no fault that is known explains it",
        )
    })
}

/// A view that fits the others in no pose, where nothing with a name explains it: it is left out.
pub(super) fn view(evidence: &Evidence, view: usize) -> Option<Proposal> {
    let cells: Vec<(usize, usize)> =
        evidence.present(view).into_iter().map(|camera| (view, camera)).collect();
    let excess = |cell: &(usize, usize)| evidence.excess(*cell);
    let worst = cells.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)))?;
    if excess(worst) < FAR {
        return None;
    }
    let what = "the pictures fit those of the other views in no pose of the chart, and no fault that is known explains it";
    Some(left_out(evidence, cells, what))
}

/// Pictures of one view that are left out for this reason.
fn left_out(evidence: &Evidence, cells: Vec<(usize, usize)>, what: &str) -> Proposal {
    let error = |cell: &(usize, usize)| evidence.cells[cell.0][cell.1].error;
    let worst = cells.iter().map(error).fold(0.0, f64::max);
    Proposal {
        freedom: Freedom::Each,
        left: f64::INFINITY,
        changes: cells.iter().flat_map(|cell| relabelled(evidence, *cell, |_| None)).collect(),
        also: cells.clone(),
        cells,
        key: "view".into(),
        figures: vec![("median error of the worst picture, px".into(), worst)],
        ..Proposal::itself(
            "view-unexplained",
            Severity::Fatal,
            what.into(),
            "compare the pictures with their rows in the table, or let the view be left out",
        )
    }
}

fn unexplained(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    let share = seen.typical / extent_of(evidence, camera);
    if share < GREAT {
        return None;
    }
    let severity = if share < WRONG { Severity::Warning } else { Severity::Fatal };
    Some(Proposal {
        freedom: Freedom::Each,
        left: f64::INFINITY,
        cells: (0..evidence.views.len()).map(|view| (view, camera)).collect(),
        // Whatever has a name explains more.
        also: (0..evidence.views.len()).map(|view| (view, camera)).collect(),
        figures: vec![("median error of the best camera, px".into(), seen.typical)],
        ..Proposal::itself(
            "unexplained",
            severity,
            "no lens and pose fit even most views of this camera: labels, pairing of the views or chart poses are wrong, or the optics are unusual".into(),
            "compare the pictures of a few views with their rows in the table: does each point have the label and the coordinates that it has on the chart?",
        )
    })
}

/// The longer side of the part of a camera's picture that has points, in pixels.
fn extent_of(evidence: &Evidence, camera: usize) -> f64 {
    let pairs = evidence.cells.iter().flat_map(|view| view[camera].pairs.iter().copied());
    extent(&pairs.collect::<Vec<Pair>>())
}
