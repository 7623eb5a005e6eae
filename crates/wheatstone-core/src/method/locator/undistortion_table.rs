//! What tables of a camera's rays hold: where a pixel looks, and how that changes with depth.

use super::plan::PlacedCamera;
use crate::geometry::Pixel;

/// A patch that is further from the camera than this somewhere, in pixels, is not used: a tenth of what
/// the best detectors scatter by in a hundred points.
pub(super) const TOLERANCE: f64 = 1e-4;

/// Numbers that a patch tells of a point: where it looks, u and v; pixels by steps on the plane, four; how
/// u and v go with the nearness, and with its square.
pub(super) const COEFFICIENTS: usize = 10;

/// Where the scale stands among what is told: pixels by steps on the plane, x by u, x by v, y by u, y by v.
pub(super) const SCALES: [usize; 4] = [2, 3, 4, 5];

/// Places on the plane that a patch tells: at, along and curvature, of u and v each.
pub(super) const PLACES: usize = 6;

/// Part of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    pub(super) least: [f64; 2],
    pub(super) most: [f64; 2],
}

impl Part {
    /// What holds all of some places, and a twentieth of its width more on each side; `None` of no places.
    pub(super) fn around([x, y]: [&[f64]; 2]) -> Option<Self> {
        const MORE: f64 = 0.05;
        let seen = x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite());
        let places = seen.map(|(x, y)| Self { least: [*x, *y], most: [*x, *y] });
        let own = places.reduce(Self::with)?;
        let more = [0, 1].map(|axis| MORE * (own.most[axis] - own.least[axis]));
        Some(Self {
            least: [0, 1].map(|axis| own.least[axis] - more[axis]),
            most: [0, 1].map(|axis| own.most[axis] + more[axis]),
        })
    }

    /// What holds both.
    pub(super) fn with(self, other: Self) -> Self {
        Self {
            least: [0, 1].map(|axis| self.least[axis].min(other.least[axis])),
            most: [0, 1].map(|axis| self.most[axis].max(other.most[axis])),
        }
    }

    /// Whether a place lies in it.
    #[inline(always)]
    pub(super) fn holds(&self, x: f64, y: f64) -> bool {
        let [left, top] = self.least;
        let [right, bottom] = self.most;
        // Without branches: a block of places is looked at in registers.
        (x >= left) & (x <= right) & (y >= top) & (y <= bottom)
    }

    /// Where it lies from -1 to 1 in each direction.
    pub(super) fn pixel(&self, place: [f64; 2]) -> Pixel {
        let along = |axis: usize| {
            let (least, most) = (self.least[axis], self.most[axis]);
            0.5 * (least + most) + 0.5 * (most - least) * place[axis]
        };
        Pixel::new(along(0), along(1))
    }
}

/// Where a pixel looks: at, along and curvature on the plane.
pub(super) fn told(camera: &PlacedCamera, pixel: Pixel) -> Option<[f64; PLACES]> {
    let [middle, half] = camera.nearness;
    let at = camera.plane_of(pixel, middle)?;
    if camera.is_central {
        return Some([at[0], at[1], 0.0, 0.0, 0.0, 0.0]);
    }
    let near = camera.plane_of(pixel, middle + half)?;
    let far = camera.plane_of(pixel, middle - half)?;
    let mut told = [0.0; PLACES];
    for axis in 0..2 {
        // The parabola through three points, in powers of the nearness.
        let slope = (near[axis] - far[axis]) / (2.0 * half);
        let curvature = (near[axis] + far[axis] - 2.0 * at[axis]) / (2.0 * half * half);
        told[axis] = at[axis] - middle * (slope - middle * curvature);
        told[2 + axis] = slope - 2.0 * middle * curvature;
        told[4 + axis] = curvature;
    }
    Some(told)
}
