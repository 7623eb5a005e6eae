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
use std::{collections::BTreeMap, ops::Range};

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
/// Its points are those of [`Reconstructor::locate`] to two thousandths of their standard deviations (two
/// hundredths where a camera's rays have no common centre), its error bars to a hundredth. The same points in
/// the same order give the same bits, however they are cut into calls, and whatever the number of threads.
pub struct Locator<'a> {
    map: Map<'a>,
    volume: Option<&'a Volume>,
    with_covariance: bool,
    spreads: Option<Spreads>,
    /// Points located so far.
    done: usize,
    /// What would have helped them, and how many of them.
    wanted: BTreeMap<Wanted, u32>,
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

/// After so many points what has come to pay is made.
const PIECE: usize = 8 * TASK;

/// Rays that miss each other by more pixels than this bend a point in ways that a single step does not
/// follow to a thousandth of a standard deviation: judged from how far weights change over so many pixels.
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
        Self { map, volume, with_covariance: true, spreads, done: 0, wanted: BTreeMap::new() }
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
        places.resize(pixels.points(), self.with_covariance, self.volume.is_some());
        let mut tasks = places.tasks(self.done);
        while !tasks.is_empty() {
            let piece = PIECE - self.done % PIECE;
            let first = tasks[0].0.start;
            let others = tasks.split_off(tasks.partition_point(|(of, _)| of.start < first + piece));
            let own = std::mem::replace(&mut tasks, others);
            self.done += own.iter().map(|(of, _)| of.len()).sum::<usize>();
            let run = |(of, slots): (Range<usize>, Slots)| self.task(&pixels.part(of), slots);
            let wanted: Vec<_> = own.into_par_iter().map(run).collect();
            for (what, points) in wanted.into_iter().flatten() {
                *self.wanted.entry(what).or_default() += points;
            }
            if self.done.is_multiple_of(PIECE) {
                self.make();
            }
        }
    }

    /// Makes what has come to pay.
    fn make(&mut self) {
        let pay: Vec<Wanted> = self
            .wanted
            .iter()
            .filter(|(what, points)| what.pays(**points))
            .map(|(w, _)| *w)
            .collect();
        let made: Vec<Option<Made>> = pay.par_iter().map(|what| self.made(*what)).collect();
        for (what, made) in pay.into_iter().zip(made) {
            self.wanted.remove(&what);
            self.take(what, made);
        }
        // Pixels that mean nothing ask for ever new ones.
        const MOST: usize = 1 << 16;
        if self.wanted.len() > MOST {
            self.wanted.clear();
        }
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

    /// Some points; what would have helped, and how many of them.
    fn task(&self, pixels: &PixelColumns, mut slots: Slots) -> BTreeMap<Wanted, u32> {
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
            self.spread(pixels, &nearness, &mut slots);
        }
        let mut wanted = BTreeMap::new();
        for (index, met) in is_met.into_iter().enumerate() {
            let known = !full || slots.covariance[0][index].is_finite();
            if !met || !known {
                let row: Vec<Option<Pixel>> = pixels.point(index).collect();
                self.ask(&mut wanted, &row, (met, nearness[index]));
                slots.put(index, self.map.reconstructor.locate(&row).as_ref());
            }
        }
        if let Some(volume) = self.volume {
            slots.trust.copy_from_slice(&volume.trust_columns(pixels));
        }
        wanted
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
        pixels: &[Option<Pixel>],
        (is_met, nearness): (bool, f64),
    ) {
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

    /// Tasks after `done` points, and where each puts its figures.
    fn tasks(&mut self, done: usize) -> Vec<(Range<usize>, Slots<'_>)> {
        fn next<'p, T>(left: &mut &'p mut [T], length: usize) -> &'p mut [T] {
            let length = length.min(left.len());
            let (own, others) = std::mem::take(left).split_at_mut(length);
            *left = others;
            own
        }
        let count = self.point[0].len();
        let mut point = self.point.each_mut().map(Vec::as_mut_slice);
        let mut covariance = self.covariance.each_mut().map(Vec::as_mut_slice);
        let (mut residual, mut sigma) = (&mut self.residual[..], &mut self.residual_sigma[..]);
        let mut trust = &mut self.trust[..];
        let (mut tasks, mut start) = (Vec::new(), 0);
        while start < count {
            let length = (TASK - (done + start) % TASK).min(count - start);
            let slots = Slots {
                point: point.each_mut().map(|column| next(column, length)),
                covariance: covariance.each_mut().map(|column| next(column, length)),
                residual: next(&mut residual, length),
                residual_sigma: next(&mut sigma, length),
                trust: next(&mut trust, length),
            };
            tasks.push((start..start + length, slots));
            start += length;
        }
        tasks
    }
}

#[cfg(test)]
mod tests;
