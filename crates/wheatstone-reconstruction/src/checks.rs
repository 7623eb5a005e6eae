//! What is wrong with pictures whose matches somebody else found, and what left no point of any.

use crate::{
    contradiction::Verdict, reconstruction::Reconstruction, scene::SceneReconstructor,
    turned::sideways,
};
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::Result;
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::PairFault;

/// Which limit took the last points away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Emptied {
    /// None: no pixel was matched within the depths. Of corners and edges, and of given pixels, in the region.
    NothingMatched,
    /// Pixels were matched beside the region only.
    Region,
    /// The least confidence.
    Confidence,
    /// The largest standard deviation.
    StandardDeviation,
    /// None: no match has a point in front of the cameras.
    NoPlace,
}

impl SceneReconstructor<'_> {
    /// What matches show that somebody else found, with what speaks against their pictures: as
    /// [`SceneReconstructor::reconstruct`] tells it, but that another matcher may find what ours does not.
    ///
    /// # Errors
    ///
    /// Those of [`SceneReconstructor::reconstruct`].
    pub fn checked(
        &self,
        found: Reconstruction,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Reconstruction> {
        let mut checks = self.maps(pictures, progress)?.checks;
        for check in &mut checks {
            check.is_left_out = false;
            check.fault =
                check.fault.filter(|fault| !matches!(fault, PairFault::NothingInCommon { .. }));
        }
        let contradiction = found.contradiction.clone();
        let sideways = sideways(&self.pairs, &checks);
        let verdict = Verdict { contradiction, turned: None, sideways };
        Ok(found.judged(verdict, checks))
    }

    /// Two of some cameras that do not fit whose pictures do when they are exchanged, where there are such two.
    ///
    /// # Errors
    ///
    /// Those of [`SceneReconstructor::reconstruct`].
    pub fn exchanged(
        &self,
        unfit: &[usize],
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Option<[usize; 2]>> {
        let reference = self.reference(pictures);
        let size = |camera: usize| self.settings.sizes[self.order(camera)];
        let fits = |camera: usize, other: usize| -> Result<bool> {
            progress.check()?;
            let pair = self.pairs.iter().find(|pair| pair.cameras[1] == camera);
            let Some(pair) = pair.filter(|_| size(camera) == size(other)) else { return Ok(false) };
            let both = [reference, pictures[self.order(other)]];
            Ok(pair.disparities(&self.matcher, both)?.1.fault.is_none())
        };
        for (index, first) in unfit.iter().enumerate() {
            for second in &unfit[index + 1..] {
                if fits(*first, *second)? && fits(*second, *first)? {
                    return Ok(Some([*first, *second]));
                }
            }
        }
        Ok(None)
    }

    /// Whether a disparity of the first two cameras belongs to a depth that is searched. Others are left out of the
    /// matches that [`SceneReconstructor::locate`] is given.
    #[must_use]
    pub fn searches(&self, disparity: f32) -> bool {
        self.pairs[0].searches(f64::from(disparity))
    }

    /// What took all points away; `None` where there are some.
    #[must_use]
    pub fn emptied_by(&self, found: &Reconstruction) -> Option<Emptied> {
        if !found.cloud.is_empty() {
            return None;
        }
        let (pair, map) = (&self.pairs[0], &found.map);
        let is_wanted = |at: usize| {
            let place = ((at % map.width) as f64, (at / map.width) as f64);
            pair.reference(place).is_some_and(|pixel| self.settings.holds(pixel))
        };
        // Features of a single pair count whatever their confidence is.
        let counts_all = self.settings.sparse && self.pairs.len() == 1;
        let is_sure =
            |at: usize| counts_all || map.confidence[at] >= self.settings.least_confidence;
        let is_matched = |at: &usize| map.disparity[*at].is_finite() && map.confidence[*at] > 0.0;
        let matched = || (0..map.disparity.len()).filter(is_matched);
        let wanted = || matched().filter(|at| is_wanted(*at));
        Some(if matched().next().is_none() {
            Emptied::NothingMatched
        } else if wanted().next().is_none() {
            Emptied::Region
        } else if !wanted().any(is_sure) {
            Emptied::Confidence
        } else if self.settings.most_sigma.is_some() {
            Emptied::StandardDeviation
        } else if self.pairs.len() > 1 {
            // The cameras contradict each other.
            Emptied::Confidence
        } else {
            Emptied::NoPlace
        })
    }
}
