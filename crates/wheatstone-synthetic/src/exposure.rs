//! From light to grey levels: how bright the room is over the picture, and what the sensor adds.

use wheatstone_charts::imaging::GrayImage;
use wheatstone_numeric::random::Random;

/// How the camera and the room spoil the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Standard deviation of the lens's blur, in pixels.
    pub blur: f64,
    /// Standard deviation of the read-out noise, in grey levels of 255.
    pub read_noise: f64,
    /// Variance of the shot noise a grey level.
    pub shot_noise: f64,
    /// Loss of light in the corners, 0 to 1.
    pub vignetting: f64,
    /// How much brighter one side of the room is than the other, 0 to 1.
    pub uneven_light: f64,
    /// Whether there is anything behind the chart.
    pub clutter: bool,
}

impl Default for Sensor {
    /// A machine-vision camera in a room with a window: focused, a little noisy.
    fn default() -> Self {
        Self {
            blur: 0.7,
            read_noise: 1.5,
            shot_noise: 0.02,
            vignetting: 0.25,
            uneven_light: 0.3,
            clutter: true,
        }
    }
}

/// Light over the picture, 1 on average.
#[derive(Clone, Debug)]
pub struct Light {
    centre: [f64; 2],
    slope: [f64; 2],
    vignetting: f64,
}

impl Light {
    /// Over pictures of this size: the sensor's vignetting, and a window somewhere.
    #[must_use]
    pub fn new(width: usize, height: usize, sensor: Sensor, random: &mut Random) -> Self {
        let centre = [width as f64 / 2.0, height as f64 / 2.0];
        let angle = random.uniform(0.0, std::f64::consts::TAU);
        let strength = sensor.uneven_light / 2.0;
        Self {
            centre,
            slope: [strength * libm::cos(angle), strength * libm::sin(angle)],
            vignetting: sensor.vignetting,
        }
    }

    /// At a place of the picture, in pixels.
    #[must_use]
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let u = (x - self.centre[0]) / self.centre[0];
        let v = (y - self.centre[1]) / self.centre[1];
        let room = 1.0 + self.slope[0] * u + self.slope[1] * v;
        room * (1.0 - self.vignetting * (u * u + v * v) / 2.0)
    }
}

/// What the sensor makes of the light that its pixels collect, in grey levels: noise, and 8 bits.
#[must_use]
pub fn exposed(light: GrayImage, sensor: Sensor, random: &mut Random) -> GrayImage {
    let noisy: Vec<f32> = light
        .values()
        .iter()
        .map(|value| {
            let value = f64::from(*value);
            let variance = sensor.read_noise * sensor.read_noise + sensor.shot_noise * value;
            // Rounded by cutting off: what is below half a grey level is none.
            f32::from((value + variance.sqrt() * random.normal() + 0.5) as u8)
        })
        .collect();
    GrayImage::from_values(light.width(), light.height(), noisy).unwrap_or(light)
}
