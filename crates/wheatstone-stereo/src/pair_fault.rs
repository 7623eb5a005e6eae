//! What makes a pair worthless.

use crate::{
    error::MatchError,
    picture::Picture,
    vertical::{CornerOffset, VerticalOffset, corner_offsets, large_corner_offsets},
};
use std::{fmt, ops::Range};

/// Rows between the pictures of a pair from which on the search suffers, in the median.
const MOST_VERTICAL: f32 = 0.5;
/// And at the sides: a camera that was turned sideways by 0.7 degrees changes depths by a tenth, and rows by so much. Sound
/// calibrations of real cameras, whose charts did not fill the pictures, leave up to 0.8.
const MOST_AT_SIDES: f32 = 1.0;
/// The share of confident pixels below which a pair shows next to nothing.
const LEAST_DENSITY: f64 = 0.1;
/// The share below which pictures may be exchanged ones: cameras that are turned to each other see a wrong scene in
/// those, less clearly than the right one.
const DOUBTFUL: f64 = 0.4;
/// How many times more of exchanged pictures must be matched when they are exchanged back.
const CLEARLY: f64 = 2.0;

/// What makes a pair worthless; it is displayed as a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PairFault {
    /// The right picture shows things in other rows.
    Vertical(VerticalOffset),
    /// The right picture is the first one.
    Exchanged,
    /// Both pictures are the same one, pixel by pixel.
    SamePicture,
    /// Next to nothing was matched.
    NothingInCommon {
        /// The share of the pixels, or of the corners, that were matched with confidence, 0 to 1.
        matched: f64,
    },
}

/// What was found when the two pictures of a pair were compared.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PairJudgement {
    /// What makes the pair worthless, if something does.
    pub fault: Option<PairFault>,
    /// By how many rows the pictures are beside each other, where corners tell it.
    pub vertical: Option<VerticalOffset>,
    /// The corners that tell it.
    pub corners: Vec<CornerOffset>,
    /// Whether next to nothing was matched, whatever the reason.
    pub is_empty: bool,
}

impl fmt::Display for PairFault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Vertical(offset) => write!(
                out,
                "{offset}: the pair is not rectified, a camera has moved, or the scene moved between the two pictures"
            ),
            Self::Exchanged => {
                write!(out, "the pictures are exchanged: the right one is the first")
            }
            Self::SamePicture => write!(out, "both pictures are the same, pixel by pixel"),
            Self::NothingInCommon { matched } => write!(
                out,
                "{:.0} % of the pixels are matched with confidence: the pictures show nothing in common within the range, \
                 have no texture, or one that repeats",
                100.0 * matched
            ),
        }
    }
}

/// Judges a pair of which the share `matched` was matched with confidence, 0 to 1. Of a
/// pair that is matched along curves, `bend` is how far they lead from their rows, in pixels: so much is no fault.
/// `exchanged` gives the share where the two pictures are matched the other way round: where they are rectified already
/// the right one with the left one, where they are rectified here each as the other camera's.
///
/// # Errors
///
/// As [`crate::Matcher::compute`], and those of `exchanged`.
pub fn judge_pair(
    [left, right]: [&Picture<'_>; 2],
    range: Range<i32>,
    (matched, bend): (f64, f32),
    exchanged: impl FnOnce() -> Result<f64, MatchError>,
) -> Result<PairJudgement, MatchError> {
    let at_fault = |fault| PairJudgement { fault: Some(fault), ..PairJudgement::default() };
    if left.pixels() == right.pixels() {
        return Ok(at_fault(PairFault::SamePicture));
    }
    if matched < DOUBTFUL {
        let other = exchanged()?;
        if other > LEAST_DENSITY.max(CLEARLY * matched) {
            return Ok(at_fault(PairFault::Exchanged));
        }
    }
    let is_empty = matched < LEAST_DENSITY;
    let near = corner_offsets([left, right], range.clone())?;
    let far = || large_corner_offsets([left, right], range).filter(|_| is_empty);
    let found = near.or_else(far);
    let (vertical, corners) = found.map(|own| (own.offset, own.agreeing)).unzip();
    let is_off = |vertical: &VerticalOffset| {
        vertical.median_size > MOST_VERTICAL + bend || vertical.largest > MOST_AT_SIDES + bend
    };
    let off = vertical.filter(is_off).map(PairFault::Vertical);
    let empty = is_empty.then_some(PairFault::NothingInCommon { matched });
    let corners = corners.unwrap_or_default();
    Ok(PairJudgement { fault: off.or(empty), vertical, corners, is_empty })
}
