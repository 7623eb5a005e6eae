//! Many points at once: columns of pixels in, columns of places out.
//!
//! Lenses are put down in patches of the picture and error bars in boxes of picture and depth, where so
//! many points ask for one that it pays; what neither holds is worked out by the map itself.

mod chebyshev_undistortion;
mod columns;
mod covariance_table;
mod indices;
mod located_batch;
mod map;
mod piece;
mod pixel_noise;
mod plan;
mod request;
mod rig;
mod settled;
mod undistortion_table;
mod undistortion_tiles;

pub use located_batch::LocatedBatch;
pub(super) use plan::Formulas;
pub use plan::{FormulaCameras, Learned, PlacedCamera, Plan};
pub use settled::SettledLocator;

use super::{CovarianceScale, PixelSigmas, PointNoise, Reconstructor};
use crate::{
    dataset::volume::Volume,
    geometry::{Pixel, PixelColumns, StageCovariance},
};
use covariance_table::CovarianceTable;
use indices::indices_where;
use located_batch::{LOWER, Slots};
use map::Map;
use piece::{PIECES, Piece};
use rayon::prelude::*;
use request::{Built, Request};
use rig::{BatchOutputs, Rig};
use std::{collections::BTreeMap, ops::Range};

/// A fitted map made ready for many points.
///
/// Its points are those of [`Reconstructor::locate`] to two thousandths of their standard deviations (two
/// hundredths where a camera's rays have no common centre), its error bars to a hundredth. The same points in
/// the same order give the same bits, however they are cut into calls, and whatever the number of threads.
pub struct Locator<'a> {
    map: Map<'a>,
    volume: Option<&'a Volume>,
    noise: Option<PointNoise>,
    scale: Option<CovarianceScale>,
    stage: Option<&'a StageCovariance>,
    with_covariance: bool,
    covariances: Option<CovarianceTable>,
    /// Points located so far.
    done: usize,
    /// The piece of the table that they end in.
    piece: Piece,
    /// What would have helped them, and how many of them.
    wanted: BTreeMap<Request, u32>,
}

/// So many points are worth sheets over the whole picture, which take some milliseconds.
const MANY: usize = 4 * PIECES[0];

/// Rays that miss each other by more pixels than this bend a point in ways that a single step does not
/// follow to a thousandth of a standard deviation: judged from how far weights change over so many pixels.
const MOST_RESIDUAL: f64 = 4.0;

impl<'a> Locator<'a> {
    /// Of a map, and the volume by which trust is judged.
    #[must_use]
    pub fn new(reconstructor: &'a dyn Reconstructor, volume: Option<&'a Volume>) -> Self {
        let rig = |cameras: Vec<PlacedCamera<'a>>| (!cameras.is_empty()).then(|| Rig::new(cameras));
        let (base, epipolar_check, learned) = match reconstructor.plan() {
            Plan::PointByPoint => (None, None, None),
            Plan::Cameras(cameras) => (rig(cameras), None, None),
            Plan::Formulas(given) => (Some(Rig::of_formulas(given)), None, None),
            Plan::Learned(mut learned) => {
                let (base, epipolar_check) = (&mut learned.base, &mut learned.epipolar_check);
                (rig(std::mem::take(base)), rig(std::mem::take(epipolar_check)), Some(learned))
            }
        };
        let map = Map { reconstructor, base, epipolar_check, learned };
        let rays = map.rays().filter(|rig| !rig.knows_covariance());
        let covariances = rays.and_then(|rig| Some(CovarianceTable::new(rig.cameras.first()?)));
        Self {
            map,
            volume,
            noise: None,
            scale: None,
            stage: None,
            with_covariance: true,
            covariances,
            done: 0,
            piece: Piece::FIRST,
            wanted: BTreeMap::new(),
        }
    }

    /// Boxes of covariances for cameras that have them in closed form too. For tests.
    #[doc(hidden)]
    #[must_use]
    pub fn with_boxes(mut self) -> Self {
        if let Plan::Formulas(given) = self.map.reconstructor.plan() {
            self.covariances = given.placed.first().map(CovarianceTable::new);
            self.map.base = Some(Rig::new(given.placed));
        }
        self
    }

    /// How many eighths of boxes were made. For tests.
    #[doc(hidden)]
    #[must_use]
    pub fn made_eighths(&self) -> usize {
        self.covariances.as_ref().map_or(0, CovarianceTable::made_eighths)
    }

    /// With noise that differs from point to point, a scale of covariances, and what is uncertain of the places of the
    /// charts that the map was fitted to, in every covariance.
    #[must_use]
    pub fn with_uncertainty(
        mut self,
        noise: Option<PointNoise>,
        scale: Option<CovarianceScale>,
        stage: Option<&'a StageCovariance>,
    ) -> Self {
        (self.noise, self.scale, self.stage) = (noise, scale, stage);
        self
    }

    /// Without covariances and residuals.
    #[must_use]
    pub fn points_only(mut self) -> Self {
        self.with_covariance = false;
        self
    }

    /// Locates points, in parallel.
    #[must_use]
    pub fn locate(&mut self, pixels: &PixelColumns) -> LocatedBatch {
        let mut places = LocatedBatch::default();
        self.locate_into(pixels, &mut places);
        places
    }

    /// [`Locator::locate`] into columns that are there already: whoever locates again and again spares
    /// the memory.
    pub fn locate_into(&mut self, pixels: &PixelColumns, places: &mut LocatedBatch) {
        self.locate_noisy_into(pixels, None, places);
    }

    /// [`Locator::locate_into`] for pixels whose standard deviations are given, whatever those were that the map was
    /// fitted to.
    pub fn locate_noisy_into(
        &mut self,
        pixels: &PixelColumns,
        sigmas: Option<&PixelSigmas>,
        places: &mut LocatedBatch,
    ) {
        places.resize(pixels.points(), self.with_covariance, self.volume.is_some());
        let mut tasks = places.tasks(self.done);
        while !tasks.is_empty() {
            let left = self.piece.end - self.done;
            let first = tasks[0].0.start;
            let others = tasks.split_off(tasks.partition_point(|(of, _)| of.start < first + left));
            let own = std::mem::replace(&mut tasks, others);
            self.done += own.iter().map(|(of, _)| of.len()).sum::<usize>();
            let run = |(of, slots): (Range<usize>, Slots)| {
                let sigmas = sigmas.map(|sigmas| sigmas.part(of.clone()));
                self.task(&pixels.part(of), slots, sigmas.as_ref())
            };
            let wanted: Vec<_> = own.into_par_iter().with_max_len(1).map(run).collect();
            for (what, points) in wanted.into_iter().flatten() {
                *self.wanted.entry(what).or_default() += points;
                self.piece.asked += points as usize;
            }
            if self.done == self.piece.end {
                self.make();
                self.piece = self.piece.next();
            }
        }
    }

    /// Makes what has come to pay.
    fn make(&mut self) {
        let pay: Vec<Request> = self
            .wanted
            .iter()
            .filter(|(what, points)| what.pays(**points))
            .map(|(w, _)| *w)
            .collect();
        let made: Vec<Option<Built>> = pay.par_iter().map(|what| self.made(*what)).collect();
        for (what, made) in pay.into_iter().zip(made) {
            self.wanted.remove(&what);
            self.take(what, made);
        }
        if self.done >= MANY {
            self.map.base.iter_mut().chain(&mut self.map.epipolar_check).for_each(Rig::cover);
        }
        // Pixels that mean nothing ask for ever new ones.
        const MOST: usize = 1 << 16;
        if self.wanted.len() > MOST {
            self.wanted.clear();
        }
    }

    fn made(&self, what: Request) -> Option<Built> {
        let patch = |rig: &Option<Rig>, camera: usize, slot: u32| {
            let rig = rig.as_ref()?;
            let patches = rig.patches.get(camera)?.as_ref()?;
            Some(Built::Tile(patches.make(rig.cameras.get(camera)?, slot)))
        };
        match what {
            Request::Base(camera, slot) => patch(&self.map.base, camera, slot),
            Request::EpipolarCheck(camera, slot) => patch(&self.map.epipolar_check, camera, slot),
            Request::Covariance(slot) => {
                let of = (self.map.reconstructor, self.map.rays()?.cameras.as_slice());
                Some(Built::Covariance(self.covariances.as_ref()?.make(of, slot)))
            }
        }
    }

    fn take(&mut self, what: Request, made: Option<Built>) {
        let patches = |rig: &mut Option<Rig>, camera: usize, slot: u32, made| {
            if let Some(Some(patches)) = rig.as_mut().and_then(|rig| rig.patches.get_mut(camera)) {
                patches.take(slot, made);
            }
        };
        match (what, made) {
            (Request::Base(camera, slot), Some(Built::Tile(made))) => {
                patches(&mut self.map.base, camera, slot, made);
            }
            (Request::EpipolarCheck(camera, slot), Some(Built::Tile(made))) => {
                patches(&mut self.map.epipolar_check, camera, slot, made);
            }
            (Request::Covariance(slot), Some(Built::Covariance(made))) => {
                if let Some(covariances) = &mut self.covariances {
                    covariances.take(slot, made);
                }
            }
            _ => {}
        }
    }

    /// Some points; what would have helped, and how many of them.
    fn task(
        &self,
        pixels: &PixelColumns,
        mut slots: Slots,
        sigmas: Option<&PixelSigmas>,
    ) -> BTreeMap<Request, u32> {
        let (full, map) = (slots.has_covariance(), &self.map);
        let has_rays = map.base.is_some() || (full && map.epipolar_check.is_some());
        let mut nearness = vec![f64::NAN; if has_rays { pixels.points() } else { 0 }];
        let lost = self.meet(pixels, &mut slots, &mut nearness);
        if full {
            self.covariance(pixels, &nearness, &mut slots);
        }
        // Where nothing is known there are no error bars either.
        let mut unsure = indices_where(slots.covariance[0], |value| !value.is_finite());
        unsure.retain(|index| lost.binary_search(index).is_err());
        let mut wanted = BTreeMap::new();
        let mut one_by_one = |index: usize, is_met: bool| {
            let row: Vec<Option<Pixel>> = pixels.point(index).collect();
            let nearness = nearness.get(index).copied().unwrap_or(f64::NAN);
            self.ask(&mut wanted, &row, (is_met, nearness));
            slots.put(index, map.reconstructor.locate(&row).as_ref(), is_met);
        };
        for index in lost {
            one_by_one(index, false);
        }
        for index in unsure {
            one_by_one(index, true);
        }
        if full {
            // How points of the fit differ in noise says nothing of pixels whose noise is given.
            let noise = self.noise.filter(|_| sigmas.is_none());
            noise.into_iter().for_each(|noise| slots.scale(noise, pixels));
            let scale = self.scale.filter(|scale| sigmas.is_none() || !scale.is_of_few());
            scale.into_iter().for_each(|scale| slots.rescale(scale));
            if let Some(sigmas) = sigmas {
                self.give_noise(pixels, &mut slots, (sigmas, scale.is_none()));
            }
            self.stage.into_iter().for_each(|stage| slots.widen(stage));
        }
        if let Some(volume) = self.volume.filter(|_| !slots.trust.is_empty()) {
            slots.trust.copy_from_slice(&volume.trust_columns(pixels));
        }
        wanted
    }

    /// Where points are; those of which that is not known, in their order.
    fn meet(&self, pixels: &PixelColumns, slots: &mut Slots, nearness: &mut [f64]) -> Vec<usize> {
        let (full, map) = (slots.has_covariance(), &self.map);
        let mut missed = vec![f64::NAN; if full { 0 } else { nearness.len() }];
        let residual = if full { &mut *slots.residual } else { &mut missed[..] };
        let mut lost = Vec::new();
        let is_far = |miss: f64| miss.is_nan() | (miss > MOST_RESIDUAL);
        if let Some(base) = &map.base {
            let point = Some(slots.point.each_mut().map(|column| &mut **column));
            base.meet(pixels, BatchOutputs { point, residual, nearness });
            lost = indices_where(residual, is_far);
        }
        let Some(learned) = &map.learned else {
            if map.base.is_none() {
                lost.extend(0..pixels.points());
            }
            return lost;
        };
        (learned.correct)(pixels, &mut slots.point);
        if map.base.is_none() {
            lost = indices_where(slots.point[2], |z| !z.is_finite());
        }
        match &map.epipolar_check {
            Some(epipolar_check) if full => {
                epipolar_check.meet(pixels, BatchOutputs { point: None, residual, nearness });
                lost.extend(indices_where(residual, is_far));
                lost.sort_unstable();
                lost.dedup();
            }
            _ => residual.fill(f64::NAN),
        }
        lost
    }

    /// How sure points are.
    fn covariance(&self, pixels: &PixelColumns, nearness: &[f64], slots: &mut Slots) {
        let constant = self.map.learned.as_ref().and_then(|learned| learned.covariance);
        slots.residual_sigma.fill(f64::NAN);
        for (column, place) in slots.covariance.iter_mut().zip(LOWER) {
            column.fill(constant.map_or(f64::NAN, |covariance| covariance[place]));
        }
        if let Some(base) = self.map.base.as_ref().filter(|base| base.knows_covariance()) {
            let points = slots.point.each_ref().map(|column| &**column);
            base.covariance((pixels, points), &mut slots.covariance, slots.residual_sigma);
            return;
        }
        let first = pixels.cameras().first();
        if let (None, Some(covariances), Some([x, y])) = (constant, &self.covariances, first) {
            covariances.columns([*x, *y, nearness], &mut slots.covariance, slots.residual_sigma);
        }
    }

    /// Notes what would have helped a point; whether its rays met, and how near.
    fn ask(
        &self,
        wanted: &mut BTreeMap<Request, u32>,
        pixels: &[Option<Pixel>],
        (is_met, nearness): (bool, f64),
    ) {
        let mut note = |what: Request| *wanted.entry(what).or_default() += 1;
        let missing = |rig: &Option<Rig>| -> Vec<(usize, u32)> {
            rig.iter().flat_map(|rig| rig.missing(pixels.iter().copied())).collect()
        };
        if is_met {
            let spread = self.covariances.as_ref().zip(pixels.first().copied().flatten());
            let missing =
                spread.and_then(|(covariances, pixel)| covariances.missing(pixel, nearness));
            missing.into_iter().for_each(|slot| note(Request::Covariance(slot)));
            return;
        }
        missing(&self.map.base)
            .into_iter()
            .for_each(|(camera, slot)| note(Request::Base(camera, slot)));
        if self.with_covariance {
            let missing = missing(&self.map.epipolar_check);
            missing
                .into_iter()
                .for_each(|(camera, slot)| note(Request::EpipolarCheck(camera, slot)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{AnyMethod, staged::staged};
    use wheatstone_numeric::progress::Silent;

    #[test]
    fn formulas_need_no_boxes() {
        let train = staged(0.1);
        for name in ["dlt", "soloff"] {
            let fit = AnyMethod::named(name).unwrap().fit_checked(&train, 0, &Silent).unwrap();
            assert!(Locator::new(&*fit.reconstructor, None).covariances.is_none(), "{name}");
        }
    }
}
