//! Any camera behind a lens or window with smooth local errors: a moulded lens, wavy glass.

use super::{AnyCamera, CameraModel, brown_conrady::BrownConrady};
use crate::geometry::{Pixel, Point3, Ray};
use serde::{Deserialize, Serialize};

/// A place where the picture is displaced.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// Its middle, in pixels.
    pub centre: [f64; 2],
    /// Standard deviation of its Gaussian profile, in pixels.
    pub radius: f64,
    /// Displacement in its middle, in pixels.
    pub shift: [f64; 2],
}

/// A camera whose picture is displaced by a sum of bumps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BumpedLens {
    /// The camera without bumps.
    pub camera: Box<AnyCamera>,
    /// The bumps, placed by where the pixels would be without them.
    pub bumps: Vec<Bump>,
}

impl Default for BumpedLens {
    fn default() -> Self {
        let bump = |x, y, radius, dx, dy| Bump { centre: [x, y], radius, shift: [dx, dy] };
        Self {
            camera: Box::new(BrownConrady::default().into()),
            bumps: vec![bump(200.0, 150.0, 80.0, 3.0, -2.0), bump(450.0, 330.0, 60.0, -2.0, 1.5)],
        }
    }
}

impl BumpedLens {
    fn displaced(&self, pixel: Pixel) -> Pixel {
        let shift = self.bumps.iter().fold([0.0, 0.0], |sum, bump| {
            let (dx, dy) = (pixel.x - bump.centre[0], pixel.y - bump.centre[1]);
            let height = libm::exp(-(dx * dx + dy * dy) / (2.0 * bump.radius * bump.radius));
            [sum[0] + bump.shift[0] * height, sum[1] + bump.shift[1] * height]
        });
        Pixel::new(pixel.x + shift[0], pixel.y + shift[1])
    }
}

impl CameraModel for BumpedLens {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.camera.parameters_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        self.camera.project(point).map(|pixel| self.displaced(pixel))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        // The bumps are gentle, so taking the displacement back repeatedly converges.
        let mut plain = pixel;
        for _ in 0..200 {
            let error = pixel - self.displaced(plain);
            plain += error;
            if error.norm() < 1e-12 {
                break;
            }
        }
        ((self.displaced(plain) - pixel).norm() < 1e-9).then(|| self.camera.ray(plain))?
    }
}
