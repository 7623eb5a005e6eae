//! What pictures show, and what speaks against it.

use crate::{
    cloud::Cloud,
    contradiction::Contradiction,
    pair_check::{PairCheck, fault, moved},
};
use wheatstone_stereo::{DisparityMap, PairFault};

/// What pictures show.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reconstruction {
    /// Disparities of the left rectified picture, of the first two cameras.
    pub map: DisparityMap,
    /// Depths of the same pixels along the axis of the left virtual camera, in the model's unit; NaN for pixels
    /// without a point in the cloud.
    pub depth: Vec<f32>,
    /// The points.
    pub cloud: Cloud,
    /// What makes all of it worthless, if something does, and between which two cameras.
    pub fault: Option<([usize; 2], PairFault)>,
    /// Cameras whose pictures have next to nothing in common with the reference, or that contradict all others: they say
    /// nothing of the cloud.
    pub left_out: Vec<usize>,
    /// What was found when the pictures were compared, one a pair of cameras.
    pub checks: Vec<PairCheck>,
    /// Cameras whose depths contradict each other.
    pub contradiction: Option<Contradiction>,
}

impl Reconstruction {
    /// Of pictures without a fault, or whose faults nobody looked for.
    pub(crate) fn of(map: DisparityMap, depth: Vec<f32>, cloud: Cloud) -> Self {
        let (left_out, checks) = (Vec::new(), Vec::new());
        Self { map, depth, cloud, fault: None, left_out, checks, contradiction: None }
    }

    /// With what was found when the pictures were compared.
    pub(crate) fn checked(self, checks: Vec<PairCheck>) -> Self {
        Self { fault: fault(&checks), checks, ..self }
    }

    /// The one camera that has moved, where that explains which pairs of cameras do not fit.
    #[must_use]
    pub fn moved(&self) -> Option<usize> {
        moved(&self.checks)
    }

    /// What makes the standard deviations doubtful, a sentence each without its full stop; cameras are counted from `first`.
    #[must_use]
    pub fn doubts(&self, first: usize) -> Vec<String> {
        let offsets = self.checks.iter().filter(|check| check.is_doubtful).filter_map(|check| {
            let [a, b] = check.cameras.map(|camera| camera + first);
            let (offset, mover) = (check.vertical?, self.moved().map(|camera| camera + first));
            let mover = mover.map_or("one of them".into(), |camera| format!("camera {camera}"));
            Some(format!(
                "cameras {a} and {b}: {offset}, more than the calibration lets expect: {mover} has moved a little, or \
                 things have between the two pictures, and points err by more than their standard deviations"
            ))
        });
        let contradiction = self.contradiction.as_ref().map(|found| {
            let named: Vec<_> = found.cameras.iter().map(|own| (own + first).to_string()).collect();
            let sigmas = found.sigmas;
            match found.left_out {
                Some(own) => format!(
                    "camera {} is left out: its depths contradict those of all others by {sigmas:.0} standard deviations in \
                     the median, and those agree: it has moved",
                    own + first
                ),
                None => format!(
                    "the depths by cameras {} contradict each other by {sigmas:.0} standard deviations in the median: one of \
                     them has moved, or the camera that they are matched with",
                    named.join(" and ")
                ),
            }
        });
        offsets.chain(contradiction).collect()
    }
}
