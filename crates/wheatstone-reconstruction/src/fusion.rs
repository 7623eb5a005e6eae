//! Several frames of a scene that stands still, before cameras that do.

use crate::scene::{Reconstruction, SceneReconstructor};
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{Error, Result};
use wheatstone_numeric::progress::Progress;
use wheatstone_stereo::{DisparityFusion, PairFault};

/// Frames of one scene, put together pair by pair: noise is averaged, what a frame contradicts is outvoted. Memory does not
/// grow with their number.
pub struct FrameFusion<'s, 'm> {
    made: &'s SceneReconstructor<'m>,
    pairs: Vec<DisparityFusion>,
    /// The reference camera's first picture.
    reference: Option<ColourImage>,
}

impl<'s, 'm> FrameFusion<'s, 'm> {
    /// Of no frames yet.
    #[must_use]
    pub fn new(made: &'s SceneReconstructor<'m>) -> Self {
        let fusion = |[width, height]: [usize; 2]| DisparityFusion::new(width, height);
        Self { made, pairs: made.map_sizes().map(fusion).collect(), reference: None }
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
        if found.fault.is_some() {
            return Ok(found.fault);
        }
        for (pair, map) in self.pairs.iter_mut().zip(&found.of_pairs) {
            if let Some(map) = map {
                let _has_its_size = pair.add(map);
            }
        }
        self.reference.get_or_insert_with(|| self.made.reference(pictures).clone());
        Ok(None)
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
        let maps = self.pairs.iter().map(|pair| Some(pair.map())).collect();
        self.made.of_maps(maps, reference, progress)
    }
}
