//! The texture of a scene: band-limited noise that fills space, so that a place of a surface has the
//! same brightness for every camera.
//!
//! Gradient noise after Perlin 2002, "Improving noise" (doi:10.1145/566570.566636).

use nalgebra::Matrix3;
use wheatstone_core::geometry::{Point3, Vector3};
use wheatstone_numeric::random::Random;

/// Width of the cells of each octave, in grains, and its share of the contrast. The noise's shortest
/// waves are about 1.5 cells long: 4 grains in the finest octave.
const OCTAVES: [(f64, f64); 5] = [(2.6, 1.0), (5.2, 1.0), (10.4, 0.9), (20.8, 0.8), (41.6, 0.6)];

/// Width of the cells in which the contrast changes, in grains.
const CONTRAST_CELLS: f64 = 70.0;

/// Least contrast, as a share of the full one.
const LEAST_CONTRAST: f64 = 0.12;

/// Standard deviation of the sum of all octaves, which texture is divided by: measured over 1e6
/// places. Noise of one octave has 0.27.
const DEVIATION: f64 = 0.53;

/// Noise in space: a sum of octaves, with a contrast that changes slowly.
#[derive(Clone, Debug)]
pub(super) struct Texture {
    octaves: Vec<(Octave, f64)>,
    contrast: Octave,
}

impl Texture {
    /// The texture whose finest detail is about four grains wide; `grain` is a length of the world.
    pub(super) fn new(grain: f64, random: &mut Random) -> Self {
        let octaves = OCTAVES
            .iter()
            .map(|(cells, share)| (Octave::new(cells * grain, random), *share))
            .collect();
        Self { octaves, contrast: Octave::new(CONTRAST_CELLS * grain, random) }
    }

    /// At a place of the world: mean 0 and, where contrast is full, standard deviation 1.
    pub(super) fn at(&self, place: Point3) -> f64 {
        let sum: f64 = self.octaves.iter().map(|(octave, share)| share * octave.at(place)).sum();
        let contrast = (0.9 + 1.7 * self.contrast.at(place)).clamp(LEAST_CONTRAST, 1.0);
        contrast * sum / DEVIATION
    }
}

/// Gradient noise of one width of cells.
#[derive(Clone, Debug)]
struct Octave {
    /// World to cells. Turned, each octave in its own way: along the lattice's axes the noise has zeros at
    /// equal distances, which would show on walls.
    cells_from_world: Matrix3<f64>,
    seed: u64,
}

impl Octave {
    fn new(width: f64, random: &mut Random) -> Self {
        let mut direction = || Vector3::from_fn(|_, _| random.normal());
        let first = direction().normalize();
        let second = first.cross(&direction()).normalize();
        let rows = [first, second, first.cross(&second)].map(|row| row.transpose());
        let seed = random.uniform(0.0, (1_u64 << 53) as f64) as u64;
        Self { cells_from_world: Matrix3::from_rows(&rows) / width, seed }
    }

    /// Between -1 and 1.
    fn at(&self, place: Point3) -> f64 {
        let place = self.cells_from_world * place.coords;
        let cell = place.map(f64::floor);
        let inside = place - cell;
        let shares = inside.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
        let cell = cell.map(|number| number as i64);
        let corner = |corner: usize| {
            let step = [corner & 1, (corner >> 1) & 1, corner >> 2];
            let hash = hash(self.seed, std::array::from_fn(|axis| cell[axis] + step[axis] as i64));
            let from_corner = inside - Vector3::from(step.map(|step| step as f64));
            along_gradient(hash, from_corner)
        };
        let between = |low: f64, high: f64, axis: usize| low + (high - low) * shares[axis];
        let row = |first: usize| between(corner(first), corner(first + 1), 0);
        let layer = |first: usize| between(row(first), row(first + 2), 1);
        between(layer(0), layer(4), 2)
    }
}

/// The product of a vector with one of the twelve directions to a cube's edges.
fn along_gradient(hash: u64, vector: Vector3) -> f64 {
    let sign = |bit: u64, value: f64| if hash & bit == 0 { value } else { -value };
    // The upper bits, scaled: three pairs of axes are no power of two.
    let (first, second) = match ((hash >> 32) * 3) >> 32 {
        0 => (vector.x, vector.y),
        1 => (vector.x, vector.z),
        _ => (vector.y, vector.z),
    };
    sign(1, first) + sign(2, second)
}

/// A number that looks random, of a corner of the lattice: the finaliser of SplitMix64 (Steele, Lea and
/// Flood 2014, doi:10.1145/2660193.2660195) over the coordinates, one after the other.
fn hash(seed: u64, corner: [i64; 3]) -> u64 {
    corner.into_iter().fold(seed, |state, coordinate| {
        let mut mixed = (state ^ coordinate as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_is_the_one_that_it_is_divided_by() {
        let mut random = Random::new(5);
        let octaves: Vec<_> =
            OCTAVES.map(|(width, share)| (Octave::new(width, &mut random), share)).into();
        let squares: Vec<f64> = (0..20_000)
            .map(|_| {
                let place = Point3::from(Vector3::from_fn(|_, _| random.uniform(-1e4, 1e4)));
                octaves.iter().map(|(octave, share)| share * octave.at(place)).sum::<f64>()
            })
            .map(|value| value * value)
            .collect();
        let deviation = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((deviation - DEVIATION).abs() < 0.02 * DEVIATION, "{deviation}");
    }

    #[test]
    fn noise_has_no_steps() {
        let octave = Octave::new(1.0, &mut Random::new(1));
        let mut random = Random::new(2);
        for _ in 0..2000 {
            let place = Point3::from(Vector3::from_fn(|_, _| random.uniform(-50.0, 50.0)));
            let step = octave.at(place + Vector3::new(1e-6, 0.0, 0.0)) - octave.at(place);
            // No slope of the noise is above 6 a cell.
            assert!(step.abs() < 6e-6, "{place}: {step}");
        }
    }
}
