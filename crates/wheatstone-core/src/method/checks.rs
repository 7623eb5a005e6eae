//! What every method needs of the points that it is fitted to.

use crate::{Error, Result, dataset::Dataset};

/// Points that lie flatter than this share of their extent are one plane to any method: a tenth of a
/// millimetre over a metre is what a good chart is flat to.
const FLATTEST: f64 = 1e-4;

/// Refuses data from which no method can learn depth.
///
/// # Errors
///
/// [`Error::Degenerate`] or [`Error::TooFew`], with what to add.
pub fn depth_is_observable(train: &Dataset) -> Result<()> {
    let known = train.known().count();
    if known == 0 {
        let problem = "no point has a known place in the world".into();
        let hint = if train.correspondences.iter().any(|c| c.board.is_some()) {
            "say where the chart stood: `translation` in each [[views]] of the capture, or columns `X,Y,Z`"
        } else {
            "give columns `X,Y,Z` with the places of the points"
        };
        return Err(Error::Degenerate { problem, hint: hint.into() });
    }
    let matched = train.known().filter(|(_, c)| c.seen_by() >= 2).count();
    if train.cameras >= 2 && matched < 4 {
        return Err(Error::TooFew {
            method: "any method".into(),
            what: "points with a known place that two cameras saw".into(),
            need: 4,
            got: matched,
        });
    }
    if train.flatness() < FLATTEST {
        return Err(Error::Degenerate {
            problem: format!(
                "all {known} points with a known place lie on one plane, so depth cannot be learned"
            ),
            hint: "show the chart at two or more distances, better four to seven".into(),
        });
    }
    Ok(())
}
