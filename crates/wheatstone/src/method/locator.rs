//! Many points at once: columns of pixels in, columns of places out.
//!
//! Lenses are put down in patches of the picture and error bars in boxes of picture and depth, where so
//! many points ask for one that it pays; what neither holds is worked out by the map itself.

mod patches;
mod plan;
mod rig;
mod spread;

pub use plan::{Learned, PlacedCamera, Plan};

use super::{Located, Reconstructor};
use crate::{
    dataset::volume::{Trust, Volume},
    geometry::{Pixel, PixelColumns},
};
use nalgebra::Matrix3;
use rayon::prelude::*;
use rig::{Met, Rig};
use spread::Spreads;
use std::collections::BTreeMap;

/// Where points are, column by column, in the order of their pixels. NaN stands where a point was not
/// located, and for figures that do not exist.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// X, Y and Z, in world units.
    pub point: [Vec<f64>; 3],
    /// Covariance XX, XY, XZ, YY, YZ, ZZ, in squared world units; empty where it was not asked for.
    pub covariance: [Vec<f64>; 6],
    /// How badly the rays miss each other: root mean square over pixel coordinates. Empty where the
    /// covariance is.
    pub residual: Vec<f64>,
    /// What noise and uncertainty of the fit let expect of it; empty where the covariance is.
    pub residual_sigma: Vec<f64>,
    /// Whether the pixels show what the fit was shown; empty where no volume was given.
    pub trust: Vec<Trust>,
}

/// A fitted map made ready for many points.
///
/// Its points are those of [`Reconstructor::locate`] to a thousandth of their standard deviations, its
/// error bars to half a hundredth. The same columns in the same order give the same bits, whatever the
/// number of threads.
pub struct Locator<'a> {
    map: Map<'a>,
    volume: Option<&'a Volume>,
    with_covariance: bool,
    spreads: Option<Spreads>,
}

/// A map as its plan has it.
struct Map<'a> {
    reconstructor: &'a dyn Reconstructor,
    /// Whose rays meet: the cameras, or those whose point a formula starts from.
    base: Option<Rig<'a>>,
    /// The formula.
    learned: Option<Learned<'a>>,
    /// Who says whether pixels belong together, beside a formula.
    witness: Option<Rig<'a>>,
}

/// Points a task: large enough to pay for handing it over, small enough to balance and to stay in a cache.
const TASK: usize = 2048;

/// Rays that miss each other by more pixels than this bend a point in ways that a single step does not
/// follow to a thousandth of a standard deviation.
const MOST_RESIDUAL: f64 = 4.0;

/// What may be made on demand: a patch of the base's or the witness's camera, or a box of spreads; each by
/// its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Wanted {
    Base(usize, u32),
    Witness(usize, u32),
    Spread(u32),
}

impl Wanted {
    /// As many points must ask for it as it takes to make it.
    fn pays(self, points: u32) -> bool {
        points as usize
            >= if matches!(self, Self::Spread(_)) { spread::NODES } else { patches::NODES }
    }
}

/// Where the figures of some points go.
struct Slots<'p> {
    point: [&'p mut [f64]; 3],
    covariance: [&'p mut [f64]; 6],
    residual: &'p mut [f64],
    residual_sigma: &'p mut [f64],
    trust: &'p mut [Trust],
}

/// What is still to be done for some points.
struct Rest {
    /// Points that the map itself must locate.
    open: Vec<usize>,
    /// What would help, and how many points it would help.
    wanted: BTreeMap<Wanted, u32>,
}

impl<'a> Locator<'a> {
    /// Of a map, and the volume by which trust is judged.
    #[must_use]
    pub fn new(reconstructor: &'a dyn Reconstructor, volume: Option<&'a Volume>) -> Self {
        let (base, witness, learned) = match reconstructor.plan() {
            Plan::PointByPoint => (Vec::new(), Vec::new(), None),
            Plan::Cameras(cameras) => (cameras, Vec::new(), None),
            Plan::Learned(mut learned) => (
                std::mem::take(&mut learned.base),
                std::mem::take(&mut learned.witness),
                Some(learned),
            ),
        };
        let rig = |cameras: Vec<PlacedCamera<'a>>| (!cameras.is_empty()).then(|| Rig::new(cameras));
        let map = Map { reconstructor, base: rig(base), witness: rig(witness), learned };
        let spreads = map.rays().and_then(|rig| Some(Spreads::new(rig.cameras.first()?)));
        Self { map, volume, with_covariance: true, spreads }
    }

    /// Without covariances and residuals.
    #[must_use]
    pub fn points_only(mut self) -> Self {
        self.with_covariance = false;
        self
    }

    /// Locates points, in parallel.
    #[must_use]
    pub fn locate(&mut self, pixels: &PixelColumns) -> Places {
        let mut places = Places::default();
        self.locate_into(pixels, &mut places);
        places
    }

    /// [`Locator::locate`] into columns that are there already: whoever locates again and again spares
    /// the memory.
    pub fn locate_into(&mut self, pixels: &PixelColumns, places: &mut Places) {
        let count = pixels.points();
        places.resize(count, self.with_covariance, self.volume.is_some());
        let range = |task: usize| task * TASK..count.min((task + 1) * TASK);
        let mut slots = places.slots(count.div_ceil(TASK));
        let run =
            |own: &Self, task: usize, slots: &mut Slots| own.part(&pixels.part(range(task)), slots);
        let mut rests: Vec<Rest> =
            slots.par_iter_mut().enumerate().map(|(task, slots)| run(self, task, slots)).collect();
        // Patches first, then boxes, for which points must be known.
        for _ in 0..2 {
            if !self.make(&rests) {
                break;
            }
            let each = slots.par_iter_mut().zip(&mut rests).enumerate();
            each.filter(|(_, (_, rest))| !rest.wanted.is_empty())
                .for_each(|(task, (slots, rest))| *rest = run(self, task, slots));
        }
        let each = slots.into_par_iter().zip(rests).enumerate();
        each.for_each(|(task, (slots, rest))| self.finish(rest, &pixels.part(range(task)), slots));
    }

    /// Makes what it pays to make; whether there was anything.
    fn make(&mut self, rests: &[Rest]) -> bool {
        let mut wanted: BTreeMap<Wanted, u32> = BTreeMap::new();
        for (what, points) in rests.iter().flat_map(|rest| &rest.wanted) {
            *wanted.entry(*what).or_default() += points;
        }
        let wanted: Vec<Wanted> = wanted
            .into_iter()
            .filter(|(what, points)| what.pays(*points))
            .map(|(w, _)| w)
            .collect();
        let made: Vec<Option<Made>> = wanted.par_iter().map(|what| self.made(*what)).collect();
        for (what, made) in wanted.iter().zip(made) {
            self.take(*what, made);
        }
        !wanted.is_empty()
    }

    fn made(&self, what: Wanted) -> Option<Made> {
        let patch = |rig: &Option<Rig>, camera: usize, slot: u32| {
            let rig = rig.as_ref()?;
            let patches = rig.patches.get(camera)?.as_ref()?;
            Some(Made::Patch(patches.make(rig.cameras.get(camera)?, slot)))
        };
        match what {
            Wanted::Base(camera, slot) => patch(&self.map.base, camera, slot),
            Wanted::Witness(camera, slot) => patch(&self.map.witness, camera, slot),
            Wanted::Spread(slot) => {
                let of = (self.map.reconstructor, self.map.rays()?.cameras.as_slice());
                Some(Made::Spread(self.spreads.as_ref()?.make(of, slot)))
            }
        }
    }

    fn take(&mut self, what: Wanted, made: Option<Made>) {
        let patches = |rig: &mut Option<Rig>, camera: usize, slot: u32, made| {
            if let Some(Some(patches)) = rig.as_mut().and_then(|rig| rig.patches.get_mut(camera)) {
                patches.take(slot, made);
            }
        };
        match (what, made) {
            (Wanted::Base(camera, slot), Some(Made::Patch(made))) => {
                patches(&mut self.map.base, camera, slot, made);
            }
            (Wanted::Witness(camera, slot), Some(Made::Patch(made))) => {
                patches(&mut self.map.witness, camera, slot, made);
            }
            (Wanted::Spread(slot), Some(Made::Spread(made))) => {
                if let Some(spreads) = &mut self.spreads {
                    spreads.take(slot, made);
                }
            }
            _ => {}
        }
    }

    /// Some points, as far as what is made tells.
    fn part(&self, pixels: &PixelColumns, slots: &mut Slots) -> Rest {
        let (count, full) = (pixels.points(), self.with_covariance);
        let Met { mut point, mut residual, mut nearness } = match &self.map.base {
            Some(rig) => rig.meet(pixels),
            None => Met::none(count),
        };
        let mut is_met: Vec<bool> = residual.iter().map(|miss| *miss <= MOST_RESIDUAL).collect();
        let mut has_residual = self.map.base.is_some();
        if let Some(learned) = &self.map.learned {
            (learned.correct)(pixels, &mut point);
            if self.map.base.is_none() {
                is_met = point[2].iter().map(|z| z.is_finite()).collect();
            }
            has_residual = self.map.witness.is_some();
            if let (Some(witness), true) = (&self.map.witness, full) {
                Met { residual, nearness, .. } = witness.meet(pixels);
                let known = is_met.iter_mut().zip(&residual);
                known.for_each(|(met, miss)| *met &= *miss <= MOST_RESIDUAL);
            }
        }
        for (slot, column) in slots.point.iter_mut().zip(&point) {
            slot.copy_from_slice(column);
        }
        if full {
            if has_residual {
                slots.residual.copy_from_slice(&residual);
            } else {
                slots.residual.fill(f64::NAN);
            }
            self.spread(pixels, &nearness, slots);
        }
        let mut rest = Rest { open: Vec::new(), wanted: BTreeMap::new() };
        for (index, met) in is_met.into_iter().enumerate() {
            let known = !full || slots.covariance[0][index].is_finite();
            if !met || !known {
                rest.open.push(index);
                self.ask(&mut rest.wanted, pixels.point(index), (met, nearness[index]));
            }
        }
        rest
    }

    /// How sure points are.
    fn spread(&self, pixels: &PixelColumns, nearness: &[f64], slots: &mut Slots) {
        let constant = self.map.learned.as_ref().and_then(|learned| learned.covariance);
        slots.residual_sigma.fill(f64::NAN);
        for (column, place) in slots.covariance.iter_mut().zip(LOWER) {
            column.fill(constant.map_or(f64::NAN, |covariance| covariance[place]));
        }
        let first = pixels.cameras().first();
        if let (None, Some(spreads), Some([x, y])) = (constant, &self.spreads, first) {
            spreads.columns([*x, *y, nearness], &mut slots.covariance, slots.residual_sigma);
        }
    }

    /// Notes what would have helped a point; whether its rays met, and how near.
    fn ask(
        &self,
        wanted: &mut BTreeMap<Wanted, u32>,
        pixels: impl Iterator<Item = Option<Pixel>>,
        (is_met, nearness): (bool, f64),
    ) {
        let pixels: Vec<Option<Pixel>> = pixels.collect();
        let mut note = |what: Wanted| *wanted.entry(what).or_default() += 1;
        let missing = |rig: &Option<Rig>| -> Vec<(usize, u32)> {
            rig.iter().flat_map(|rig| rig.missing(pixels.iter().copied())).collect()
        };
        if is_met {
            let spread = self.spreads.as_ref().zip(pixels.first().copied().flatten());
            let missing = spread.and_then(|(spreads, pixel)| spreads.missing(pixel, nearness));
            missing.into_iter().for_each(|slot| note(Wanted::Spread(slot)));
            return;
        }
        missing(&self.map.base)
            .into_iter()
            .for_each(|(camera, slot)| note(Wanted::Base(camera, slot)));
        if self.with_covariance {
            let missing = missing(&self.map.witness);
            missing.into_iter().for_each(|(camera, slot)| note(Wanted::Witness(camera, slot)));
        }
    }

    /// What is still open by the map itself, and trust.
    fn finish(&self, rest: Rest, pixels: &PixelColumns, mut slots: Slots) {
        for index in rest.open {
            let row: Vec<_> = pixels.point(index).collect();
            slots.put(index, self.map.reconstructor.locate(&row).as_ref());
        }
        if let Some(volume) = self.volume {
            slots.trust.copy_from_slice(&volume.trust_columns(pixels));
        }
    }
}

/// What was made on demand.
enum Made {
    Patch(patches::Made),
    Spread(spread::Made),
}

impl<'a> Map<'a> {
    /// Whose rays tell how near points are.
    fn rays(&self) -> Option<&Rig<'a>> {
        if self.learned.is_some() { self.witness.as_ref() } else { self.base.as_ref() }
    }
}

/// Where the six numbers of a covariance stand in it.
const LOWER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Slots<'_> {
    /// Puts what the map said of a point.
    fn put(&mut self, index: usize, found: Option<&Located>) {
        let none = Located {
            point: [f64::NAN; 3].into(),
            covariance: Matrix3::repeat(f64::NAN),
            residual: f64::NAN,
            residual_sigma: f64::NAN,
        };
        let found = found.unwrap_or(&none);
        for (axis, column) in self.point.iter_mut().enumerate() {
            column[index] = found.point[axis];
        }
        if self.residual.is_empty() {
            return;
        }
        for (place, column) in LOWER.into_iter().zip(&mut self.covariance) {
            column[index] = found.covariance[place];
        }
        self.residual[index] = found.residual;
        self.residual_sigma[index] = found.residual_sigma;
    }
}

impl Places {
    /// Makes room for so many points; what is in it is anything.
    fn resize(&mut self, count: usize, with_covariance: bool, with_trust: bool) {
        let figures = if with_covariance { count } else { 0 };
        self.point.iter_mut().for_each(|column| column.resize(count, 0.0));
        self.covariance.iter_mut().for_each(|column| column.resize(figures, 0.0));
        self.residual.resize(figures, 0.0);
        self.residual_sigma.resize(figures, 0.0);
        self.trust.resize(if with_trust { count } else { 0 }, Trust::Outside);
    }

    /// Where each of so many tasks puts its figures.
    fn slots(&mut self, tasks: usize) -> Vec<Slots<'_>> {
        fn next<'p, T>(left: &mut &'p mut [T]) -> &'p mut [T] {
            let (own, others) = std::mem::take(left).split_at_mut(TASK.min(left.len()));
            *left = others;
            own
        }
        let mut point = self.point.each_mut().map(Vec::as_mut_slice);
        let mut covariance = self.covariance.each_mut().map(Vec::as_mut_slice);
        let (mut residual, mut sigma) = (&mut self.residual[..], &mut self.residual_sigma[..]);
        let mut trust = &mut self.trust[..];
        (0..tasks)
            .map(|_| Slots {
                point: point.each_mut().map(next),
                covariance: covariance.each_mut().map(next),
                residual: next(&mut residual),
                residual_sigma: next(&mut sigma),
                trust: next(&mut trust),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests;
