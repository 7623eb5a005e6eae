//! What a camera's lens does, in patches over the picture: where a pixel looks, as a cubic of its place
//! in the patch.
//!
//! A patch is made by itself, from the camera alone, when pixels ask for it; it is used only where it
//! says what the camera says.

use super::{
    plan::PlacedCamera,
    undistortion_table::{COEFFICIENTS, PLACES, Part, TOLERANCE, told},
};
use crate::geometry::Pixel;
use nalgebra::Matrix4;
use std::f64::consts::FRAC_PI_8;
use wheatstone_numeric::simd::{Real, Simd};

/// UndistortionTiles along each side of the picture that can be told apart; the outermost are never made, for they
/// get what lies beyond.
const SIDE: usize = 256;

/// UndistortionTiles before pixel 0: pictures may be cut so that pixels are negative.
const BEFORE: f64 = 64.0;

/// A patch takes at most this angle, in radians: a cubic then follows a lens to a millionth of a pixel,
/// and a correction by waves of a sixth of the picture to a ten thousandth.
const WIDTH: f64 = 0.05;

/// Places of a pixel worked out for a patch.
pub(super) const NODES: usize = 16;

/// Factors of a power of x, in single precision: over a patch they amount to less than a twentieth, of which
/// single precision errs by a thousandth of what a patch may.
const FACTORS: usize = 16;

/// The factors by the power of x.
type Rows = [[f32; FACTORS]; 4];

/// One patch; as the nearest cache has its lines.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Tile {
    /// Of u and v, four powers of y; of the scale, four numbers without and four with y.
    rows: Rows,
    /// Where the patch's middle looks, in full.
    middle: [f64; 2],
    /// Of along and of curvature as of u and v; nothing for a camera whose rays meet in its centre.
    curvatures: Rows,
}

/// Where the factors of a place stand: u or v, and the power of y. Pairs of u and v, so that both are summed
/// at once.
const fn lane(axis: usize, power: usize) -> usize {
    2 * power + axis
}

/// Where the factors of curvature begin.
const CURVATURE: usize = 8;

/// Where the factors of the scale begin, and those of its products with y.
const SCALE: [usize; 2] = [8, 12];

/// A camera's patches.
pub(super) struct UndistortionTiles {
    /// UndistortionTiles a pixel.
    density: f64,
    /// Which patch is where: 0 for one that is not made yet, 1 for one that cannot be.
    index: Vec<u32>,
    patches: Vec<Tile>,
    /// What holds all of them.
    covered: Option<Part>,
}

/// A pixel in its patch.
#[derive(Clone, Copy)]
struct Place {
    slot: usize,
    x: f64,
    y: f64,
}

impl UndistortionTiles {
    pub(super) fn new(camera: &PlacedCamera) -> Self {
        let exponent = libm::floor(libm::log2(f64::max(WIDTH * camera.focal, 1.0)));
        let none = Tile {
            rows: [[f32::NAN; FACTORS]; 4],
            middle: [f64::NAN; 2],
            curvatures: [[f32::NAN; FACTORS]; 4],
        };
        Self {
            density: 1.0 / libm::exp2(exponent),
            index: vec![0; SIDE * SIDE],
            patches: vec![none.clone(), none],
            covered: None,
        }
    }

    #[inline(always)]
    fn place(&self, x: f64, y: f64) -> Place {
        let along = |value: f64| (value * self.density + BEFORE).max(0.0).min(SIDE as f64 - 0.5);
        let (x, y) = (along(x), along(y));
        let (column, row) = (x as u32, y as u32);
        Place {
            slot: row as usize * SIDE + column as usize,
            x: 2.0 * (x - f64::from(column)) - 1.0,
            y: 2.0 * (y - f64::from(row)) - 1.0,
        }
    }

    /// Notes what is told of a pixel as that of the point `lane`; not numbers where no patch tells it. Of
    /// a camera whose rays meet in its centre the last four are left as they are.
    #[inline(always)]
    pub(super) fn look<S: Simd, const B: usize, const CURVED: bool>(
        &self,
        simd: S,
        (x, y, lane): (f64, f64, usize),
        told: &mut [[f64; B]; COEFFICIENTS],
    ) {
        let at = self.place(x, y);
        let patch = &self.patches[self.index[at.slot] as usize];
        let (x, y) = (at.x as f32, at.y as f32);
        let sums = along(simd, &patch.rows, x);
        let seen = down(&sums, 0, y);
        for axis in 0..2 {
            told[axis][lane] = patch.middle[axis] + f64::from(seen[axis]);
        }
        for place in 0..4 {
            let scale = sums[SCALE[0] + place] + y * sums[SCALE[1] + place];
            told[2 + place][lane] = f64::from(scale);
        }
        if CURVED {
            let sums = along(simd, &patch.curvatures, x);
            let (along, curvature) = (down(&sums, 0, y), down(&sums, CURVATURE, y));
            for axis in 0..2 {
                told[6 + axis][lane] = f64::from(along[axis]);
                told[8 + axis][lane] = f64::from(curvature[axis]);
            }
        }
    }

    /// The patch that a pixel asks for, where it is not made yet.
    pub(super) fn missing(&self, pixel: Pixel) -> Option<u32> {
        let slot = self.place(pixel.x, pixel.y).slot;
        let inner = |cell: usize| (1..SIDE - 1).contains(&cell);
        let within = inner(slot % SIDE) && inner(slot / SIDE);
        let known = within && !pixel.x.is_nan() && !pixel.y.is_nan();
        (known && self.index[slot] == 0).then_some(slot as u32)
    }

    /// The part of the picture in which patches lie.
    pub(super) fn covered(&self) -> Option<Part> {
        self.covered
    }

    /// The slots that a part of the picture touches, but for the outermost.
    pub(super) fn over(&self, part: Part) -> Vec<u32> {
        let cell =
            |value: f64| (value * self.density + BEFORE).max(1.0).min((SIDE - 2) as f64) as usize;
        let along = |axis: usize| cell(part.least[axis])..=cell(part.most[axis]);
        let row = |row: usize| along(0).map(move |column| (row * SIDE + column) as u32);
        along(1).flat_map(row).collect()
    }

    /// The part of the picture that a slot is.
    pub(super) fn part(&self, slot: u32) -> Part {
        let [least, most] = [-1.0, 1.0].map(|end| self.pixel(slot as usize, end, end).into());
        Part { least, most }
    }

    /// Takes over what was made for a slot.
    pub(super) fn take(&mut self, slot: u32, made: BuiltTile) {
        let own = self.part(slot);
        self.index[slot as usize] = match made.0 {
            Some(patch) => {
                self.covered = Some(self.covered.map_or(own, |covered| covered.with(own)));
                self.patches.push(*patch);
                self.patches.len() as u32 - 1
            }
            None => 1,
        };
    }

    /// Makes the patch of a slot.
    pub(super) fn make(&self, camera: &PlacedCamera, slot: u32) -> BuiltTile {
        let made =
            self.patch(camera, slot as usize).filter(|patch| self.holds(camera, slot, patch));
        BuiltTile(made.map(Box::new))
    }

    /// A pixel by its place in a slot, each coordinate in -1..1.
    fn pixel(&self, slot: usize, x: f64, y: f64) -> Pixel {
        let along =
            |cell: usize, within: f64| (cell as f64 - BEFORE + 0.5 + 0.5 * within) / self.density;
        Pixel::new(along(slot % SIDE, x), along(slot / SIDE, y))
    }

    fn patch(&self, camera: &PlacedCamera, slot: usize) -> Option<Tile> {
        // Where Chebyshev's polynomial of degree four is 0: a cubic through these is nearly the best.
        let nodes = [7.0, 5.0, 3.0, 1.0].map(|odd| libm::cos(odd * FRAC_PI_8));
        let powers = Matrix4::from_fn(|row, column| nodes[row].powi(column as i32));
        let inverse = powers.try_inverse()?;
        let mut values = [Matrix4::zeros(); PLACES];
        for (i, x) in nodes.into_iter().enumerate() {
            for (j, y) in nodes.into_iter().enumerate() {
                let told = told(camera, self.pixel(slot, x, y))?;
                for (matrix, value) in values.iter_mut().zip(told) {
                    matrix[(i, j)] = value;
                }
            }
        }
        let mut middle = [0.0; 2];
        let mut patch =
            Tile { rows: [[0.0; FACTORS]; 4], middle: [0.0; 2], curvatures: [[0.0; FACTORS]; 4] };
        for (place, values) in values.iter().enumerate() {
            let mut factors = inverse * values * inverse.transpose();
            let (axis, rows) = (place % 2, patch.rows_of(place));
            if place < 2 {
                middle[axis] = factors[(0, 0)];
                factors[(0, 0)] = 0.0;
            }
            for (power, row) in rows.0.iter_mut().enumerate() {
                for (down, factor) in factors.row(power).iter().enumerate() {
                    row[rows.1 + lane(axis, down)] = *factor as f32;
                }
            }
        }
        patch.middle = middle;
        // Linear in the patch, from half-way to its borders.
        const AT: f64 = 0.5;
        let [right, left] = [AT, -AT].map(|x| self.scale(&patch, camera, [x, 0.0]));
        let [below, above] = [AT, -AT].map(|y| self.scale(&patch, camera, [0.0, y]));
        let (right, left, below, above) = (right?, left?, below?, above?);
        for place in 0..4 {
            let sum = right[place] + left[place] + below[place] + above[place];
            let [at, with_y] = SCALE.map(|first| first + place);
            patch.rows[0][at] = (sum / 4.0) as f32;
            patch.rows[1][at] = ((right[place] - left[place]) / (2.0 * AT)) as f32;
            patch.rows[0][with_y] = ((below[place] - above[place]) / (2.0 * AT)) as f32;
        }
        Some(patch)
    }

    /// Pixels by steps on the plane at a place of a patch, at the middle nearness.
    fn scale(&self, patch: &Tile, camera: &PlacedCamera, [x, y]: [f64; 2]) -> Option<[f64; 4]> {
        const STEP: f64 = 1e-3;
        let at = |x: f64, y: f64| patch.plane_at([x, y], camera.nearness[0]);
        let pixels = STEP / self.density;
        let across = [at(x + STEP, y), at(x - STEP, y)];
        let down = [at(x, y + STEP), at(x, y - STEP)];
        let slope = |pair: [[f64; 2]; 2], axis: usize| (pair[0][axis] - pair[1][axis]) / pixels;
        let [a, b] = [slope(across, 0), slope(down, 0)];
        let [c, d] = [slope(across, 1), slope(down, 1)];
        let determinant = a * d - b * c;
        let scale = [d, -b, -c, a].map(|value| value / determinant);
        scale.iter().all(|value| value.is_finite()).then_some(scale)
    }

    /// Whether a patch says what the camera says, where it is likely to be worst.
    fn holds(&self, camera: &PlacedCamera, slot: u32, patch: &Tile) -> bool {
        const TRIED: [[f64; 3]; 4] =
            [[0.0, 0.0, 0.5], [-0.97, 0.97, 1.0], [0.97, 0.6, -0.6], [0.6, -0.97, -1.0]];
        TRIED.into_iter().all(|[x, y, near]| {
            let [middle, half] = camera.nearness;
            let near = middle + near * half;
            let Some(truth) = camera.plane_of(self.pixel(slot as usize, x, y), near) else {
                return false;
            };
            let told = patch.plane_at([x, y], near);
            let (u, v) = (truth[0] - told[0], truth[1] - told[1]);
            let [a, b, c, d] = [0, 1, 2, 3].map(|place| f64::from(patch.rows[0][SCALE[0] + place]));
            let (across, down) = (a * u + b * v, c * u + d * v);
            (across * across + down * down).sqrt() < TOLERANCE
        })
    }
}

/// The sums over the powers of x.
#[inline(always)]
fn along<S: Simd>(simd: S, rows: &Rows, x: f32) -> [f32; FACTORS] {
    let mut sums = [0.0; FACTORS];
    let x = simd.splat_f32s(x);
    let [zeroth, first, second, third] = rows.each_ref().map(|row| f32::vectors::<S>(row));
    for (k, sum) in f32::vectors_mut::<S>(&mut sums).iter_mut().enumerate() {
        let high = simd.mul_add_f32s(third[k], x, second[k]);
        let middle = simd.mul_add_f32s(high, x, first[k]);
        *sum = simd.mul_add_f32s(middle, x, zeroth[k]);
    }
    sums
}

/// The sums over the powers of y, of u and v.
#[inline(always)]
fn down(sums: &[f32; FACTORS], first: usize, y: f32) -> [f32; 2] {
    let squared = y * y;
    let mut halves = [0.0; 4];
    for (k, half) in halves.iter_mut().enumerate() {
        *half = sums[first + k] + squared * sums[first + 4 + k];
    }
    [halves[0] + y * halves[2], halves[1] + y * halves[3]]
}

impl Tile {
    /// The factors among which those of a place stand, and from where on.
    fn rows_of(&mut self, place: usize) -> (&mut Rows, usize) {
        match place / 2 {
            0 => (&mut self.rows, 0),
            1 => (&mut self.curvatures, 0),
            _ => (&mut self.curvatures, CURVATURE),
        }
    }

    /// Where a place of the patch looks.
    fn plane_at(&self, [x, y]: [f64; 2], nearness: f64) -> [f64; 2] {
        let told = |rows: &Rows, first: usize, axis: usize| {
            let power = |power: usize| {
                let [a, b, c, d] =
                    [0, 1, 2, 3].map(|k| f64::from(rows[power][first + lane(axis, k)]));
                a + y * (b + y * (c + y * d))
            };
            power(0) + x * (power(1) + x * (power(2) + x * power(3)))
        };
        [0, 1].map(|axis| {
            let at = self.middle[axis] + told(&self.rows, 0, axis);
            let (along, curvature) =
                (told(&self.curvatures, 0, axis), told(&self.curvatures, CURVATURE, axis));
            at + nearness * (along + nearness * curvature)
        })
    }
}

/// A patch, where there can be one.
pub(super) struct BuiltTile(Option<Box<Tile>>);
