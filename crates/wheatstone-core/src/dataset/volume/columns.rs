//! The trust of many points, a register full at a time.

use super::{
    EDGE, KIND, MOST_CAMERAS, Trust, Volume,
    hull::{Hull, Planes},
    straightened::{Region, Straightened},
};
use crate::geometry::{
    PixelColumns,
    batch_triangulation::{Cameras, RayPolynomial, RayPolynomials},
};
use wheatstone_numeric::{
    number::{Doubles, Number, registers, registers_mut},
    simd::{Simd, WithSimd, on_widest},
};

/// Points looked up at once: their numbers stay in the nearest cache, and fill registers of any width.
const BLOCK: usize = 64;

/// What the table of a camera sums up to for a block of points.
type Sums = [[f64; BLOCK]; 4];

/// Points of which all trained cameras saw each.
struct Block<'a> {
    volume: &'a Volume,
    tables: &'a [&'a Straightened],
    /// What was shown: to each camera, and in space.
    regions: &'a [Region],
    hulls: &'a [Planes],
    cameras: &'a Cameras,
    /// x and y of each point, a trained camera each.
    pixels: &'a [[[f64; BLOCK]; 2]],
    sums: &'a mut [Sums],
    /// What becomes known: by what share of the edge each point lies beyond what was shown.
    beyond: &'a mut [f64; BLOCK],
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { volume, tables, regions, hulls, cameras, pixels, sums, beyond } = self;
        for ((table, pixels), sums) in tables.iter().zip(pixels).zip(sums.iter_mut()) {
            look(simd, table, pixels, sums);
        }
        let zero = Doubles(simd, simd.splat_f64s(0.0));
        let one = zero.all(1.0);
        let share = zero.all(1.0 / (2 * cameras.count()) as f64);
        let most = zero.all(1.0 / (2.0 * volume.believed_miss()));
        for (group, out) in registers_mut::<S>(beyond).iter_mut().enumerate() {
            let mut furthest = zero.all(f64::NEG_INFINITY);
            for (region, pixels) in regions.iter().zip(pixels) {
                furthest = region.beyond(lanes(simd, pixels, group)).max_with(furthest);
            }
            let seen = Batch { simd, tables, pixels, sums, group };
            let met = cameras.meet::<_, KIND>(&seen, zero);
            for hull in hulls {
                furthest = hull.beyond(met.point).max_with(furthest);
            }
            let missed = (met.squares * share).root() * most - one;
            let beyond = missed.max_with(furthest * zero.all(1.0 / EDGE));
            // What is not a number stays none.
            *out = (beyond + missed * zero).1;
        }
    }
}

/// A register full of each of some numbers of a block's points.
#[inline(always)]
fn lanes<S: Simd, const N: usize>(
    simd: S,
    values: &[[f64; BLOCK]; N],
    group: usize,
) -> [Doubles<S>; N] {
    let mut lanes = [Doubles(simd, simd.splat_f64s(0.0)); N];
    for (lane, values) in lanes.iter_mut().zip(values) {
        lane.1 = registers::<S>(values)[group];
    }
    lanes
}

/// What the trained cameras say of a register full of points.
struct Batch<'a, S> {
    simd: S,
    tables: &'a [&'a Straightened],
    pixels: &'a [[[f64; BLOCK]; 2]],
    sums: &'a [Sums],
    group: usize,
}

impl<S: Simd> RayPolynomials<Doubles<S>> for Batch<'_, S> {
    #[inline(always)]
    fn of(&self, camera: usize) -> RayPolynomial<Doubles<S>> {
        let pixel = lanes(self.simd, &self.pixels[camera], self.group);
        let sums = lanes(self.simd, &self.sums[camera], self.group);
        self.tables[camera].ray_polynomial(pixel, sums)
    }
}

/// Looks a block of points up in a camera's table: the places in registers, the sums one by one. (Closures over
/// registers would not become part of it, and cost more than all the rest.)
#[inline(always)]
fn look<S: Simd>(simd: S, camera: &Straightened, pixels: &[[f64; BLOCK]; 2], sums: &mut Sums) {
    // Added to a whole number it leaves that in the lowest bits.
    const PLACES: f64 = (1_u64 << 52) as f64;
    const LOWEST: u64 = 0xFFFF;
    let (mut begin, mut along_x, mut along_y) =
        ([PLACES; BLOCK], [[0.0; BLOCK]; 3], [[0.0; BLOCK]; 3]);
    for (group, out) in registers_mut::<S>(&mut begin).iter_mut().enumerate() {
        let x = Doubles(simd, registers::<S>(&pixels[0])[group]);
        let y = Doubles(simd, registers::<S>(&pixels[1])[group]);
        let ((column, own_x), (row, own_y)) = (camera.along_axis(0, x), camera.along_axis(1, y));
        for index in 0..3 {
            registers_mut::<S>(&mut along_x[index])[group] = own_x[index].1;
            registers_mut::<S>(&mut along_y[index])[group] = own_y[index].1;
        }
        *out = (Straightened::begin(column, row) + x.all(PLACES)).1;
    }
    // Each point's four sums stand together at first: they are added up in one register.
    let mut together = [[0.0; 4]; BLOCK];
    for (lane, together) in together.iter_mut().enumerate() {
        let x = [along_x[0][lane], along_x[1][lane], along_x[2][lane]];
        let y = [along_y[0][lane], along_y[1][lane], along_y[2][lane]];
        *together = camera.sums((begin[lane].to_bits() & LOWEST) as usize, [x, y]);
    }
    for (index, sums) in sums.iter_mut().enumerate() {
        for (sum, together) in sums.iter_mut().zip(&together) {
            *sum = together[index];
        }
    }
}

impl Volume {
    /// [`Volume::trust`] of each point.
    #[must_use]
    pub fn trust_columns(&self, pixels: &PixelColumns) -> Vec<Trust> {
        let count = pixels.points();
        let whole = self.cameras.iter().flatten().count();
        let single = |point: usize| self.trust(&pixels.point(point).collect::<Vec<_>>());
        if !(2..=MOST_CAMERAS).contains(&whole) || pixels.cameras().len() != self.cameras.len() {
            return (0..count).map(single).collect();
        }
        let trained = || self.cameras.iter().zip(pixels.cameras()).filter(|(c, _)| c.is_some());
        let tables: Vec<&Straightened> =
            self.cameras.iter().flatten().map(|camera| &camera.straightened).collect();
        let cameras = Cameras::new(tables.iter().map(|table| table.camera()).collect());
        let regions: Vec<Region> = tables.iter().map(|table| table.trained()).collect();
        let hulls: Vec<Planes> = self.hulls.iter().map(Hull::planes).collect();
        let mut sums = vec![[[0.0; BLOCK]; 4]; whole];
        let mut lanes = vec![[[0.0; BLOCK]; 2]; whole];
        let mut trust = Vec::with_capacity(count);
        for start in (0..count).step_by(BLOCK) {
            let length = BLOCK.min(count - start);
            for (lanes, (_, columns)) in lanes.iter_mut().zip(trained()) {
                for (lanes, column) in lanes.iter_mut().zip(columns) {
                    lanes[..length].copy_from_slice(&column[start..start + length]);
                }
            }
            let mut beyond = [f64::NAN; BLOCK];
            on_widest(Block {
                volume: self,
                tables: &tables,
                regions: &regions,
                hulls: &hulls,
                cameras: &cameras,
                pixels: &lanes,
                sums: &mut sums,
                beyond: &mut beyond,
            });
            trust.extend(beyond[..length].iter().enumerate().map(|(lane, beyond)| {
                // Not seen by all trained cameras, or met nowhere.
                if beyond.is_nan() { single(start + lane) } else { self.judged(*beyond) }
            }));
        }
        trust
    }
}
