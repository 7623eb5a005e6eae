//! Several frames of a scene that stands still, before cameras that do.

use crate::{
    pair::refused,
    pair_check::{PairCheck, fault},
    reconstruction::Reconstruction,
    scene::{SceneReconstructor, Searched},
};
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{Error, Result};
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::{DisparityFusion, DisparityMap, PairFault};

/// Frames of one scene, put together pair by pair: noise is averaged, what a frame contradicts is outvoted. Memory does not
/// grow with their number.
pub struct FrameFusion<'s, 'm> {
    made: &'s SceneReconstructor<'m>,
    /// Of each pair, once a frame has shown something.
    pairs: Vec<Option<DisparityFusion>>,
    /// Those of a frame that says more than others: that something is doubtful.
    checks: Vec<PairCheck>,
    /// The reference camera's first picture.
    reference: Option<ColourImage>,
}

impl<'s, 'm> FrameFusion<'s, 'm> {
    /// Of no frames yet. Every pixel is matched, whatever the settings say of corners and edges.
    #[must_use]
    pub fn new(made: &'s SceneReconstructor<'m>) -> Self {
        Self { made, pairs: Vec::new(), checks: Vec::new(), reference: None }
    }

    /// Adds pictures that were taken at once, in the order of the settings' cameras. Those at fault are left out, and the
    /// fault is given back.
    ///
    /// # Errors
    ///
    /// Those of [`SceneReconstructor::reconstruct`].
    pub fn add(
        &mut self,
        pictures: &[&ColourImage],
        progress: &dyn Progress,
    ) -> Result<Option<([usize; 2], PairFault)>> {
        let found = self.made.maps(pictures, progress)?;
        let at_fault = fault(&found.checks);
        if at_fault.is_some() && !self.is_explained(&found) {
            return Ok(at_fault);
        }
        let doubts = |checks: &[PairCheck]| checks.iter().filter(|own| own.is_doubtful).count();
        if self.checks.is_empty() || doubts(&found.checks) > doubts(&self.checks) {
            self.checks = found.checks;
        }
        self.pairs.resize(found.of_pairs.len(), None);
        for (pair, map) in self.pairs.iter_mut().zip(&found.of_pairs) {
            if let Some(map) = map {
                let fusion =
                    pair.get_or_insert_with(|| DisparityFusion::new(map.width, map.height));
                fusion.add(map).map_err(refused)?;
            }
        }
        self.reference.get_or_insert_with(|| self.made.reference(pictures).clone());
        Ok(None)
    }

    /// Whether a camera has moved that can be left out, and nothing else is at fault.
    fn is_explained(&self, found: &Searched<DisparityMap>) -> bool {
        let of_pairs: Vec<_> = found.of_pairs.iter().map(Option::as_ref).collect();
        let Some(left_out) = self.made.verdict(&of_pairs, &found.checks).left_out(&self.made.pairs)
        else {
            return false;
        };
        let mut checks = found.checks.clone();
        checks[left_out].is_left_out |= checks[left_out].may_be_moved();
        fault(&checks).is_none()
    }

    /// What all frames show.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] where no frame was added, [`Error::Cancelled`].
    pub fn finish(self, progress: &dyn Progress) -> Result<Reconstruction> {
        let Some(reference) = &self.reference else {
            return Err(Error::Degenerate {
                problem: "no frame could be matched".into(),
                hint: "give pictures that were taken at once, of cameras that have not moved"
                    .into(),
            });
        };
        let maps = self.pairs.iter().map(|pair| Some(pair.as_ref()?.map())).collect();
        self.made.of_maps((maps, self.checks), reference, progress)
    }
}
