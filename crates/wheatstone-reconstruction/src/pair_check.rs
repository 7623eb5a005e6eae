//! What is said of the pictures of one pair of cameras.

use crate::pair::RectifiedPair;
use wheatstone_stereo::{PairFault, PairJudgement, VerticalOffset};

/// What was found when the pictures of two cameras were compared.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PairCheck {
    /// The reference camera, and the other one.
    pub cameras: [usize; 2],
    /// What makes the pair worthless, if something does.
    pub fault: Option<PairFault>,
    /// By how many rows the rectified pictures are beside each other, where corners tell it.
    pub vertical: Option<VerticalOffset>,
    /// Whether that is more than the calibration lets expect, of a pair without a fault.
    pub is_doubtful: bool,
    /// Whether the other camera is left out, because next to nothing was matched.
    pub is_left_out: bool,
}

impl PairCheck {
    pub(crate) fn new(pair: &RectifiedPair<'_>, judged: PairJudgement) -> Self {
        let PairJudgement { fault, vertical, .. } = judged;
        let expected = pair.expected_offset();
        let is_doubtful =
            fault.is_none() && vertical.is_some_and(|offset| offset.is_doubtful(expected));
        Self { cameras: pair.cameras, fault, vertical, is_doubtful, is_left_out: false }
    }
}

/// The fault of all of them, by what tells most: that pictures show nothing in common may be for any reason.
pub(crate) fn fault(checks: &[PairCheck]) -> Option<([usize; 2], PairFault)> {
    let is_empty = |fault: &PairFault| matches!(fault, PairFault::NothingInCommon { .. });
    let counted = || checks.iter().filter(|check| !check.is_left_out);
    let faults = || counted().filter_map(|check| Some((check.cameras, check.fault?)));
    faults().find(|(_, fault)| !is_empty(fault)).or_else(|| faults().next())
}

/// The camera that has moved, where one alone explains which pairs are off: the other one of a single pair that is, or
/// the reference where all are.
pub(crate) fn moved(checks: &[PairCheck]) -> Option<usize> {
    let is_off = |check: &&PairCheck| {
        check.is_doubtful || matches!(check.fault, Some(PairFault::Vertical(_)))
    };
    let off: Vec<&PairCheck> = checks.iter().filter(is_off).collect();
    let sound = checks.iter().filter(|check| check.fault.is_none() && !check.is_doubtful).count();
    match &off[..] {
        [only] if sound > 0 => Some(only.cameras[1]),
        [first, _, ..] if off.len() == checks.len() => Some(first.cameras[0]),
        _ => None,
    }
}
