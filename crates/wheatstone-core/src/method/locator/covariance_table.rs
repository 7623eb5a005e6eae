//! How sure a map's points are, in boxes of picture and nearness: error bars that change slowly need not be
//! worked out for each point anew.
//!
//! A box is made by itself, from the map alone, when points ask for it; it is used only where it says what
//! the map says. Where it does not, its eighths are tried in its place.

mod cell;

pub(super) use cell::NODES;

use super::{super::Reconstructor, plan::PlacedCamera};
use crate::geometry::Pixel;
use cell::{Cell, FIGURES, Interpolate, NONE, fitted, through, told};
use nalgebra::{DMatrix, Matrix3};
use std::{cmp::Reverse, collections::BTreeMap};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Boxes along each side of the picture that can be told apart; the outermost are never made, for they
/// get what lies beyond.
const SIDE: usize = 128;

/// The same along the nearness: 32 octaves to each side of one a unit.
const LAYERS: usize = 256;

/// Boxes before pixel 0.
const BEFORE: f64 = 32.0;

/// A box takes at most this angle of the picture, in radians.
const WIDTH: f64 = 0.1;

/// Boxes to a factor of two of the nearness; a power of two.
const OCTAVE_BITS: u32 = 2;

/// A box whose standard deviations are further from the map's than this share somewhere is not used: less
/// than a tenth of how well a fit knows its own noise.
const TOLERANCE: f64 = 0.008;

/// Boxes of a map.
pub(super) struct CovarianceTable {
    /// Boxes a pixel of the first camera.
    density: f64,
    /// Which box is where: 0 for one that is not made yet, and with [`SPLIT`] which eighths stand in place of one
    /// that cannot be.
    index: Vec<u32>,
    /// Which box is each eighth's: 0 for one that is not made yet, 1 for one that cannot be.
    eighths: Vec<[u32; 8]>,
    /// The first two tell nothing.
    boxes: Vec<Cell>,
    /// From figures at the nodes to factors of the terms.
    through: Option<DMatrix<f64>>,
}

/// Marks a box that could not be made, but its eighths perhaps.
const SPLIT: u32 = 1 << 31;

/// So many whole boxes are made at once, at most: a box takes from a third of a millisecond to some milliseconds.
const MOST_SETTLED: usize = 384;

/// How far from the points that were shown others are expected, as a share of a box in the picture and as a share of
/// the nearness: one that no box holds takes a hundred times as long.
const BESIDE: f64 = 0.1;
const NEARER: f64 = 0.06;

/// Slots of whole boxes; those of the first eighths of all follow, then those of the second.
const SLOTS: usize = SIDE * SIDE * LAYERS;

/// A point in its box.
#[derive(Clone, Copy)]
struct Place {
    slot: usize,
    within: [f64; 3],
}

/// A covariance, and what residual to expect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PointCovariance {
    /// XX, XY, XZ, YY, YZ, ZZ.
    pub(super) covariance: [f64; 6],
    pub(super) residual_sigma: f64,
}

/// Bits of a double below those that say its octave and its part of the octave.
const BELOW: u32 = 52 - OCTAVE_BITS;

/// The upper bits of the first nearness that is told apart.
const FIRST: u64 = (1023 << OCTAVE_BITS) - LAYERS as u64 / 2;

impl CovarianceTable {
    pub(super) fn new(first: &PlacedCamera) -> Self {
        let exponent = libm::floor(libm::log2(f64::max(WIDTH * first.focal, 1.0)));
        Self {
            density: 1.0 / libm::exp2(exponent),
            index: vec![0; SLOTS],
            eighths: Vec::new(),
            boxes: vec![NONE; 2],
            through: through(),
        }
    }

    #[inline(always)]
    fn place(&self, x: f64, y: f64, nearness: f64) -> Place {
        let along = |value: f64| (value * self.density + BEFORE).max(0.0).min(SIDE as f64 - 0.5);
        let (x, y) = (along(x), along(y));
        let (column, row) = (x as u32, y as u32);
        let bits = nearness.to_bits();
        let layer = (bits >> BELOW).saturating_sub(FIRST).min(LAYERS as u64 - 1);
        // The rest of the bits, as a number in 1..2.
        let rest = f64::from_bits((1023 << 52) | ((bits << (64 - BELOW)) >> (64 - 52)));
        let within = |value: f64, cell: u32| 2.0 * (value - f64::from(cell)) - 1.0;
        Place {
            slot: (layer as usize * SIDE + row as usize) * SIDE + column as usize,
            within: [within(x, column), within(y, row), 2.0 * rest - 3.0],
        }
    }

    /// The covariances of points that the first camera observes at x and y with this nearness; not numbers where
    /// no box says them.
    pub(super) fn columns(
        &self,
        points: [&[f64]; 3],
        covariance: &mut [&mut [f64]; 6],
        residual_sigma: &mut [f64],
    ) {
        on_widest(Interpolating { table: self, points, covariance, residual_sigma });
    }

    /// Which box a place is in, and where; as the index has it.
    #[inline(always)]
    fn found(&self, mut place: Place) -> (u32, Place) {
        let found = self.index[place.slot];
        if found & SPLIT == 0 {
            return (found, place);
        }
        let mut part = 0;
        for (axis, within) in place.within.iter_mut().enumerate() {
            let is_upper = *within > 0.0;
            part |= usize::from(is_upper) << axis;
            *within = 2.0 * *within + if is_upper { -1.0 } else { 1.0 };
        }
        place.slot += (1 + part) * SLOTS;
        (self.eighths[(found & !SPLIT) as usize][part], place)
    }

    /// The box that a point asks for, where it is not made yet.
    pub(super) fn missing(&self, pixel: Pixel, nearness: f64) -> Option<u32> {
        let place = self.place(pixel.x, pixel.y, nearness);
        let slot = place.slot;
        let known = is_inner(slot) && nearness > 0.0;
        let (found, place) = self.found(place);
        (known && found == 0).then_some(place.slot as u32)
    }

    /// The slots of whole boxes that points lie in or just beside, and of those between two such; where there are too
    /// many, those that hold the most. Sorted.
    pub(super) fn around(&self, [x, y, nearness]: [&[f64]; 3]) -> Vec<u32> {
        let mut held: BTreeMap<usize, usize> = BTreeMap::new();
        let aside = BESIDE / self.density;
        for ((x, y), near) in x.iter().zip(y).zip(nearness) {
            if x.is_finite() && y.is_finite() && near.is_finite() && *near > 0.0 {
                *held.entry(self.place(*x, *y, *near).slot).or_default() += 1;
                for side in [-1.0, 1.0] {
                    let beside = [
                        self.place(x + side * aside, *y, *near),
                        self.place(*x, y + side * aside, *near),
                        self.place(*x, *y, near * (1.0 + side * NEARER)),
                    ];
                    for place in beside {
                        held.entry(place.slot).or_default();
                    }
                }
            }
        }
        let steps = [1, SIDE, SIDE * SIDE];
        let pairs = held.keys().flat_map(|slot| steps.map(|step| (*slot, step)));
        let between = pairs.filter(|(slot, step)| held.contains_key(&(slot + 2 * step)));
        let between: Vec<usize> = between.map(|(slot, step)| slot + step).collect();
        for slot in between {
            held.entry(slot).or_default();
        }
        let mut slots: Vec<(usize, usize)> =
            held.into_iter().filter(|(slot, _)| is_inner(*slot)).collect();
        slots.sort_by_key(|(slot, points)| (Reverse(*points), *slot));
        slots.truncate(MOST_SETTLED);
        let mut slots: Vec<u32> = slots.into_iter().map(|(slot, _)| slot as u32).collect();
        slots.sort_unstable();
        slots
    }

    /// The slots of the eighths that stand in place of a box that could not be made.
    pub(super) fn eighths_of(&self, slot: u32) -> impl Iterator<Item = u32> {
        let is_split = self.index[slot as usize] & SPLIT != 0;
        (1..=8).filter(move |_| is_split).map(move |part| slot + (part * SLOTS) as u32)
    }

    /// Takes over what was made for a slot.
    pub(super) fn take(&mut self, slot: u32, made: BuiltCell) {
        let (whole, part) = (slot as usize % SLOTS, slot as usize / SLOTS);
        let next = match made.0 {
            Some(own) => {
                self.boxes.push(*own);
                self.boxes.len() as u32 - 1
            }
            None if part == 0 => {
                self.eighths.push([0; 8]);
                SPLIT | (self.eighths.len() as u32 - 1)
            }
            None => 1,
        };
        if part == 0 {
            self.index[whole] = next;
        } else {
            self.eighths[(self.index[whole] & !SPLIT) as usize][part - 1] = next;
        }
    }

    /// How many eighths there are in place of boxes.
    pub(super) fn made_eighths(&self) -> usize {
        self.eighths.as_flattened().iter().filter(|found| **found > 1).count()
    }

    /// Makes the box of a slot.
    pub(super) fn make(
        &self,
        (reconstructor, cameras): (&dyn Reconstructor, &[PlacedCamera]),
        slot: u32,
    ) -> BuiltCell {
        let exact = |within: [f64; 3]| {
            let (pixel, nearness) = self.seen(slot as usize, within);
            let first = cameras.first()?;
            let (point, _) = first.place(first.plane_of(pixel, nearness)?, nearness)?;
            let pixels: Vec<Option<Pixel>> =
                cameras.iter().map(|camera| camera.project(point)).collect();
            let found =
                pixels.iter().all(Option::is_some).then(|| reconstructor.locate(&pixels))??;
            PointCovariance::figures(
                &found.covariance,
                found.residual.map_or(f64::NAN, |residual| residual.sigma),
                nearness,
            )
        };
        let depth = |within: [f64; 3]| 1.0 / self.seen(slot as usize, within).1;
        let made = self.through.as_ref().and_then(|through| fitted(through, &exact));
        let made = made.filter(|own| holds(own, &exact, &depth));
        BuiltCell(made.map(Box::new))
    }

    /// Pixel and nearness of a place in a slot, each coordinate in -1..1.
    fn seen(&self, slot: usize, mut within: [f64; 3]) -> (Pixel, f64) {
        if let Some(part) = (slot / SLOTS).checked_sub(1) {
            for (axis, within) in within.iter_mut().enumerate() {
                let is_upper = part >> axis & 1 == 1;
                *within = 0.5 * (*within + if is_upper { 1.0 } else { -1.0 });
            }
        }
        let (slot, [x, y, near]) = (slot % SLOTS, within);
        let along =
            |cell: usize, within: f64| (cell as f64 - BEFORE + 0.5 + 0.5 * within) / self.density;
        let pixel = Pixel::new(along(slot % SIDE, x), along(slot / SIDE % SIDE, y));
        let layer = FIRST + (slot / (SIDE * SIDE)) as u64;
        let (low, high) = (f64::from_bits(layer << BELOW), f64::from_bits((layer + 1) << BELOW));
        (pixel, low + (high - low) * (0.5 + 0.5 * near))
    }
}

/// Whether a whole box's slot is not one of the outermost.
fn is_inner(slot: usize) -> bool {
    let inner = |cell: usize, cells: usize| (1..cells - 1).contains(&cell);
    inner(slot % SIDE, SIDE)
        && inner(slot / SIDE % SIDE, SIDE)
        && inner(slot / (SIDE * SIDE), LAYERS)
}

/// One run through columns.
struct Interpolating<'a, 'b, 'c> {
    table: &'a CovarianceTable,
    points: [&'a [f64]; 3],
    covariance: &'b mut [&'c mut [f64]; 6],
    residual_sigma: &'b mut [f64],
}

impl WithSimd for Interpolating<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, points: [x, y, nearness], covariance, residual_sigma } = self;
        for (index, sigma) in residual_sigma.iter_mut().enumerate() {
            let place = table.place(x[index], y[index], nearness[index]);
            let (found, place) = table.found(place);
            let own = &table.boxes[found as usize];
            let figures = told(simd, own, place.within);
            let point = PointCovariance::of(&figures, 1.0 / nearness[index]);
            for (column, value) in covariance.iter_mut().zip(point.covariance) {
                column[index] = value;
            }
            *sigma = point.residual_sigma;
        }
    }
}

/// A box, where there can be one.
pub(super) struct BuiltCell(Option<Box<Cell>>);

/// Whether a box says what the map says, in its corners and between.
fn holds(
    own: &Cell,
    exact: &dyn Fn([f64; 3]) -> Option<[f64; FIGURES]>,
    depth: &dyn Fn([f64; 3]) -> f64,
) -> bool {
    const TRIED: [[f64; 3]; 7] = [
        [0.3, -0.3, 0.5],
        [-0.97, 0.97, 0.97],
        [0.97, 0.97, -0.97],
        [-0.97, -0.97, -0.97],
        [0.97, -0.97, 0.5],
        [-0.8, 0.0, 0.0],
        [0.0, 0.8, 0.0],
    ];
    TRIED.into_iter().all(|place| {
        let Some(truth) = exact(place) else { return false };
        let truth = PointCovariance::of(&truth, depth(place));
        let own = PointCovariance::of(&on_widest(Interpolate(own, place)), depth(place));
        let same = |a: f64, b: f64, scale: f64| a.is_nan() && b.is_nan() || (a - b).abs() <= scale;
        let [xx, _, _, yy, _, zz] = truth.covariance;
        // Of variances twice the share of deviations.
        let scales = [xx * xx, xx * yy, xx * zz, yy * yy, yy * zz, zz * zz];
        let variances = truth.covariance.into_iter().zip(own.covariance).zip(scales);
        variances.into_iter().all(|((a, b), scale)| same(a, b, 2.0 * TOLERANCE * scale.sqrt()))
            && same(
                truth.residual_sigma,
                own.residual_sigma,
                TOLERANCE * truth.residual_sigma.abs(),
            )
    })
}

impl PointCovariance {
    /// From a box's figures, at this depth.
    #[inline(always)]
    fn of(figures: &[f64; FIGURES], depth: f64) -> Self {
        let squared = depth * depth;
        let [xx, xy, xz, yy, yz, zz, residual_sigma, _] = *figures;
        let covariance = [xx, xy, xz, yy, yz, zz].map(|value| value * (squared * squared));
        Self { covariance, residual_sigma }
    }

    /// The figures of a covariance; `None` where a coordinate is known without error, or not at all.
    fn figures(
        covariance: &Matrix3<f64>,
        residual_sigma: f64,
        nearness: f64,
    ) -> Option<[f64; FIGURES]> {
        let sound = covariance.iter().all(|value| value.is_finite())
            && (0..3).all(|axis| covariance[(axis, axis)] > 0.0);
        let by = nearness.powi(4);
        let mut figures = [0.0; FIGURES];
        for (place, figure) in super::LOWER.into_iter().zip(&mut figures) {
            *figure = covariance[place] * by;
        }
        figures[6] = residual_sigma;
        sound.then_some(figures)
    }
}
