//! Whether a model's cameras still stand as they did.

use super::Calibration;
use crate::{
    Error, Result,
    dataset::Dataset,
    error::{Hint, Remedy},
    evaluate::{CameraMotion, Ellipsoids, Reference, camera_motion, refuse_mistaken_unit},
    geometry::Vector3,
    method::Reconstructor,
};
use wheatstone_numeric::progress::Progress;

impl Calibration {
    /// Looks for motions of the cameras since the model was fitted, by what they see in `data`: points at places in the
    /// model's frame, boards whose poses are not known, or matched points of anything.
    ///
    /// Models that are no cameras (`network`, `interpolation`), or do not tell what is uncertain of their cameras (`dlt`,
    /// `soloff`), are stood in for by neural cameras fitted to the model's own points.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] for another number of cameras, or a unit that does not convert; [`Error::Faulty`] for
    /// places in another unit than was said; those of
    /// [`evaluate::camera_motion`](crate::evaluate::camera_motion()); those of the fit of a neural camera.
    pub fn camera_motion(&self, data: &Dataset, progress: &dyn Progress) -> Result<CameraMotion> {
        let cameras = self.reconstructor.cameras();
        if data.cameras != cameras {
            return Err(Error::Mismatch {
                what: "number of cameras",
                model: cameras.to_string(),
                data: data.cameras.to_string(),
            });
        }
        let given = &data.unit;
        let data = data.clone().in_unit(&self.unit)?;
        let map: &dyn Reconstructor = &*self.reconstructor;
        refuse_mistaken_unit(map, &data, given)?;
        if map.fit_errors().is_some() {
            // Whoever errs more than it says on views held out does so on others.
            let told = Ellipsoids::NORMAL.radius2_95;
            let widened = (self.ellipsoids.radius2_95 / told).max(1.0);
            return camera_motion((map, &self.axes()), &data, widened, progress);
        }
        let reference = if self.data.world.is_empty() {
            None
        } else {
            Reference::fit(&self.data.restored(), progress)?
        };
        let reference = reference.ok_or_else(|| Error::Degenerate {
            problem: "this model is no camera, and holds no points to fit cameras to".into(),
            hint: Hint::new("fit it to the points of a chart", Remedy::Fit),
        })?;
        camera_motion((reference.cameras(), &[]), &data, 1.0, progress)
    }

    /// The optical axes of its cameras in the world; none for a map without cameras.
    fn axes(&self) -> Vec<Vector3> {
        let cameras = self.reconstructor.intrinsics().unwrap_or_default();
        cameras.into_iter().map(|camera| camera.axis.into()).collect()
    }
}
