//! Pictures of a scene.

use super::Scene;
use crate::{
    exposure::{Light, Sensor, exposed},
    render::{BLACK, WHITE, collected},
};
use rayon::prelude::*;
use wheatstone_charts::imaging::{GrayImage, filter::gaussian_blur};
use wheatstone_core::{
    camera::PosedCamera,
    geometry::{Pixel, Ray},
};
use wheatstone_numeric::random::Random;

/// Samples along each side of a pixel. The texture's finest waves are about four pixels long; edges of
/// bodies are placed to a sixth of a pixel.
const PARTS: usize = 3;

impl Scene {
    /// Takes a picture of the scene: grey levels in 8 bits, of the camera's size. Where the camera sees
    /// nothing it is as dark as black ink. `random` draws how the room is lit, and the noise.
    #[must_use]
    pub fn render(&self, camera: &PosedCamera, sensor: Sensor, random: &mut Random) -> GrayImage {
        let light = Light::new(camera.width, camera.height, sensor, random);
        let corners = corners(camera);
        let (width, height) = (camera.width * PARTS, camera.height * PARTS);
        let mut values = vec![0.0_f32; width * height];
        values.par_chunks_mut(width).enumerate().for_each(|(part_y, row)| {
            for (part_x, value) in row.iter_mut().enumerate() {
                let [x, y] = [part_x, part_y].map(|part| (part as f64 + 0.5) / PARTS as f64);
                let ray = between(&corners, camera.width + 1, [x, y]);
                let returned = ray.map_or(0.0, |ray| self.returned(&ray));
                let lit = BLACK + (WHITE - BLACK) * returned;
                *value = (lit * light.at(x - 0.5, y - 0.5)) as f32;
            }
        });
        let sharp = GrayImage::from_fn(width, height, |x, y| values[y * width + x]);
        let blurred = gaussian_blur(&sharp, sensor.blur * PARTS as f64);
        exposed(collected(&blurred, PARTS), sensor, random)
    }
}

/// Where the corners of all pixels look, row by row, one more than there are pixels.
fn corners(camera: &PosedCamera) -> Vec<Option<Ray>> {
    let width = camera.width + 1;
    let ray = |index: usize| {
        let corner = [index % width, index / width].map(|corner| corner as f64 - 0.5);
        camera.ray(Pixel::from(corner))
    };
    (0..width * (camera.height + 1)).into_par_iter().map(ray).collect()
}

/// The ray of a place in pixels from the picture's upper left corner, between those of its pixel's corners:
/// a lens is so smooth that this is off by less than a thousandth of a pixel.
fn between(corners: &[Option<Ray>], width: usize, [x, y]: [f64; 2]) -> Option<Ray> {
    let (left, top) = (x as usize, y as usize);
    let (u, v) = (x - left as f64, y - top as f64);
    let ray = |across: usize, down: usize| corners[(top + down) * width + left + across];
    let rays = [ray(0, 0)?, ray(1, 0)?, ray(0, 1)?, ray(1, 1)?];
    let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
    let [first, ..] = rays;
    // Sums of differences, so that equal origins stay what they are.
    let mut ray = first;
    for (other, share) in rays.iter().zip(shares).skip(1) {
        ray.origin += (other.origin - first.origin) * share;
        ray.direction += (other.direction - first.direction) * share;
    }
    Some(ray)
}
