//! Faults that show only once charts of unknown place are placed, and recorded data put right by them.

use super::{
    chart_poses::EstimatedPoses,
    checks::{self, Change, Examination, Finding, Severity},
};
use crate::{Error, Result, dataset::Dataset};
use std::collections::BTreeSet;

/// Data with all charts placed, and where they stood.
pub(super) type Placed = (Dataset, EstimatedPoses);

/// Adds what shows only where charts have places. `rows` tells for each row of the placed data from which row of
/// the `recorded` data it comes: changes are made in those, as poses are estimated anew. Returns what was added.
pub(super) fn add_findings<'a>(
    examination: &'a mut Examination,
    mut after: Examination,
    placed: &Placed,
    (recorded, rows): (&Dataset, &[usize]),
) -> &'a mut [Finding] {
    let before = examination.findings.len();
    let new = |finding: &Finding| {
        examination.findings.iter().all(|f| f.code != finding.code)
            // Wherever the charts stood: it was solved for.
            && finding.code != "planes-parallel"
    };
    after.findings.retain(new);
    for finding in &mut after.findings {
        let changes = finding.changes.iter().map(|change| in_recorded(change, recorded, rows));
        finding.changes = changes.collect::<Option<_>>().unwrap_or_default();
        if finding.views.len() == placed.1.views.len() {
            doubt_mirrored(finding);
        }
    }
    let (data, estimated) = placed;
    examination.findings.extend(after.findings);
    examination.findings.extend(checks::undecided_poses(&estimated.undecided));
    let (views, points) = (estimated.views.len(), data.known().count());
    let few = estimated.freed.then(|| checks::few_views(views, points)).flatten();
    examination.findings.extend(few);
    examination.layout = after.layout;
    examination.cannot_be_seen = after.cannot_be_seen;
    &mut examination.findings[before..]
}

/// A flat chart whose labels are reversed in all pictures of a camera looks like one whose pictures are mirrored, in that
/// camera or in the others: labels put right would make a mirrored rig of those.
fn doubt_mirrored(finding: &mut Finding) {
    if finding.code == "board-mirrored" {
        finding.explanation += "; or its pictures are mirrored, or those of the other cameras: a flat chart shows them alike";
        finding.hint = "turn off what mirrors the pictures, as video programs do; or read the board in the same order in every camera".into();
        finding.changes.clear();
    }
}

/// The same change of the recorded data; `None` for a place that is estimated.
fn in_recorded(change: &Change, recorded: &Dataset, rows: &[usize]) -> Option<Change> {
    let change = change.in_rows(rows)?;
    let is_estimated = matches!(change, Change::World { row, .. } if recorded.correspondences[row].world.is_none());
    (!is_estimated).then_some(change)
}

/// From which row each row of the placed data comes: points of views that could not be placed are gone.
pub(super) fn rows_placed(recorded: &Dataset, estimated: &EstimatedPoses) -> Vec<usize> {
    let is_placed = |view: usize| {
        recorded.views.get(view).is_none_or(|name| !estimated.unplaced.contains(name))
    };
    let all = recorded.correspondences.iter().enumerate();
    let kept =
        all.filter(|(_, row)| row.world.is_some() || row.board.is_some() && is_placed(row.view));
    kept.map(|(index, _)| index).collect()
}

/// Adds the fatal faults that are left once data were put right: nothing is put right twice.
pub(super) fn add_remaining(examination: &mut Examination, after: Examination) {
    let is_known = |finding: &Finding| {
        let mut known = examination.findings.iter().filter(|known| !known.is_fixable());
        known.any(|known| known.code == finding.code && known.views == finding.views)
    };
    let mut remaining: Vec<Finding> = after
        .findings
        .into_iter()
        .filter(|one| one.severity == Severity::Fatal && !is_known(one))
        .collect();
    cannot_be_fixed(&mut remaining);
    examination.findings.extend(remaining);
    examination.layout = after.layout;
    examination.cannot_be_seen = after.cannot_be_seen;
}

/// Takes away what would put these faults right.
pub(super) fn cannot_be_fixed(findings: &mut [Finding]) {
    findings.iter_mut().for_each(|finding| finding.changes.clear());
}

/// What became of changes that findings ask for.
pub(super) enum Repair {
    /// Nothing was to be changed.
    Nothing,
    /// They are not to be believed, for this reason.
    Doubted(String),
    /// They were made.
    Done(Box<Repaired>),
}

/// Recorded data put right.
pub(super) struct Repaired {
    pub(super) recorded: Dataset,
    /// The same, placed anew.
    pub(super) placed: Placed,
    /// Pictures of which nothing is left: the view's name and the camera.
    pub(super) left_out: Vec<(String, usize)>,
}

/// Makes the changes of recorded data that findings ask for, and places charts anew.
///
/// # Errors
///
/// Those of `place`; [`Error::Cancelled`].
pub(super) fn put_right(
    recorded: &Dataset,
    findings: &[Finding],
    place: &dyn Fn(&Dataset) -> Result<Placed>,
) -> Result<Repair> {
    if !findings.iter().any(Finding::is_fixable) {
        return Ok(Repair::Nothing);
    }
    if let Some(why) = checks::blames_most(recorded.views.len(), findings) {
        return Ok(Repair::Doubted(why));
    }
    let left_out = checks::left_out(recorded, findings);
    let changed = checks::repair_all(recorded, findings);
    let placed = place(&changed)?;
    if let Some(why) = doubt(recorded, findings, &placed.0, place)? {
        return Ok(Repair::Doubted(why));
    }
    Ok(Repair::Done(Box::new(Repaired { recorded: changed, placed, left_out })))
}

/// Whether views of which nothing is changed fit worse to what is changed than by themselves.
fn doubt(
    recorded: &Dataset,
    findings: &[Finding],
    after: &Dataset,
    place: &dyn Fn(&Dataset) -> Result<Placed>,
) -> Result<Option<String>> {
    let changes = findings.iter().flat_map(|finding| &finding.changes);
    let touched: BTreeSet<usize> =
        changes.map(|change| recorded.correspondences[change.row()].view).collect();
    let alone = recorded.subset(|_, row| !touched.contains(&row.view));
    let alone = match place(&alone) {
        Ok((alone, _)) => alone,
        // Too few by themselves to tell.
        Err(Error::TooFew { .. } | Error::Degenerate { .. }) => return Ok(None),
        Err(other) => return Err(other),
    };
    let names: BTreeSet<&String> =
        touched.iter().filter_map(|view| recorded.views.get(*view)).collect();
    Ok(checks::fits_worse(after, &alone, &|view| names.contains(view)))
}
