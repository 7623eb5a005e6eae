//! Pictures of a chart, as a camera takes them: light, lens blur, vignetting, sensor noise, 8 bits,
//! and things in the background that are no chart.

use super::exposure::{Light, Sensor, exposed};
use rayon::prelude::*;
use wheatstone_charts::{
    chart::AnyChart,
    imaging::{GrayImage, filter::gaussian_blur},
};
use wheatstone_core::{
    camera::PosedCamera,
    geometry::{Pixel, Pose},
};
use wheatstone_numeric::random::Random;

/// Parts along each side of a pixel. The lens blurs the light before the pixels collect it, so the
/// picture is blurred in these parts: blurred as pixels, thin lines would move by 0.06 px.
const PARTS: usize = 2;

/// Samples along each side of a part. Each is itself averaged over its share of the part, so that
/// edges are placed to a thousandth of a pixel.
const SAMPLES: usize = 2;

/// Grey levels of black ink and of the white board in full light, below saturation even where
/// light and noise add up.
pub(crate) const BLACK: f64 = 30.0;
pub(crate) const WHITE: f64 = 195.0;

/// Takes a picture of a chart at `world_from_chart`.
#[must_use]
pub fn render(
    camera: &PosedCamera,
    chart: &AnyChart,
    world_from_chart: &Pose,
    sensor: Sensor,
    random: &mut Random,
) -> GrayImage {
    let (width, height) = (camera.width * PARTS, camera.height * PARTS);
    let background = Background::new(camera.width, camera.height, random);
    let light = Light::new(camera.width, camera.height, sensor, random);
    let corners = corners_on_chart(camera, world_from_chart);
    let rows: Vec<Vec<f32>> = (0..height)
        .into_par_iter()
        .map(|y| {
            let part = |x: usize| {
                let nodes =
                    [0, 1, width + 1, width + 2].map(|step| corners[y * (width + 1) + x + step]);
                let pixel = [x, y].map(|part| (part as f64 + 0.5) / PARTS as f64 - 0.5);
                let reflected = board_and_beyond(chart, nodes, || {
                    if sensor.clutter { background.at(pixel[0], pixel[1]) } else { 0.4 }
                });
                let lit = BLACK + (WHITE - BLACK) * reflected;
                (lit * light.at(pixel[0], pixel[1])) as f32
            };
            (0..width).map(part).collect()
        })
        .collect();
    let sharp = GrayImage::from_fn(width, height, |x, y| rows[y][x]);
    let blurred = gaussian_blur(&sharp, sensor.blur * PARTS as f64);
    exposed(collected(&blurred, PARTS), sensor, random)
}

/// What each pixel collects: the mean of its parts, so many along each side.
pub(crate) fn collected(parts: &GrayImage, along: usize) -> GrayImage {
    let share = 1.0 / (along * along) as f32;
    GrayImage::from_fn(parts.width() / along, parts.height() / along, |x, y| {
        let row = |dy: usize| &parts.row(y * along + dy)[x * along..(x + 1) * along];
        (0..along).map(|dy| row(dy).iter().sum::<f32>()).sum::<f32>() * share
    })
}

/// Where each corner of each part of a pixel looks on the chart's plane, row by row.
fn corners_on_chart(camera: &PosedCamera, world_from_chart: &Pose) -> Vec<Option<[f64; 2]>> {
    let chart_from_world = world_from_chart.inverse();
    let (width, height) = (camera.width * PARTS + 1, camera.height * PARTS + 1);
    let at = |index: usize| {
        let [x, y] =
            [index % width, index / width].map(|corner| corner as f64 / PARTS as f64 - 0.5);
        let ray = camera.ray(Pixel::new(x, y))?;
        let ray = ray.transformed(&chart_from_world);
        let distance = -ray.origin.z / ray.direction.z;
        let place = ray.at(distance);
        (distance > 0.0 && place.coords.norm() < 1e9).then_some([place.x, place.y])
    };
    (0..width * height).into_par_iter().map(at).collect()
}

/// Mean light that a part of a pixel gets from the chart, or from what lies behind where the chart is not.
fn board_and_beyond(
    chart: &AnyChart,
    nodes: [Option<[f64; 2]>; 4],
    beyond: impl Fn() -> f64,
) -> f64 {
    let [Some(top_left), Some(top_right), Some(low_left), Some(low_right)] = nodes else {
        return beyond();
    };
    let nodes = [top_left, top_right, low_left, low_right];
    let [left, top, right, bottom] = chart.board();
    let (low, high) = ([left, top], [right, bottom]);
    let off = |axis: usize| {
        nodes.iter().all(|n| n[axis] < low[axis]) || nodes.iter().all(|n| n[axis] > high[axis])
    };
    if off(0) || off(1) {
        return beyond();
    }
    let share = 1.0 / SAMPLES as f64;
    // The box on the chart that a sample covers: as wide as the sample's parallelogram is spread.
    let extent = |axis: usize| {
        let across = top_right[axis] - top_left[axis];
        let down = low_left[axis] - top_left[axis];
        (across * across + down * down).sqrt() * share
    };
    let size = [extent(0), extent(1)];
    let mut sum = 0.0;
    for sample in 0..SAMPLES * SAMPLES {
        let u = ((sample % SAMPLES) as f64 + 0.5) * share;
        let v = ((sample / SAMPLES) as f64 + 0.5) * share;
        let between = |axis: usize| {
            let upper = top_left[axis] + (top_right[axis] - top_left[axis]) * u;
            let lower = low_left[axis] + (low_right[axis] - low_left[axis]) * u;
            upper + (lower - upper) * v
        };
        sum += chart.reflectance([between(0), between(1)], size).unwrap_or_else(&beyond);
    }
    sum * share * share
}

/// Boxes, bars and a gradient: what stands about in a room.
struct Background {
    shade: [f64; 3],
    /// Left, top, right, bottom, shade.
    boxes: Vec<[f64; 5]>,
}

impl Background {
    fn new(width: usize, height: usize, random: &mut Random) -> Self {
        let (width, height) = (width as f64, height as f64);
        let shade = [
            random.uniform(0.2, 0.6),
            random.uniform(-0.2, 0.2) / width,
            random.uniform(-0.2, 0.2) / height,
        ];
        let boxes = (0..40)
            .map(|index| {
                let (x, y) = (random.uniform(0.0, width), random.uniform(0.0, height));
                // Every third is a bar as thin as a chart's line.
                let (wide, high) = match index % 6 {
                    0 => (random.uniform(2.0, 6.0), random.uniform(60.0, 240.0)),
                    3 => (random.uniform(60.0, 240.0), random.uniform(2.0, 6.0)),
                    _ => (random.uniform(10.0, 90.0), random.uniform(10.0, 90.0)),
                };
                [
                    x - wide / 2.0,
                    y - high / 2.0,
                    x + wide / 2.0,
                    y + high / 2.0,
                    random.uniform(0.0, 1.0),
                ]
            })
            .collect();
        Self { shade, boxes }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let inside = |b: &&[f64; 5]| x >= b[0] && y >= b[1] && x < b[2] && y < b[3];
        match self.boxes.iter().rev().find(inside) {
            Some(found) => found[4],
            None => self.shade[0] + self.shade[1] * x + self.shade[2] * y,
        }
    }
}
