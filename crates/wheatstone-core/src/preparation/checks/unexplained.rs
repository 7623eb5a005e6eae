//! Cameras whose views agree on no lens and place, for whatever reason: nothing that is badly wrong may
//! pass in silence because its name is not known.

use super::{
    Fault,
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
        (0..evidence.data.cameras).filter_map(|camera| unexplained(evidence, camera)).collect()
    }
}

fn unexplained(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    let pairs: Vec<Pair> =
        evidence.cells.iter().flat_map(|view| view[camera].pairs.iter().copied()).collect();
    let share = seen.typical / extent(&pairs);
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
