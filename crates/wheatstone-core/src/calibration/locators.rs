//! What a model locates points with.

use super::Calibration;
use crate::{
    geometry::{Pixel, PixelColumns, columns_of},
    method::{CalibratedMap, Located, Locator, Reconstructor, SettledLocator},
};

impl Calibration {
    /// The point that the cameras saw at `pixels` (one entry a camera), with all that is uncertain of it:
    /// [`Reconstructor::locate`] by [`Calibration::map`].
    #[must_use]
    pub fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        self.map().locate(pixels)
    }

    /// The same for many points, with the trust that the volume gives each.
    #[must_use]
    pub fn locator(&self) -> Locator<'_> {
        Locator::new(&*self.reconstructor, Some(&self.volume)).with_uncertainty(
            self.point_noise,
            self.covariance_scale,
            self.stage_covariance.as_ref(),
        )
    }

    /// The fitted map with all that is uncertain of a point in its covariances.
    #[must_use]
    pub fn map(&self) -> CalibratedMap<'_> {
        CalibratedMap::new(&*self.reconstructor).with_uncertainty(
            self.point_noise,
            self.covariance_scale,
            self.stage_covariance.as_ref(),
        )
    }

    /// A locator made ready once, by the points that the model was fitted to (or, of cameras that another program
    /// calibrated, by the sizes of their pictures, where known): what it says of a point depends on nothing that it was
    /// asked before. Without covariances it tells points alone, and no trust.
    #[must_use]
    pub fn settled_locator(&self, with_covariance: bool) -> SettledLocator<'_> {
        let cameras = self.reconstructor.cameras();
        let own =
            || self.data.pixels.iter().map(|row| row.iter().map(|p| p.map(Pixel::from)).collect());
        let rows: Vec<Vec<Option<Pixel>>> =
            if self.imported.is_some() { self.corners() } else { own().collect() };
        let columns = columns_of(&rows, cameras);
        let shown = columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect();
        let locator = if with_covariance {
            self.locator()
        } else {
            // Who asks for points alone does not ask for their trust.
            Locator::new(&*self.reconstructor, None).points_only()
        };
        locator.settled(&PixelColumns::new(shown))
    }

    /// The first and the last pixel of each camera's picture, where its size is known: each a row, for they do not show
    /// one point.
    fn corners(&self) -> Vec<Vec<Option<Pixel>>> {
        let cameras = self.reconstructor.cameras();
        let alone = |camera: usize, pixel: Pixel| {
            (0..cameras).map(|other| (other == camera).then_some(pixel)).collect()
        };
        let of = |camera: usize| {
            let size = self.picture_size(camera);
            let last = size.map(|size| size.map(|pixels| f64::from(pixels.saturating_sub(1))));
            let ends = last.map(|[x, y]| [Pixel::origin(), Pixel::new(x, y)]);
            ends.into_iter().flatten().map(move |pixel| alone(camera, pixel))
        };
        (0..cameras).flat_map(of).collect()
    }
}
