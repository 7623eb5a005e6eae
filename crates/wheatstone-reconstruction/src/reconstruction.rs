//! What pictures show, and what speaks against it.

use crate::{
    cloud::Cloud,
    contradiction::{Contradiction, Verdict},
    pair_check::{PairCheck, fault},
    turned::{TurnedCamera, TurnedSideways},
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
    /// The camera that was turned since the calibration, of three and more, where rows or depths do not fit and this alone
    /// explains how: it is left out, unless all others are matched with it.
    pub turned: Option<TurnedCamera>,
    /// Of two cameras whose rows fit, but for a pattern that a turn sideways leaves.
    pub sideways: Option<TurnedSideways>,
}

impl Reconstruction {
    /// Of pictures without a fault, or whose faults nobody looked for.
    pub(crate) fn of(map: DisparityMap, depth: Vec<f32>, cloud: Cloud) -> Self {
        let (left_out, checks) = (Vec::new(), Vec::new());
        Self {
            map,
            depth,
            cloud,
            fault: None,
            left_out,
            checks,
            contradiction: None,
            turned: None,
            sideways: None,
        }
    }

    /// With what was found when the pictures were compared, and what pairs say of each other.
    pub(crate) fn judged(self, verdict: Verdict, mut checks: Vec<PairCheck>) -> Self {
        let Verdict { contradiction, turned, sideways } = verdict;
        for check in &mut checks {
            check.is_left_out |= self.left_out.contains(&check.cameras[1]) && check.may_be_moved();
        }
        Self { fault: fault(&checks), checks, contradiction, turned, sideways, ..self }
    }

    /// What makes the standard deviations doubtful, a sentence each without its full stop; cameras are counted from `first`.
    #[must_use]
    pub fn doubts(&self, first: usize) -> Vec<String> {
        let used = self.checks.iter().filter(|check| !check.is_left_out);
        let offsets = used.filter(|check| check.is_doubtful).filter_map(|check| {
            let [a, b] = check.cameras.map(|camera| camera + first);
            let offset = check.vertical?;
            let mover = self.turned.map(|turned| turned.camera + first);
            let mover = mover.map_or("one of them".into(), |camera| format!("camera {camera}"));
            Some(format!(
                "cameras {a} and {b}: {offset}, more than the calibration lets expect: {mover} has moved a little, or \
                 the scene moved between the two pictures, and points err by more than their standard deviations"
            ))
        });
        let contradiction = self.contradiction.as_ref().filter(|_| self.turned.is_none());
        let contradiction = contradiction.map(|found| contradicting(found, first));
        let turned = self.turned.map(|turned| self.turned(turned, first));
        let sideways = self.sideways.map(|sideways| self.turned_sideways(sideways, first));
        offsets.chain(contradiction).chain(turned).chain(sideways).collect()
    }

    /// What is said of a pair one camera of which seems to be turned sideways.
    fn turned_sideways(&self, found: TurnedSideways, first: usize) -> String {
        let TurnedSideways { degrees, sigma, disparity } = found;
        let cameras = self.checks.iter().find(|check| !check.is_left_out).map(|own| own.cameras);
        let [a, b] = cameras.unwrap_or_default().map(|camera| camera + first);
        format!(
            "cameras {a} and {b}: rows drift apart towards the corners of the pictures, as where one camera was turned \
             sideways by {degrees:.2} degrees (standard deviation {sigma:.2}): disparities are then wrong by about \
             {disparity:.1} px everywhere, and points err by more than their standard deviations"
        )
    }

    /// What is said of a camera that was turned.
    fn turned(&self, TurnedCamera { camera, degrees }: TurnedCamera, first: usize) -> String {
        let why = format!(
            "has moved: turned by {degrees:.2} degrees it explains in which rows and at which depths pairs of cameras show \
             things, and no other camera does"
        );
        let camera_number = camera + first;
        if self.left_out.contains(&camera) {
            return format!("camera {camera_number} is left out: it {why}");
        }
        format!(
            "camera {camera_number}, with which all others are matched, {why}; points err by more than their standard \
             deviations: take the other cameras"
        )
    }
}

/// What is said of cameras that contradict each other.
fn contradicting(found: &Contradiction, first: usize) -> String {
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
}
