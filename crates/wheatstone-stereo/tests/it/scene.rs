//! Rendered pairs whose disparities are known exactly: a slanted plane, and another in front of it.

use std::ops::Range;
use wheatstone_stereo::{DisparityMap, EpipolarCurves, Matcher, Picture};

/// Samples of a pixel along each axis.
const SAMPLES: usize = 4;

/// disparity = at_origin + along x + down y + bend (squared distance from (160, 120)) / 2, in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    pub(crate) at_origin: f64,
    pub(crate) along: f64,
    pub(crate) down: f64,
    pub(crate) bend: f64,
}

impl Plane {
    pub(crate) fn disparity(&self, x: f64, y: f64) -> f64 {
        let squared = (x - 160.0).powi(2) + (y - 120.0).powi(2);
        self.at_origin + self.along * x + self.down * y + 0.5 * self.bend * squared
    }

    /// Where the left picture shows what the right one shows at x.
    fn left_of(&self, x: f64, y: f64) -> f64 {
        let mut left = (x + self.at_origin + self.down * y) / (1.0 - self.along);
        // Disparities of what is curved here change by less than a third of a pixel per pixel.
        for _ in 0..if self.bend == 0.0 { 0 } else { 30 } {
            left = x + self.disparity(left, y);
        }
        left
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) back: Plane,
    /// The plane in front, and the columns and rows of the left picture that it covers.
    pub(crate) front: Option<(Plane, [f64; 4])>,
    /// The contrast of the texture, in grey levels.
    pub(crate) contrast: f64,
    /// The standard deviation of noise, in grey levels.
    pub(crate) noise: f64,
    pub(crate) seed: u64,
    /// How much lower the right picture shows what the left one shows at (x, y) with disparity d, in pixels.
    pub(crate) lower: fn(f64, f64, f64) -> f64,
}

/// Two pictures of a scene.
pub(crate) struct Pair {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) left: Vec<u8>,
    pub(crate) right: Vec<u8>,
}

impl Pair {
    pub(crate) fn compute(&self, matcher: &Matcher) -> DisparityMap {
        let picture = |pixels| Picture::new(self.width, self.height, pixels).unwrap();
        matcher.compute(&picture(&self.left), &picture(&self.right)).unwrap()
    }

    pub(crate) fn compute_along(&self, matcher: &Matcher, curves: &EpipolarCurves) -> DisparityMap {
        let picture = |pixels| Picture::new(self.width, self.height, pixels).unwrap();
        let (left, right) = (picture(&self.left), picture(&self.right));
        matcher.compute_along(&left, &right, curves).unwrap()
    }
}

impl Pair {
    /// The means of four neighbours each: both pictures half a pixel farther right and down.
    pub(crate) fn between_pixels(&self) -> Self {
        let (width, height) = (self.width - 1, self.height - 1);
        let mean = |picture: &[u8]| -> Vec<u8> {
            let of = |at: usize| {
                let first = at / width * self.width + at % width;
                let four =
                    [0, 1, self.width, self.width + 1].map(|k| u32::from(picture[first + k]));
                ((four.iter().sum::<u32>() + 2) / 4) as u8
            };
            (0..width * height).map(of).collect()
        };
        Self { width, height, left: mean(&self.left), right: mean(&self.right) }
    }
}

impl Scene {
    pub(crate) fn slanted(along: f64, down: f64, seed: u64) -> Self {
        let back = Plane { at_origin: 20.0, along, down, bend: 0.0 };
        Self {
            width: 320,
            height: 240,
            back,
            front: None,
            contrast: 30.0,
            noise: 1.5,
            seed,
            lower: |_, _, _| 0.0,
        }
    }

    /// The curves of [`Scene::lower`].
    pub(crate) fn curves(&self, range: Range<i32>) -> EpipolarCurves {
        let v = |x: f32, y: f32, d: f32| (self.lower)(x.into(), y.into(), d.into()) as f32;
        EpipolarCurves::new((self.width, self.height), range, |x, y, d| Some(v(x, y, d))).unwrap()
    }

    /// The plane that the left picture shows at a place.
    fn at(&self, x: f64, y: f64) -> Plane {
        match self.front {
            Some((plane, area)) if covers(area, x, y) => plane,
            _ => self.back,
        }
    }

    pub(crate) fn disparity(&self, x: f64, y: f64) -> f64 {
        self.at(x, y).disparity(x, y)
    }

    /// Whether the right picture shows what the left one shows here.
    pub(crate) fn is_seen_by_both(&self, x: f64, y: f64) -> bool {
        let there = x - self.disparity(x, y);
        let hidden = self.front.is_some_and(|(plane, area)| {
            !covers(area, x, y) && covers(area, plane.left_of(there, y), y)
        });
        (0.0..self.width as f64).contains(&there) && !hidden
    }

    fn left_brightness(&self, x: f64, y: f64) -> f64 {
        let is_front = self.front.is_some_and(|(_, area)| covers(area, x, y));
        self.texture(x, y, is_front)
    }

    fn right_brightness(&self, x: f64, y: f64) -> f64 {
        if let Some((plane, area)) = self.front {
            let (left, row) = self.left_of(&plane, x, y);
            if covers(area, left, row) {
                return self.texture(left, row, true);
            }
        }
        let (left, row) = self.left_of(&self.back, x, y);
        self.texture(left, row, false)
    }

    /// Where the left picture shows what the right one shows of a plane at a place.
    fn left_of(&self, plane: &Plane, x: f64, y: f64) -> (f64, f64) {
        let mut row = y;
        // Curves change by less than a tenth of a pixel per pixel.
        for _ in 0..6 {
            let left = plane.left_of(x, row);
            row = y - (self.lower)(left, row, plane.disparity(left, row));
        }
        (plane.left_of(x, row), row)
    }

    fn texture(&self, x: f64, y: f64, is_front: bool) -> f64 {
        let seed = 2 * self.seed + u64::from(is_front);
        let octaves = [3.0, 6.0, 13.0].map(|size| smooth_noise(x / size, y / size, seed));
        128.0 + self.contrast * octaves.iter().sum::<f64>()
    }

    pub(crate) fn render(&self) -> Pair {
        let mut random = Random(self.seed.wrapping_mul(77) + 5);
        let mut picture = |brightness: &dyn Fn(f64, f64) -> f64| -> Vec<u8> {
            let offset = |k: usize| (k as f64 + 0.5) / SAMPLES as f64 - 0.5;
            let pixel = |at: usize| {
                let (x, y) = ((at % self.width) as f64, (at / self.width) as f64);
                let samples = (0..SAMPLES * SAMPLES)
                    .map(|k| brightness(x + offset(k % SAMPLES), y + offset(k / SAMPLES)));
                samples.sum::<f64>() / (SAMPLES * SAMPLES) as f64
            };
            (0..self.width * self.height)
                .map(|at| (pixel(at) + self.noise * random.normal()).round() as u8)
                .collect()
        };
        let left = picture(&|x, y| self.left_brightness(x, y));
        let right = picture(&|x, y| self.right_brightness(x, y));
        Pair { width: self.width, height: self.height, left, right }
    }
}

fn covers([from, to, top, bottom]: [f64; 4], x: f64, y: f64) -> bool {
    (from..to).contains(&x) && (top..bottom).contains(&y)
}

/// Random numbers on a lattice, between them by cubic steps; about -1 to 1.
fn smooth_noise(x: f64, y: f64, seed: u64) -> f64 {
    let (column, row) = (x.floor(), y.floor());
    let step = |t: f64| t * t * (3.0 - 2.0 * t);
    let (u, v) = (step(x - column), step(y - row));
    let corner = |right: f64, down: f64| {
        let place = ((column + right) as i64 as u64) << 32 ^ ((row + down) as i64 as u64);
        Random(place.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ seed).uniform() * 2.0 - 1.0
    };
    let (above, below) = ([corner(0., 0.), corner(1., 0.)], [corner(0., 1.), corner(1., 1.)]);
    let across = |[a, b]: [f64; 2]| a + u * (b - a);
    across(above) + v * (across(below) - across(above))
}

/// SplitMix64 (Steele, Lea and Flood 2014, doi:10.1145/2714064.2660195).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// As good as normal: the sum of twelve.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    pub(crate) fn byte(&mut self) -> u8 {
        (self.uniform() * 256.0) as u8
    }
}
