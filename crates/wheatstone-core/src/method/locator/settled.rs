//! A locator that is made ready once: what it says of a point depends on nothing that it was asked before.

use super::{
    super::PixelSigmas, Built, LocatedBatch, Locator, MOST_RESIDUAL, Request, rig::BatchOutputs,
};
use crate::geometry::PixelColumns;
use rayon::prelude::*;

/// A fitted map made ready for many points, once and for all.
///
/// It agrees with [`Reconstructor::locate`](crate::method::Reconstructor::locate) as closely as [`Locator`] does. What
/// it says of a point is a function of the map, of the pixels that it was made ready with, and of that point's pixels
/// alone: the same bits in any order, however points are cut into calls, and whatever the number of threads. Where
/// pixels or depths are far from those that it was made ready with, the map works them out one by one.
pub struct SettledLocator<'a> {
    locator: Locator<'a>,
}

impl<'a> Locator<'a> {
    /// Made ready once, where `shown` lie in pictures and in depth (the pixels that the map was fitted to, or others
    /// like those that are to be located); whatever it was asked before counts for nothing.
    #[must_use]
    pub fn settled(self, shown: &PixelColumns) -> SettledLocator<'a> {
        let Self { map, volume, noise, scale, stage, with_covariance, .. } = self;
        let fresh = Self::new(map.reconstructor, volume);
        let mut locator = Self { noise, scale, stage, with_covariance, ..fresh };
        let check = locator.map.epipolar_check.as_mut().filter(|_| with_covariance);
        locator.map.base.iter_mut().chain(check).for_each(|rig| rig.settle(shown));
        if with_covariance {
            locator.settle_covariances(shown);
        }
        SettledLocator { locator }
    }

    /// Makes boxes about these points, and eighths where a box does not hold.
    fn settle_covariances(&mut self, shown: &PixelColumns) {
        let is_constant = self.map.learned.as_ref().is_some_and(|own| own.covariance.is_some());
        let rays = self.map.rays().filter(|_| !is_constant);
        let Some((rays, covariances)) = rays.zip(self.covariances.as_ref()) else { return };
        let Some([x, y]) = shown.cameras().first() else { return };
        let mut nearness = vec![f64::NAN; shown.points()];
        let mut residual = nearness.clone();
        let met = BatchOutputs { point: None, residual: &mut residual, nearness: &mut nearness };
        rays.meet(shown, met);
        for (nearness, residual) in nearness.iter_mut().zip(residual) {
            if residual.is_nan() || residual > MOST_RESIDUAL {
                *nearness = f64::NAN;
            }
        }
        let slots = covariances.around([x, y, &nearness]);
        self.make_boxes(&slots);
        let Some(covariances) = &self.covariances else { return };
        let eighths: Vec<u32> =
            slots.iter().flat_map(|slot| covariances.eighths_of(*slot)).collect();
        self.make_boxes(&eighths);
    }

    fn make_boxes(&mut self, slots: &[u32]) {
        let requests = slots.iter().map(|slot| Request::Covariance(*slot));
        let requests: Vec<Request> = requests.collect();
        let made: Vec<Option<Built>> = requests.par_iter().map(|what| self.made(*what)).collect();
        requests.into_iter().zip(made).for_each(|(what, made)| self.take(what, made));
    }
}

impl SettledLocator<'_> {
    /// Locates points, in parallel.
    #[must_use]
    pub fn locate(&self, pixels: &PixelColumns) -> LocatedBatch {
        let mut places = LocatedBatch::default();
        self.locate_into(pixels, &mut places);
        places
    }

    /// [`SettledLocator::locate`] into columns that are there already: whoever locates again and again spares the
    /// memory.
    pub fn locate_into(&self, pixels: &PixelColumns, places: &mut LocatedBatch) {
        self.locate_noisy_into(pixels, None, places);
    }

    /// [`SettledLocator::locate_into`] for pixels whose standard deviations are given
    /// ([`Locator::locate_noisy_into`]).
    pub fn locate_noisy_into(
        &self,
        pixels: &PixelColumns,
        sigmas: Option<&PixelSigmas>,
        places: &mut LocatedBatch,
    ) {
        let own = &self.locator;
        places.resize(pixels.points(), own.with_covariance, own.volume.is_some());
        let tasks = places.tasks(0).into_par_iter().with_max_len(1);
        tasks.for_each(|(of, slots)| {
            let sigmas = sigmas.map(|sigmas| sigmas.part(of.clone()));
            drop(own.task(&pixels.part(of), slots, sigmas.as_ref()));
        });
    }
}
