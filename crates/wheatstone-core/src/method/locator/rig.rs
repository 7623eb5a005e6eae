//! Cameras made ready for many points: where their rays meet, a block at a time in vector registers.

use super::{
    chebyshev_undistortion::ChebyshevUndistortion,
    plan::{FormulaCameras, Formulas, PlacedCamera},
    undistortion_table::{COEFFICIENTS, Part},
    undistortion_tiles::UndistortionTiles,
};
use crate::{
    geometry::{
        Pixel, PixelColumns,
        batch_triangulation::{
            ALONG, BENT, Cameras, PLAIN, Polynomials, RayPolynomial, RayPolynomials, SCALED,
            StraightCamera, Triangulated, propagate,
        },
    },
    method::PixelNoise,
};
use rayon::prelude::*;
use wheatstone_numeric::{
    aligned::ask_ahead,
    number::{Doubles, Number, Pair, registers, registers_mut},
    simd::{Simd, WithSimd, on_widest},
};

/// Points worked on at once: their numbers stay in the nearest cache.
const BLOCK: usize = 128;

/// Cameras with their lenses in patches.
pub(super) struct Rig<'a> {
    pub(super) cameras: Vec<PlacedCamera<'a>>,
    straight: Cameras,
    /// What they are where they are formulas, and how pixels scatter about each.
    formulas: Option<(Formulas, Vec<&'a PixelNoise>)>,
    /// None for cameras without a lens.
    pub(super) patches: Vec<Option<UndistortionTiles>>,
    /// For each camera the part of the picture that was last tried, and the sheet over it.
    sheets: Vec<Option<(Part, Option<ChebyshevUndistortion>)>>,
}

/// Where the figures of points go, column by column, those that are wanted; not numbers where the rays'
/// intersection is not known.
pub(super) struct BatchOutputs<'p> {
    pub(super) point: Option<[&'p mut [f64]; 3]>,
    /// Root mean square over pixel coordinates.
    pub(super) residual: &'p mut [f64],
    /// To the first camera.
    pub(super) nearness: &'p mut [f64],
}

impl<'a> Rig<'a> {
    pub(super) fn new(cameras: Vec<PlacedCamera<'a>>) -> Self {
        let patches = |camera: &PlacedCamera| {
            camera.projection_fns.is_some().then(|| UndistortionTiles::new(camera))
        };
        Self {
            straight: straight(&cameras),
            formulas: None,
            patches: cameras.iter().map(patches).collect(),
            sheets: cameras.iter().map(|_| None).collect(),
            cameras,
        }
    }

    /// Of cameras that are formulas.
    pub(super) fn of_formulas(given: FormulaCameras<'a>) -> Self {
        Self { formulas: Some((given.formulas, given.noise)), ..Self::new(given.placed) }
    }

    /// Where points are.
    pub(super) fn meet(&self, pixels: &PixelColumns, met: BatchOutputs) {
        if pixels.cameras().len() == self.cameras.len() && self.cameras.len() <= MOST_CAMERAS {
            on_widest(Pass { rig: self, pixels, met });
        } else {
            met.residual.fill(f64::NAN);
        }
    }

    /// How sure points are, where cameras say that themselves: covariances, and what residuals to expect.
    pub(super) fn covariance(
        &self,
        (pixels, points): (&PixelColumns, [&[f64]; 3]),
        covariance: &mut [&mut [f64]; 6],
        residual_sigma: &mut [f64],
    ) {
        let Some((formulas, noise)) = &self.formulas else { return };
        let variances =
            noise.iter().zip(pixels.cameras()).map(|(noise, seen)| noise.variances(*seen));
        let variances: Vec<Vec<f64>> = variances.collect();
        if variances.len() != noise.len() {
            return;
        }
        let at = (points, variances.as_slice());
        match formulas {
            Formulas::Matrices(matrices) => propagate(matrices, at, covariance, residual_sigma),
            Formulas::Polynomials(polynomials) => {
                propagate(polynomials, at, covariance, residual_sigma);
            }
        }
    }

    /// Whether cameras say themselves how sure points are.
    pub(super) fn knows_covariance(&self) -> bool {
        self.formulas.is_some()
    }

    /// Makes sheets over where there are patches.
    pub(super) fn cover(&mut self) {
        let lenses = self.cameras.iter().zip(&self.patches);
        for ((camera, patches), sheet) in lenses.zip(&mut self.sheets) {
            let covered = patches.as_ref().and_then(UndistortionTiles::covered);
            let tried = sheet.as_ref().map(|(part, _)| *part);
            if let (Some(part), true) = (covered, covered != tried) {
                *sheet = Some((part, ChebyshevUndistortion::new(camera, part)));
            }
        }
    }

    /// Makes sheets over the parts of the pictures that pixels lie in and a little beyond, and patches where a sheet
    /// does not follow a camera: once and for all.
    pub(super) fn settle(&mut self, shown: &PixelColumns) {
        let seen = self.cameras.iter().zip(shown.cameras());
        let lenses = seen.zip(&mut self.patches).zip(&mut self.sheets);
        for (((camera, seen), patches), sheet) in lenses {
            let Some((patches, part)) = patches.as_mut().zip(Part::around(*seen)) else { continue };
            let slots = patches.over(part);
            let touched = slots.iter().map(|slot| patches.part(*slot)).reduce(Part::with);
            let whole = touched
                .and_then(|part| Some((part, Some(ChebyshevUndistortion::new(camera, part)?))));
            if whole.is_some() {
                *sheet = whole;
                continue;
            }
            let made = slots.par_iter().map(|slot| patches.make(camera, *slot));
            let made: Vec<_> = made.collect();
            slots.into_iter().zip(made).for_each(|(slot, made)| patches.take(slot, made));
        }
        self.cover();
    }

    /// The patches that a point asks for and that are not made yet: camera and slot.
    pub(super) fn missing(
        &self,
        pixels: impl Iterator<Item = Option<Pixel>>,
    ) -> impl Iterator<Item = (usize, u32)> {
        let asked = self.patches.iter().zip(pixels).enumerate();
        asked.filter_map(|(camera, (patches, pixel))| {
            Some((camera, patches.as_ref()?.missing(pixel?)?))
        })
    }
}

/// Cameras by their projective ones.
fn straight(cameras: &[PlacedCamera]) -> Cameras {
    let straight = |camera: &PlacedCamera| {
        let row = |row: usize| [0, 1, 2, 3].map(|column| camera.projection.0[(row, column)]);
        StraightCamera {
            rows: [0, 1, 2].map(row),
            nearness: camera.nearness[0],
            weight: camera.weight,
            range: range(camera),
        }
    };
    Cameras::new(cameras.iter().map(straight).collect())
}

/// The nearness of points for which a camera's patches hold.
fn range(camera: &PlacedCamera) -> [f64; 2] {
    // UndistortionTiles are tried over the range itself; a parabola goes on a little beyond.
    const BEYOND: f64 = 1.2;
    let [middle, half] = camera.nearness;
    if camera.is_central {
        [0.0, f64::INFINITY]
    } else {
        [(middle - BEYOND * half).max(0.0), middle + BEYOND * half]
    }
}

/// One run through columns.
struct Pass<'a, 'p> {
    rig: &'a Rig<'a>,
    pixels: &'a PixelColumns<'a>,
    met: BatchOutputs<'p>,
}

/// More cameras than this are not made ready: nobody has them.
pub(super) const MOST_CAMERAS: usize = 32;

/// What is told of a block of points by one camera; as caches have their lines, or every second register would lie
/// across two of them.
#[derive(Clone)]
#[repr(align(64))]
struct RayCoefficients([[f64; BLOCK]; COEFFICIENTS]);

impl WithSimd for Pass<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rig, pixels, mut met } = self;
        // Cameras without a lens see a step on the plane as a step in the picture.
        let mut told = vec![RayCoefficients([[0.0; BLOCK]; COEFFICIENTS]); rig.cameras.len()];
        for RayCoefficients(told) in &mut told {
            (told[2], told[5]) = ([1.0; BLOCK], [1.0; BLOCK]);
        }
        let mut out = [[0.0; BLOCK]; 5];
        for start in (0..pixels.points()).step_by(BLOCK) {
            let length = BLOCK.min(pixels.points() - start);
            for (index, (RayCoefficients(told), [x, y])) in
                told.iter_mut().zip(pixels.cameras()).enumerate()
            {
                let (x, y) = (&x[start..start + length], &y[start..start + length]);
                ask_ahead(x);
                ask_ahead(y);
                look(simd, (rig, index), (x, y), told);
            }
            // Whole blocks are written where they belong, the last one by way of `out`.
            let mut columns = out.each_mut().map(|column| &mut column[..]);
            if length == BLOCK {
                for (column, own) in columns.iter_mut().zip(met.point.iter_mut().flatten()) {
                    *column = &mut own[start..start + length];
                    ask_ahead(column);
                }
                columns[3] = &mut met.residual[start..start + length];
                columns[4] = &mut met.nearness[start..start + length];
            }
            let lenses = || rig.cameras.iter().zip(&rig.patches).filter(|(_, lens)| lens.is_some());
            let lens = (told.as_slice(), columns);
            if lenses().any(|(camera, _)| !camera.is_central) {
                triangulate_block::<S, { SCALED | ALONG | BENT }>(simd, rig, lens);
            } else if lenses().next().is_some() {
                triangulate_block::<S, SCALED>(simd, rig, lens);
            } else {
                triangulate_block::<S, PLAIN>(simd, rig, lens);
            }
            if length < BLOCK {
                let points = met.point.iter_mut().flatten().zip(&out);
                let [.., residual, nearness] = &out;
                let rays = [(&mut met.residual, residual), (&mut met.nearness, nearness)];
                for (column, out) in points.chain(rays) {
                    column[start..start + length].copy_from_slice(&out[..length]);
                }
            }
        }
    }
}

/// Where the rays of a block of points meet.
#[inline(always)]
fn triangulate_block<S: Simd, const KIND: u8>(
    simd: S,
    rig: &Rig,
    (told, mut columns): (&[RayCoefficients], [&mut [f64]; 5]),
) {
    let zero = Doubles(simd, simd.splat_f64s(0.0));
    let share = zero.all(1.0 / (2 * rig.cameras.len()) as f64);
    // Two registers at a time: there is much that waits for one number.
    for group in (0..registers::<S>(columns[0]).len()).step_by(2) {
        let (told, zeros) = (Groups { simd, told, group }, Pair([zero, zero]));
        let mut met = rig.straight.meet::<_, KIND>(&told, zeros);
        if let (PLAIN, Some((Formulas::Polynomials(polynomials), _))) = (KIND, &rig.formulas) {
            met = refined(polynomials, &told, met);
        }
        let Triangulated { point: [x, y, z], squares, nearness } = met;
        let residual = (squares * Pair([share, share])).root();
        for (column, Pair(pair)) in columns.iter_mut().zip([x, y, z, residual, nearness]) {
            for (place, value) in registers_mut::<S>(column)[group..].iter_mut().zip(pair) {
                *place = value.1;
            }
        }
    }
}

/// Where polynomials have the points, a register at a time: they fill all registers.
#[inline(always)]
fn refined<S: Simd>(
    polynomials: &Polynomials,
    told: &Groups<S>,
    mut met: Triangulated<Pair<Doubles<S>>>,
) -> Triangulated<Pair<Doubles<S>>> {
    for place in 0..2 {
        let [Pair(x), Pair(y), Pair(z)] = met.point;
        let Pair(nearness) = met.nearness;
        let start = Triangulated {
            point: [x[place], y[place], z[place]],
            squares: nearness[place],
            nearness: nearness[place],
        };
        let found = polynomials.refine(&Half { told, place }, start);
        for (Pair(pair), value) in met.point.iter_mut().zip(found.point) {
            pair[place] = value;
        }
        met.squares.0[place] = found.squares;
    }
    met
}

/// Where the points of the first register or of the second are seen.
struct Half<'a, 'b, S> {
    told: &'a Groups<'b, S>,
    place: usize,
}

impl<S: Simd> RayPolynomials<Doubles<S>> for Half<'_, '_, S> {
    #[inline(always)]
    fn of(&self, camera: usize) -> RayPolynomial<Doubles<S>> {
        let (simd, place) = (self.told.simd, self.told.group + self.place);
        let zero = Doubles(simd, simd.splat_f64s(0.0));
        let mut at = [zero; 2];
        let RayCoefficients(told) = &self.told.told[camera];
        for (value, told) in at.iter_mut().zip(told) {
            value.1 = registers::<S>(told)[place];
        }
        RayPolynomial { at, along: [zero; 2], curvature: [zero; 2], scale: [zero; 4] }
    }
}

/// What is told of two registers full of points.
struct Groups<'a, S> {
    simd: S,
    told: &'a [RayCoefficients],
    group: usize,
}

impl<S: Simd> RayPolynomials<Pair<Doubles<S>>> for Groups<'_, S> {
    #[inline(always)]
    fn of(&self, camera: usize) -> RayPolynomial<Pair<Doubles<S>>> {
        let RayCoefficients(told) = &self.told[camera];
        let zero = Doubles(self.simd, self.simd.splat_f64s(0.0));
        let mut all = [Pair([zero, zero]); COEFFICIENTS];
        for (told, pair) in told.iter().zip(&mut all) {
            for (register, place) in registers::<S>(told)[self.group..].iter().zip(&mut pair.0) {
                place.1 = *register;
            }
        }
        let [x, y, a, b, c, d, along_x, along_y, curvature_x, curvature_y] = all;
        RayPolynomial {
            at: [x, y],
            along: [along_x, along_y],
            curvature: [curvature_x, curvature_y],
            scale: [a, b, c, d],
        }
    }
}

/// Where a camera's pixels look.
#[inline(always)]
fn look<S: Simd>(
    simd: S,
    (rig, index): (&Rig, usize),
    (x, y): (&[f64], &[f64]),
    told: &mut [[f64; BLOCK]; COEFFICIENTS],
) {
    let sheet = rig.sheets[index].as_ref().and_then(|(_, sheet)| sheet.as_ref());
    match &rig.patches[index] {
        None => {
            told[0][..x.len()].copy_from_slice(x);
            told[1][..y.len()].copy_from_slice(y);
        }
        Some(patches) if rig.cameras[index].is_central => {
            look_through::<S, false>(simd, (patches, sheet), [x, y], told);
        }
        Some(patches) => look_through::<S, true>(simd, (patches, sheet), [x, y], told),
    }
}

/// Where a camera with a lens looks: by its sheet, and by its patches where that does not reach.
#[inline(always)]
fn look_through<S: Simd, const CURVED: bool>(
    simd: S,
    (patches, sheet): (&UndistortionTiles, Option<&ChebyshevUndistortion>),
    [x, y]: [&[f64]; 2],
    told: &mut [[f64; BLOCK]; COEFFICIENTS],
) {
    if let Some(sheet) = sheet {
        sheet.tell::<S, BLOCK, CURVED>(simd, [x, y], told);
        let mut all = true;
        for (x, y) in x.iter().zip(y) {
            all &= sheet.holds(*x, *y);
        }
        if all {
            return;
        }
    }
    for (lane, (x, y)) in x.iter().zip(y).enumerate() {
        if sheet.is_none_or(|sheet| !sheet.holds(*x, *y)) {
            patches.look::<S, BLOCK, CURVED>(simd, (*x, *y, lane), told);
        }
    }
}
