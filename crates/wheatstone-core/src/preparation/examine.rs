//! Faults of data without a fit: found, and put right.

use super::{
    after_placing::{Repair, add_findings, put_right, rows_placed},
    chart_poses, chart_shape,
    checks::{self, Examination, Severity, Statement},
    worst_apart::examine_placed,
};
use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    fit::bundle::{self, BundleSettings},
};
use wheatstone_numeric::progress::Progress;

/// Views whose charts are placed to look for faults, at most: time grows with more than their number.
const MOST_PLACED: usize = 40;

/// Looks for faults as [`checks::examine`] does; charts held by hand are placed for that, as before a fit, so that
/// faults of their poses show too, and where the cameras stand. Of many views of such charts it takes forty, spread
/// evenly, and says so.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub fn examine(
    data: &Dataset,
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Examination> {
    examine_views(data, MOST_PLACED, bundle_settings, progress)
}

/// The same with all views of charts held by hand, however long that takes.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub fn examine_every_view(
    data: &Dataset,
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Examination> {
    examine_views(data, usize::MAX, bundle_settings, progress)
}

fn examine_views(
    data: &Dataset,
    most: usize,
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Examination> {
    let mut examination = checks::examine(data);
    if !bundle::needed(data) {
        return Ok(examination);
    }
    let (sample, sampled_from) = sample(data, most);
    let place = |data: &Dataset| chart_poses::place(data, &[], bundle_settings, progress);
    match place(&sample) {
        Ok(placed) => {
            let of_sample = rows_placed(&sample, &placed.1);
            let from = (&sample, &*of_sample);
            let after = examine_placed(from, &placed, &checks::examine, &place)?;
            let rows: Vec<usize> = of_sample.iter().map(|row| sampled_from[*row]).collect();
            if after.worst() < Some(Severity::Fatal) {
                let shape = chart_shape::examine(&sample, &placed, bundle_settings, progress)?;
                examination.findings.extend(shape);
            }
            add_findings(&mut examination, after, &placed, (data, &rows));
            let (taken, views) = (sample.views.len(), data.views.len());
            if taken < views {
                let what =
                    format!("faults of the chart's pose in {} of {views} views", views - taken);
                let check = format!("charts were placed in {taken} views, spread evenly");
                examination.cannot_be_seen.push(Statement { what, check });
            }
        }
        Err(Error::Cancelled) => return Err(Error::Cancelled),
        Err(error) => examination.findings.insert(0, checks::undetermined_poses(&error)),
    }
    Ok(examination)
}

/// Data with the faults put right that an examination of every view found, where that can be believed.
///
/// # Errors
///
/// [`Error::Degenerate`] where it cannot, [`Error::Cancelled`]; where charts held by hand cannot be placed after it,
/// those of [`bundle::solve`].
pub fn repair(
    data: &Dataset,
    examination: &Examination,
    bundle_settings: BundleSettings,
    progress: &dyn Progress,
) -> Result<Dataset> {
    if !bundle::needed(data) {
        return checks::repair(data, &examination.findings);
    }
    let place = |data: &Dataset| chart_poses::place(data, &[], bundle_settings, progress);
    match put_right(data, &examination.findings, &place)? {
        Repair::Nothing => Ok(data.clone()),
        Repair::Doubted(why) => Err(checks::not_corrected(&why)),
        Repair::Done(repaired) => Ok(repaired.recorded),
    }
}

/// Data of at most so many views, spread evenly, and the row of the data from which each row comes.
fn sample(data: &Dataset, most: usize) -> (Dataset, Vec<usize>) {
    let step = data.views.len().div_ceil(most).max(1);
    let is_taken = |row: &Correspondence| row.view.is_multiple_of(step);
    let mut sample = data.subset(|_, row| is_taken(row));
    sample.views = data.views.iter().step_by(step).cloned().collect();
    sample.correspondences.iter_mut().for_each(|row| row.view /= step);
    let all = data.correspondences.iter().enumerate();
    (sample, all.filter(|(_, row)| is_taken(row)).map(|(index, _)| index).collect())
}
