//! Charts whose places are known only so well: one that stood elsewhere within that is no fault, and its points are no
//! outliers.

use super::{
    checks::{Examination, Severity},
    outliers::{self, Screening},
};
use crate::{
    Error, Result,
    dataset::Dataset,
    fit::stage::{self, StagePrior},
};
use wheatstone_numeric::progress::Progress;

/// Standard deviations that a chart may stand beside its place.
const MOST: f64 = 4.0;

/// The outliers of data whose charts stand as well as that. Where a camera accuses many points of a view, it is the
/// chart that may stand elsewhere: charts are moved to where they stood, and all is screened again.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub(super) fn screen(
    data: &Dataset,
    prior: &StagePrior,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Screening> {
    let first = outliers::screen(data, seed, progress)?;
    let spared = first.without_whole_views(data);
    if spared == first {
        return Ok(first);
    }
    match moved(&spared.masked(data), prior, progress)? {
        Some(moved) => Ok(spared.joined(outliers::screen(&moved, seed, progress)?)),
        None => Ok(first),
    }
}

/// What an examination found that holds although charts may stand elsewhere: nothing fatal, where there is nothing fatal
/// with the charts moved to where they stood.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub(super) fn examine(
    data: &Dataset,
    prior: &StagePrior,
    found: Examination,
    examine: &dyn Fn(&Dataset) -> Examination,
    progress: &dyn Progress,
) -> Result<Examination> {
    if found.worst() < Some(Severity::Fatal) {
        return Ok(found);
    }
    let spared = outliers::screen(data, 0, progress)?.without_whole_views(data);
    let moved = moved(&spared.masked(data), prior, progress)?;
    let again = moved.map(|moved| examine(&moved));
    Ok(again.filter(|again| again.worst() < Some(Severity::Fatal)).unwrap_or(found))
}

/// The data with the charts where the pixels say that they stood; `None` where that cannot be told, or is farther from
/// their places than chance.
fn moved(data: &Dataset, prior: &StagePrior, progress: &dyn Progress) -> Result<Option<Dataset>> {
    let solved = match stage::solve(data, prior, progress) {
        Ok(solved) => solved,
        Err(Error::Cancelled) => return Err(Error::Cancelled),
        Err(_) => return Ok(None),
    };
    let is_near = solved.offsets.iter().all(|found| {
        let own = prior.views.iter().find(|(name, _)| *name == found.view);
        let sigma = own.map_or(prior.offset_sigma, |(_, sigma)| *sigma);
        found.offset.iter().all(|offset| offset.abs() <= MOST * sigma)
    });
    Ok(is_near.then_some(solved.data))
}
