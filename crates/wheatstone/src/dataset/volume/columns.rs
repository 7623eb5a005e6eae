//! The trust of many points, a register full at a time.

use super::{EDGE, MOST_CAMERAS, Trust, Volume};
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

/// Points looked up at once: their numbers stay in the nearest cache, and fill registers of any width.
const BLOCK: usize = 64;

/// What the table of a camera says of a block of points: at and along, x and y of each.
type Looked = [[f64; BLOCK]; 4];

/// Points of which all trained cameras saw each.
struct Block<'a> {
    volume: &'a Volume,
    cameras: &'a [StraightCamera],
    /// x and y of each point, a trained camera each.
    pixels: &'a [[[f64; BLOCK]; 2]],
    looked: &'a mut [Looked],
    /// What becomes known: by what share of the edge each point lies beyond what was shown.
    beyond: &'a mut [f64; BLOCK],
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { volume, cameras, pixels, looked, beyond } = self;
        let own = || volume.cameras.iter().flatten();
        for ((camera, [x, y]), looked) in own().zip(pixels).zip(looked.iter_mut()) {
            for lane in 0..BLOCK {
                let seen = camera.straightened.see(Pixel::new(x[lane], y[lane]));
                for axis in 0..2 {
                    looked[axis][lane] = seen.at[axis];
                    looked[2 + axis][lane] = seen.along[axis];
                }
            }
        }
        let zero = Doubles(simd, simd.splat_f64s(0.0));
        let one = zero.all(1.0);
        let plain = Sighting {
            at: [zero; 2],
            along: [zero; 2],
            bend: [zero; 2],
            scale: [one, zero, zero, one],
        };
        let mut seen = [plain; MOST_CAMERAS];
        let share = zero.all(1.0 / (2 * cameras.len()) as f64);
        let most = zero.all(1.0 / (2.0 * volume.believed_miss()));
        for (group, out) in registers_mut::<S>(beyond).iter_mut().enumerate() {
            let mut furthest = zero.all(f64::NEG_INFINITY);
            let each = own().zip(pixels).zip(looked.iter()).zip(&mut seen);
            for (((camera, [x, y]), looked), seen) in each {
                let take = |values: &[f64; BLOCK]| Doubles(simd, registers::<S>(values)[group]);
                seen.at = [take(&looked[0]), take(&looked[1])];
                seen.along = [take(&looked[2]), take(&looked[3])];
                furthest = camera.straightened.furthest([take(x), take(y)], furthest);
            }
            let met = meet(cameras, &seen[..cameras.len()], zero);
            for hull in &volume.hulls {
                furthest = hull.furthest(met.point, furthest);
            }
            let missed = (met.squares * share).root() * most - one;
            let beyond = missed.or_larger(furthest * zero.all(1.0 / EDGE));
            // What is not a number stays none.
            *out = (beyond + missed * zero).1;
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
        let cameras: Vec<StraightCamera> =
            self.cameras.iter().flatten().map(|camera| camera.straightened.camera()).collect();
        let mut looked = vec![[[0.0; BLOCK]; 4]; whole];
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
                cameras: &cameras,
                pixels: &lanes,
                looked: &mut looked,
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
