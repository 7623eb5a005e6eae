//! What makes a pair worthless.

use crate::{
    error::MatchError,
    map::DisparityMap,
    matcher::Matcher,
    picture::Picture,
    vertical::{VerticalOffset, vertical_offset},
};
use std::fmt;

/// A disparity of this confidence is hardly ever wrong.
const CONFIDENT: f32 = 0.9;
/// Rows between the pictures of a pair from which on the search suffers.
const MOST_VERTICAL: f32 = 0.5;
/// The share of confident pixels below which a pair is to be doubted.
const LEAST_DENSITY: f64 = 0.1;

/// What makes a pair worthless; it is displayed as a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PairFault {
    /// The right picture shows things in other rows.
    Vertical(VerticalOffset),
    /// The right picture is the first one.
    Exchanged,
    /// Next to nothing was matched.
    NothingInCommon {
        /// The share of the pixels that were matched with confidence, 0 to 1.
        matched: f64,
    },
}

impl fmt::Display for PairFault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertical(VerticalOffset { median, corners }) => write!(
                out,
                "the right picture shows things {:.1} rows {} (median of {corners} corners): the pair is not rectified, \
                 or a camera has moved",
                median.abs(),
                if *median > 0.0 { "lower" } else { "higher" }
            ),
            Self::Exchanged => {
                write!(out, "the pictures are exchanged: the right one is the first")
            }
            Self::NothingInCommon { matched } => write!(
                out,
                "{:.0} % of the pixels are matched with confidence: the pictures show nothing in common within the range, \
                 have no texture, or one that repeats",
                100.0 * matched
            ),
        }
    }
}

/// What makes a pair worthless that was matched, if something does. Of a pair that is matched along curves, `bend` is how
/// far they lead from their rows, in pixels: so much is no fault.
///
/// # Errors
///
/// As [`Matcher::compute`].
pub fn pair_fault(
    matcher: &Matcher,
    [left, right]: [&Picture<'_>; 2],
    map: &DisparityMap,
    bend: f32,
) -> Result<Option<PairFault>, MatchError> {
    let vertical = vertical_offset(left, right, matcher.range.clone())?;
    let is_off = |vertical: &VerticalOffset| vertical.median.abs() > MOST_VERTICAL + bend;
    if let Some(vertical) = vertical.filter(is_off) {
        return Ok(Some(PairFault::Vertical(vertical)));
    }
    let matched = map.density(CONFIDENT);
    if matched >= LEAST_DENSITY {
        return Ok(None);
    }
    // Exchanged pictures are the most frequent reason, and can be tried.
    let exchanged = matcher.clone().refining(false).compute(right, left)?.density(CONFIDENT);
    let is_exchanged = exchanged >= LEAST_DENSITY && exchanged > 3.0 * matched;
    let nothing = PairFault::NothingInCommon { matched };
    Ok(Some(if is_exchanged { PairFault::Exchanged } else { nothing }))
}
