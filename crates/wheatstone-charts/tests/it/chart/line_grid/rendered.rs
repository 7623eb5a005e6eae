//! Pictures of grids whose truth is known.

use rayon::prelude::*;
use wheatstone_charts::{
    chart::{Chart, line_grid::LineGrid},
    imaging::{GrayImage, filter::gaussian_blur},
};
use wheatstone_core::geometry::{Pixel, Point3, Pose, Vector3};
use wheatstone_numeric::random::Random;

/// How a grid is seen.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    pub(super) chart: LineGrid,
    pub(super) size: (usize, usize),
    pub(super) focal: f64,
    /// Brown's first radial coefficient.
    pub(super) k1: f64,
    /// Pitch in pixels at the chart's centre, before tilt.
    pub(super) pitch: f64,
    /// Turn in the picture, in radians.
    pub(super) turn: f64,
    /// Tilt away from the camera, about an axis at this turn; both in radians.
    pub(super) tilt: (f64, f64),
    /// Where the chart's centre is, in pixels from the picture's.
    pub(super) shift: (f64, f64),
    /// Grey levels of lines and ground.
    pub(super) grey: (f64, f64),
    /// Standard deviation in grey levels.
    pub(super) noise: f64,
    pub(super) blur: f64,
    pub(super) clutter: bool,
    /// Lines end at the outermost crossings.
    pub(super) cut: bool,
    /// Amplitude of a smooth warp, in pixels.
    pub(super) warp: f64,
    pub(super) seed: u64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            chart: LineGrid { columns: 9, rows: 7, pitch: 1.0, ..LineGrid::default() },
            size: (640, 480),
            focal: 700.0,
            k1: 0.0,
            pitch: 40.0,
            turn: 0.1,
            tilt: (0.3, 0.5),
            shift: (3.3, -2.1),
            grey: (35.0, 205.0),
            noise: 2.0,
            blur: 0.7,
            clutter: true,
            cut: false,
            warp: 0.0,
            seed: 1,
        }
    }
}

impl Scene {
    fn pose(&self) -> Pose {
        let turn = nalgebra::Rotation3::new(Vector3::new(0.0, 0.0, self.turn));
        let axis = Vector3::new(libm::cos(self.tilt.1), libm::sin(self.tilt.1), 0.0);
        let tilt = nalgebra::Rotation3::new(axis * self.tilt.0);
        let depth = self.focal / self.pitch * self.chart.pitch;
        let translation = Vector3::new(
            self.shift.0 * depth / self.focal,
            self.shift.1 * depth / self.focal,
            depth,
        );
        Pose { rotation: (tilt * turn).into(), translation }
    }

    fn warped(&self, p: Pixel) -> Pixel {
        let (u, v) = (p.x / 60.0, p.y / 75.0);
        p + nalgebra::Vector2::new(libm::sin(v + 1.0), libm::sin(u)) * self.warp
    }

    fn project(&self, point: Point3) -> Pixel {
        let p = self.pose().transform(point);
        let (x, y) = (p.x / p.z, p.y / p.z);
        let radial = 1.0 + self.k1 * (x * x + y * y);
        self.warped(Pixel::new(
            self.focal * x * radial + self.size.0 as f64 / 2.0,
            self.focal * y * radial + self.size.1 as f64 / 2.0,
        ))
    }

    /// Where each crossing is.
    pub(super) fn truth(&self) -> Vec<Pixel> {
        self.chart.points().into_iter().map(|point| self.project(point)).collect()
    }

    fn on_chart(&self, pixel: Pixel) -> Option<[f64; 2]> {
        let mut flat = pixel;
        for _ in 0..if self.warp > 0.0 { 12 } else { 0 } {
            flat -= self.warped(flat) - pixel;
        }
        let (xd, yd) = (
            (flat.x - self.size.0 as f64 / 2.0) / self.focal,
            (flat.y - self.size.1 as f64 / 2.0) / self.focal,
        );
        let (mut x, mut y) = (xd, yd);
        for _ in 0..if self.k1 == 0.0 { 0 } else { 12 } {
            let radial = 1.0 + self.k1 * (x * x + y * y);
            (x, y) = (xd / radial, yd / radial);
        }
        let pose = self.pose().inverse();
        let origin = pose.transform(Point3::origin());
        let direction = pose.rotation * Vector3::new(x, y, 1.0);
        let distance = -origin.z / direction.z;
        let place = origin + direction * distance;
        (distance > 0.0).then_some([place.x, place.y])
    }

    fn reflectance(&self, place: [f64; 2], size: [f64; 2]) -> Option<f64> {
        let value = self.chart.reflectance(place, size)?;
        let half =
            |count: usize| ((count - 1) as f64 + self.chart.line_width) / 2.0 * self.chart.pitch;
        let outside =
            place[0].abs() > half(self.chart.columns) || place[1].abs() > half(self.chart.rows);
        Some(if self.cut && outside { 1.0 } else { value })
    }

    /// The picture. A lens blurs before pixels gather light, so the blur acts on a finer raster.
    pub(super) fn render(&self) -> GrayImage {
        const SUB: usize = 3;
        let (width, height) = self.size;
        let behind = clutter(self.size, self.seed);
        let footprint = [self.chart.pitch / self.pitch / SUB as f64; 2];
        let shade = |index: usize| {
            let (x, y) = (index % (width * SUB), index / (width * SUB));
            let place = |i: usize| (i as f64 + 0.5) / SUB as f64 - 0.5;
            let seen = self
                .on_chart(Pixel::new(place(x), place(y)))
                .and_then(|place| self.reflectance(place, footprint));
            let ground = if self.clutter {
                behind.at((x / SUB) as isize, (y / SUB) as isize)
            } else {
                128.0
            };
            let value =
                seen.map_or(f64::from(ground), |s| self.grey.0 + (self.grey.1 - self.grey.0) * s);
            let (u, v) = (place(x) / width as f64 - 0.5, place(y) / height as f64 - 0.5);
            (value * (1.0 - 0.6 * (u * u + v * v) + 0.25 * u - 0.1 * v)) as f32
        };
        let values: Vec<f32> = (0..width * height * SUB * SUB).into_par_iter().map(shade).collect();
        let fine = GrayImage::from_values(width * SUB, height * SUB, values).unwrap();
        let fine = gaussian_blur(&fine, self.blur * SUB as f64);
        let mut random = Random::new(self.seed);
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let rows = (y * SUB..(y + 1) * SUB).map(|y| &fine.row(y)[x * SUB..(x + 1) * SUB]);
                let mean = rows.flatten().sum::<f32>() / (SUB * SUB) as f32;
                let noisy = f64::from(mean) + self.noise * random.normal();
                values.push(noisy.round().clamp(0.0, 255.0) as f32);
            }
        }
        GrayImage::from_values(width, height, values).unwrap()
    }
}

/// Boxes, discs and bars of any grey.
pub(super) fn clutter((width, height): (usize, usize), seed: u64) -> GrayImage {
    let mut random = Random::stream(seed, 9);
    let mut values = vec![110.0_f32; width * height];
    let largest = width.max(height) as f64 / 5.0;
    for shape in 0..160 {
        let (cx, cy) = (random.uniform(0.0, width as f64), random.uniform(0.0, height as f64));
        let (a, b) = (random.uniform(1.5, largest), random.uniform(1.5, largest));
        let (b, grey) = (if shape % 3 == 0 { 2.0 } else { b }, random.uniform(10.0, 245.0) as f32);
        let angle = random.uniform(0.0, 3.2);
        let (cosine, sine) = (libm::cos(angle), libm::sin(angle));
        let reach = a + b;
        for y in (cy - reach).max(0.0) as usize..((cy + reach) as usize).min(height) {
            for x in (cx - reach).max(0.0) as usize..((cx + reach) as usize).min(width) {
                let (dx, dy) = (x as f64 - cx, y as f64 - cy);
                let (u, v) = ((dx * cosine + dy * sine) / a, (dy * cosine - dx * sine) / b);
                let inside = if shape % 2 == 0 { u.abs().max(v.abs()) } else { u * u + v * v };
                if inside < 1.0 {
                    values[y * width + x] = grey;
                }
            }
        }
    }
    GrayImage::from_values(width, height, values).unwrap()
}
