//! Error bars of many points for pixels whose noise is given.

use super::{
    super::given_noise::{self, PIXEL_STEP, PixelShare, PixelSigmas},
    LocatedBatch, Locator,
    located_batch::Slots,
};
use crate::geometry::{PixelColumns, Point3};

/// Where points are whose pixels are moved by a step, by camera and axis.
type Moved = Vec<[LocatedBatch; 2]>;

impl Locator<'_> {
    /// Makes error bars and expected residuals those of pixels with these standard deviations; `holds` where the map
    /// is not one whose covariances are scaled.
    pub(super) fn give_noise(
        &self,
        pixels: &PixelColumns,
        slots: &mut Slots,
        (sigmas, holds): (&PixelSigmas, bool),
    ) {
        let cameras = 0..pixels.cameras().len();
        let moved: Moved =
            cameras.map(|camera| [0, 1].map(|axis| self.moved(pixels, (camera, axis)))).collect();
        for index in 0..pixels.points() {
            let Some(located) = slots.get(index) else { continue };
            let (row, map): (Vec<_>, _) = (pixels.point(index).collect(), self.map.reconstructor);
            let seen =
                row.iter().enumerate().filter_map(|(camera, pixel)| Some((camera, (*pixel)?)));
            let shares = seen.flat_map(|(camera, pixel)| {
                let variance = given_noise::variance(map, (camera, pixel), located.point);
                moved[camera].each_ref().map(|to| {
                    let to = Point3::from(to.point.each_ref().map(|column| column[index]));
                    PixelShare { slope: (to - located.point) / PIXEL_STEP, variance }
                })
            });
            let shares: Vec<PixelShare> = shares.collect();
            let is_known = shares.iter().all(|share| share.slope.iter().all(|by| by.is_finite()));
            // Where a step leads out of what the map knows, another may not.
            let again = || given_noise::shares(map, &row, located.point);
            let shares = if is_known { Some(shares) } else { again() };
            let located = located.for_pixels(shares, &sigmas.variances(index, &row), holds);
            slots.put(index, Some(&located), true);
        }
    }

    /// Where points are with one coordinate of a camera's pixels moved.
    fn moved(&self, pixels: &PixelColumns, (camera, axis): (usize, usize)) -> LocatedBatch {
        let mut cameras = pixels.cameras().to_vec();
        let column: Vec<f64> =
            cameras[camera][axis].iter().map(|value| value + PIXEL_STEP).collect();
        cameras[camera][axis] = &column;
        let mut places = LocatedBatch::default();
        places.resize(pixels.points(), false, false);
        for (of, slots) in places.tasks(0) {
            drop(self.task(&PixelColumns::new(cameras.clone()).part(of), slots, None));
        }
        places
    }
}
