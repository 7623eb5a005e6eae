//! What is said of the pictures of one pair of cameras.

use crate::pair::RectifiedPair;
use wheatstone_stereo::{CornerOffset, PairFault, PairJudgement, VerticalOffset};

/// What was found when the pictures of two cameras were compared.
#[derive(Clone, Debug, PartialEq)]
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
    /// Whether the other camera is left out, because next to nothing was matched or because it has moved.
    pub is_left_out: bool,
    /// What corners say of rows.
    pub(crate) corners: Vec<CornerOffset>,
}

impl PairCheck {
    pub(crate) fn new(pair: &RectifiedPair<'_>, judged: PairJudgement) -> Self {
        let PairJudgement { fault, vertical, corners, .. } = judged;
        let expected = pair.expected_offset();
        let is_doubtful =
            fault.is_none() && vertical.is_some_and(|offset| offset.is_doubtful(expected));
        let cameras = pair.cameras;
        Self { cameras, fault, vertical, is_doubtful, is_left_out: false, corners }
    }

    /// Whether nothing speaks against a camera that has moved: that explains no picture that is given twice.
    pub(crate) fn may_be_moved(&self) -> bool {
        self.fault.is_none() || self.is_off()
    }

    /// Whether rows are off.
    pub(crate) fn is_off(&self) -> bool {
        self.is_doubtful || matches!(self.fault, Some(PairFault::Vertical(_)))
    }
}

/// The fault of all of them, by what tells most: that pictures show nothing in common may be for any reason.
pub(crate) fn fault(checks: &[PairCheck]) -> Option<([usize; 2], PairFault)> {
    let is_empty = |fault: &PairFault| matches!(fault, PairFault::NothingInCommon { .. });
    let counted = || checks.iter().filter(|check| !check.is_left_out);
    let faults = || counted().filter_map(|check| Some((check.cameras, check.fault?)));
    faults().find(|(_, fault)| !is_empty(fault)).or_else(|| faults().next())
}
