//! World places of a view in another unit than those of the others.

use super::{
    Fault,
    chart_size::{explained, places},
    column_units::{COLUMNS, in_unit},
    evidence::Evidence,
    finding::{Freedom, Proposal, Severity},
    unit_ratios::{tidy, unit_ratios},
};
use crate::geometry::Point3;

pub(super) struct UnitsMixed;

impl Fault for UnitsMixed {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let all_miss = |view: &usize| {
            let present = evidence.present(*view);
            !present.is_empty() && evidence.suspects(*view).len() == present.len()
        };
        let views = (0..evidence.views.len()).filter(all_miss);
        let views = views.map(|view| (view, evidence.present(view)));
        let views = views.filter(|(view, present)| !evidence.is_slight(*view, present));
        views.filter_map(|(view, present)| units(evidence, view, &present)).collect()
    }
}

/// All coordinates of a view, or some, in another unit.
fn units(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let columns = [([true; 3], "X, Y and Z")].into_iter().chain(COLUMNS);
    let columns = columns.chain([([true, true, false], "X and Y")]);
    for ratio in unit_ratios() {
        for (which, name) in columns.clone() {
            let map = |scaled: Point3| in_unit(evidence, which, ratio, scaled);
            let left = explained(evidence, view, cameras, &map);
            if !cameras.iter().all(|camera| evidence.accepts((view, *camera), left)) {
                continue;
            }
            let what =
                format!("{name} are {} times what they should be: another unit", tidy(ratio));
            return Some(Proposal {
                freedom: Freedom::Choice,
                left,
                cells: cameras.iter().map(|camera| (view, *camera)).collect(),
                key: what.clone(),
                figures: vec![("scale".into(), ratio)],
                changes: places(evidence, view, map),
                ..Proposal::itself(
                    "units-mixed",
                    Severity::Fatal,
                    what,
                    "give all world coordinates in one unit, or let these be scaled",
                )
            });
        }
    }
    None
}
