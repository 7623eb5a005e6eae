//! Cameras made ready for many points: where their rays meet, a block at a time in vector registers.

use super::{
    patches::{Patches, TOLD},
    plan::PlacedCamera,
};
use crate::{
    geometry::{
        Pixel, PixelColumns,
        meeting::{Sighting, StraightCamera, meet},
    },
    numeric::{
        number::{Doubles, Number, registers, registers_mut},
        simd::{Simd, WithSimd, on_widest},
    },
};

/// Points worked on at once: their numbers stay in the nearest cache.
const BLOCK: usize = 64;

/// Cameras with their lenses in patches.
pub(super) struct Rig<'a> {
    pub(super) cameras: Vec<PlacedCamera<'a>>,
    straight: Vec<StraightCamera>,
    /// None for cameras without a lens.
    pub(super) patches: Vec<Option<Patches>>,
}

/// Where points are, column by column; not numbers where the rays' meeting is not known.
#[derive(Default)]
pub(super) struct Met {
    pub(super) point: [Vec<f64>; 3],
    /// Root mean square over pixel coordinates.
    pub(super) residual: Vec<f64>,
    /// To the first camera.
    pub(super) nearness: Vec<f64>,
}

impl Met {
    /// Nothing known of so many points.
    pub(super) fn none(count: usize) -> Self {
        let column = || vec![f64::NAN; count];
        Self { point: [column(), column(), column()], residual: column(), nearness: column() }
    }
}

impl<'a> Rig<'a> {
    pub(super) fn new(cameras: Vec<PlacedCamera<'a>>) -> Self {
        let straight = |camera: &PlacedCamera| {
            let row = |row: usize| [0, 1, 2, 3].map(|column| camera.projection.0[(row, column)]);
            StraightCamera {
                rows: [0, 1, 2].map(row),
                nearness: camera.nearness[0],
                weight: camera.weight,
                range: range(camera),
            }
        };
        let patches = |camera: &PlacedCamera| camera.sees.is_some().then(|| Patches::new(camera));
        Self {
            straight: cameras.iter().map(straight).collect(),
            patches: cameras.iter().map(patches).collect(),
            cameras,
        }
    }

    /// Where points are.
    pub(super) fn meet(&self, pixels: &PixelColumns) -> Met {
        let mut met = Met::none(pixels.points());
        if pixels.cameras().len() == self.cameras.len() && self.cameras.len() <= MOST_CAMERAS {
            on_widest(Meeting { rig: self, pixels, met: &mut met });
        }
        met
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

/// The nearness of points for which a camera's patches hold.
fn range(camera: &PlacedCamera) -> [f64; 2] {
    // Patches are tried over the range itself; a parabola goes on a little beyond.
    const BEYOND: f64 = 1.2;
    let [middle, half] = camera.nearness;
    if camera.is_central {
        [0.0, f64::INFINITY]
    } else {
        [(middle - BEYOND * half).max(0.0), middle + BEYOND * half]
    }
}

/// One run through columns.
struct Meeting<'a, 'b> {
    rig: &'a Rig<'a>,
    pixels: &'a PixelColumns<'a>,
    met: &'b mut Met,
}

/// More cameras than this are not made ready: nobody has them.
pub(super) const MOST_CAMERAS: usize = 32;

/// What is told of a block of points by one camera.
type Told = [[f64; BLOCK]; TOLD];

impl WithSimd for Meeting<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rig, pixels, met } = self;
        // Cameras without a lens see a step on the plane as a step in the picture.
        let mut told: Vec<Told> = vec![[[0.0; BLOCK]; TOLD]; rig.cameras.len()];
        for told in &mut told {
            (told[2], told[5]) = ([1.0; BLOCK], [1.0; BLOCK]);
        }
        let zero = Doubles(simd, simd.splat_f64s(0.0));
        let mut seen = [blind(zero); MOST_CAMERAS];
        let seen = &mut seen[..rig.cameras.len().min(MOST_CAMERAS)];
        let share = zero.all(1.0 / (2 * rig.cameras.len()) as f64);
        let mut out = [[0.0; BLOCK]; 5];
        for start in (0..pixels.points()).step_by(BLOCK) {
            let length = BLOCK.min(pixels.points() - start);
            for (index, (told, [x, y])) in told.iter_mut().zip(pixels.cameras()).enumerate() {
                look(
                    simd,
                    (rig, index),
                    (&x[start..start + length], &y[start..start + length]),
                    told,
                );
            }
            let groups = registers::<S>(&out[0]).len();
            for group in 0..groups {
                for (seen, told) in seen.iter_mut().zip(&told) {
                    *seen = sighting(simd, told, group);
                }
                let found = meet(&rig.straight, seen, zero);
                let residual = (found.squares * share).root();
                let [x, y, z] = found.point;
                for (column, value) in out.iter_mut().zip([x, y, z, residual, found.nearness]) {
                    registers_mut::<S>(column)[group] = value.1;
                }
            }
            let columns = met.point.iter_mut().chain([&mut met.residual, &mut met.nearness]);
            for (column, out) in columns.zip(&out) {
                column[start..start + length].copy_from_slice(&out[..length]);
            }
        }
    }
}

/// Of a camera that has said nothing yet.
#[inline(always)]
fn blind<N: Number>(zero: N) -> Sighting<N> {
    Sighting { at: [zero; 2], along: [zero; 2], bend: [zero; 2], scale: [zero; 4] }
}

/// What is told of a register full of points.
#[inline(always)]
fn sighting<S: Simd>(simd: S, told: &Told, group: usize) -> Sighting<Doubles<S>> {
    let mut seen = blind(Doubles(simd, simd.splat_f64s(0.0)));
    for axis in 0..2 {
        seen.at[axis].1 = registers::<S>(&told[axis])[group];
        seen.along[axis].1 = registers::<S>(&told[6 + axis])[group];
        seen.bend[axis].1 = registers::<S>(&told[8 + axis])[group];
    }
    for place in 0..4 {
        seen.scale[place].1 = registers::<S>(&told[2 + place])[group];
    }
    seen
}

/// Where a camera's pixels look.
#[inline(always)]
fn look<S: Simd>(simd: S, (rig, index): (&Rig, usize), (x, y): (&[f64], &[f64]), told: &mut Told) {
    match &rig.patches[index] {
        None => {
            told[0][..x.len()].copy_from_slice(x);
            told[1][..y.len()].copy_from_slice(y);
        }
        Some(patches) if rig.cameras[index].is_central => {
            for (lane, (x, y)) in x.iter().zip(y).enumerate() {
                patches.look::<S, BLOCK, false>(simd, (*x, *y, lane), told);
            }
        }
        Some(patches) => {
            for (lane, (x, y)) in x.iter().zip(y).enumerate() {
                patches.look::<S, BLOCK, true>(simd, (*x, *y, lane), told);
            }
        }
    }
}
