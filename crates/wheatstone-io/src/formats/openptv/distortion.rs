//! OpenPTV's distortion, which is about the middle of the sensor, and Brown's, which is about the principal
//! point: each fitted to the other, all over the picture.
//!
//! Source: liboptv's `flat_to_dist` and `distort_brown_affin` (`trafo.c`). A shift of the centre of radial
//! distortion is, to first order, a tangential distortion: one form follows the other to hundredths of a
//! pixel, in the corners to a tenth, as long as the principal point is near the middle.

use crate::formats::Optics;
use wheatstone_core::{
    camera::{CameraModel, brown_conrady::BrownConrady, pinhole::Pinhole},
    geometry::{Point3, Pose},
};
use wheatstone_numeric::{
    levenberg_marquardt::{NormalEquations, Patience, minimise},
    progress::Silent,
};

/// A place on the plane z = 1, and the pixel that shows it.
type Sample = ([f64; 2], [f64; 2]);

/// Places along each side of the picture at which the two are compared.
const SIDE: usize = 21;

/// The two may differ by so many pixels at most, anywhere in the picture.
const MOST: f64 = 0.5;

/// The numbers of an `.ori` and an `.addpar` file that make a lens, with lengths on the sensor in focal
/// lengths cc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SensorLens {
    /// cc in pixels: along y, and along x where the scale is 1.
    pub(super) focal: f64,
    /// xh and yh, y up.
    pub(super) shift: [f64; 2],
    pub(super) radial: [f64; 3],
    pub(super) tangential: [f64; 2],
    /// scx.
    pub(super) scale: f64,
    /// The pixel at the middle of the sensor.
    pub(super) middle: [f64; 2],
}

impl SensorLens {
    fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (x, y) = (x + self.shift[0], self.shift[1] - y);
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let s = x * x + y * y;
        let factor = 1.0 + s * (k1 + s * (k2 + s * k3));
        let bent = [
            x * factor + p1 * (s + 2.0 * x * x) + 2.0 * p2 * x * y,
            y * factor + p2 * (s + 2.0 * y * y) + 2.0 * p1 * x * y,
        ];
        let [u, v] = self.middle;
        [u + self.scale * self.focal * bent[0], v - self.focal * bent[1]]
    }

    fn of_numbers(numbers: &[f64; 9], middle: [f64; 2]) -> Self {
        let [focal, xh, yh, k1, k2, k3, p1, p2, scale] = *numbers;
        Self { focal, shift: [xh, yh], radial: [k1, k2, k3], tangential: [p1, p2], scale, middle }
    }

    /// The lens about the middle of the sensor that is Brown's, and how far its pixels are off; `None` where none
    /// is near.
    pub(super) fn of(lens: &BrownConrady, size: [u32; 2]) -> Option<(Self, Vec<f64>)> {
        let middle = size.map(|side| f64::from(side) / 2.0 - 0.5);
        let Pinhole { focal: [fx, fy], principal } = lens.pinhole;
        let shift = [(principal[0] - middle[0]) / fx, (middle[1] - principal[1]) / fy];
        let ([k1, k2, k3], [p1, p2]) = (lens.radial, lens.tangential);
        // Brown's y goes down: the tangential terms change places, and one its sign.
        let start =
            [fy, shift[0], shift[1], k1, k2, k3, p2 - k1 * shift[0], -p1 - k1 * shift[1], fx / fy];
        let bent = |place| brown_pixel(lens, place);
        let seen = samples(bent, lens.pinhole, size);
        let (numbers, off) =
            follow(start, &seen, &|numbers, place| Self::of_numbers(numbers, middle).pixel(place))?;
        Some((Self::of_numbers(&numbers, middle), off))
    }

    /// Brown's lens that is this one; `None` where none is near.
    pub(super) fn brown(&self, size: [u32; 2], camera_from_world: Pose) -> Option<Optics> {
        let [x, y] = self.shift;
        let pinhole = Pinhole {
            focal: [self.scale * self.focal, self.focal],
            principal: [
                self.middle[0] + self.scale * self.focal * x,
                self.middle[1] - self.focal * y,
            ],
        };
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let start = [
            pinhole.focal[0],
            pinhole.focal[1],
            pinhole.principal[0],
            pinhole.principal[1],
            k1,
            k2,
            -p2 - k1 * y,
            p1 + k1 * x,
            k3,
        ];
        let of = |numbers: &[f64; 9]| {
            let pinhole =
                Pinhole { focal: [numbers[0], numbers[1]], principal: [numbers[2], numbers[3]] };
            Optics::brown(pinhole, &numbers[4..], camera_from_world)
        };
        let is_straight = self.radial == [0.0; 3] && self.tangential == [0.0; 2];
        if is_straight || self.shift == [0.0; 2] {
            return of(&start);
        }
        let pixel = |numbers: &[f64; 9], place| match of(numbers) {
            Some(Optics::Brown(camera)) => brown_pixel(&camera.model, place),
            _ => [f64::NAN; 2],
        };
        let seen = samples(|place| self.pixel(place), pinhole, size);
        of(&follow(start, &seen, &pixel)?.0)
    }
}

fn brown_pixel(lens: &BrownConrady, [x, y]: [f64; 2]) -> [f64; 2] {
    lens.project(Point3::new(x, y, 1.0)).map_or([f64::NAN; 2], Into::into)
}

/// Places all over the picture, and a little beyond, with their pixels.
fn samples(
    pixel: impl Fn([f64; 2]) -> [f64; 2],
    Pinhole { focal, principal }: Pinhole,
    size: [u32; 2],
) -> Vec<Sample> {
    // Barrel distortion shows more than its pinhole would.
    const BEYOND: f64 = 1.3;
    let at = |axis: usize, index: usize| {
        let share = index as f64 / (SIDE - 1) as f64 - 0.5;
        let middle = f64::from(size[axis]) / 2.0 - principal[axis];
        (middle + BEYOND * share * f64::from(size[axis])) / focal[axis]
    };
    let places = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
    let seen = places.map(|(column, row)| {
        let place = [at(0, column), at(1, row)];
        (place, pixel(place))
    });
    let inside = |(_, pixel): &Sample| {
        (0..2).all(|axis| (-0.5..f64::from(size[axis]) - 0.5).contains(&pixel[axis]))
    };
    seen.filter(inside).collect()
}

/// The pixel at which a lens of so many numbers shows a place.
type PixelOf<'a> = &'a dyn Fn(&[f64; 9], [f64; 2]) -> [f64; 2];

/// The numbers with which `pixel` shows the places nearest to where they were seen, and how far its pixels are off.
fn follow(start: [f64; 9], seen: &[Sample], pixel: PixelOf) -> Option<([f64; 9], Vec<f64>)> {
    const PATIENCE: Patience = Patience { steps: 50, least_gain: 1e-14 };
    if seen.len() < 20 {
        return None;
    }
    let evaluate = |numbers: &[f64], normal: &mut NormalEquations| {
        let numbers: [f64; 9] = numbers.try_into().ok()?;
        let mut cost = 0.0;
        for (place, truth) in seen {
            let [u, v] = pixel(&numbers, *place);
            let mut slopes = [[0.0; 9]; 2];
            for number in 0..9 {
                let step = 1e-6 * numbers[number].abs().max(1e-2);
                let mut moved = numbers;
                moved[number] += step;
                let ahead = pixel(&moved, *place);
                slopes[0][number] = (ahead[0] - u) / step;
                slopes[1][number] = (ahead[1] - v) / step;
            }
            let off = [u - truth[0], v - truth[1]];
            normal.add_pixel([&slopes[0], &slopes[1]], off);
            cost += 0.5 * (off[0] * off[0] + off[1] * off[1]);
        }
        cost.is_finite().then_some(cost)
    };
    let found = minimise(&start, PATIENCE, &Silent, evaluate).ok()?;
    let numbers: [f64; 9] = found.parameters.try_into().ok()?;
    let distance = |(place, truth): &Sample| {
        let at = pixel(&numbers, *place);
        libm::hypot(at[0] - truth[0], at[1] - truth[1])
    };
    let distances: Vec<f64> = seen.iter().map(distance).collect();
    distances.iter().all(|distance| *distance < MOST).then_some((numbers, distances))
}
