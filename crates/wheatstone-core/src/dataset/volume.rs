//! The part of space, and of the pictures, that a dataset shows: whether a point lies within what a
//! fit was shown can be told from its pixels alone, whatever the method makes of them.
//!
//! Each camera's lens is straightened by a table of its own, rays are met, and where they meet is
//! compared with the convex hull of the points that each of the cameras was shown; what no rays meet,
//! or what lies outside the trained part of a picture, is outside as well. A method that wraps far
//! pixels back among its training points has no say in this.

mod columns;
mod hull;
mod straightened;

use super::Dataset;
use crate::geometry::{
    Pixel, Point3, Vector3,
    batch_triangulation::{self, Cameras, RayPolynomial},
};
use hull::Hull;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::fmt;
use straightened::Straightened;
use wheatstone_numeric::statistics::{median, percentile};

/// How far from what was trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trust {
    /// Within the hull of the training points.
    Inside,
    /// Beyond it by no more than a twentieth of its width.
    Edge,
    /// Further beyond, or not seen by two cameras that were trained.
    Outside,
}

impl fmt::Display for Trust {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inside => "inside",
            Self::Edge => "edge",
            Self::Outside => "outside",
        })
    }
}

/// What the cameras were shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Volume {
    /// Middle of the training points, in the world; what follows is relative to it.
    centre: Vector3,
    /// The parts of space that some camera was shown.
    hulls: Vec<Hull>,
    /// Each camera with the place of its hull; none where a camera saw too little to be placed.
    cameras: Vec<Option<Camera>>,
    /// The residual, in pixels, that nearly all training points stay below.
    residual: f64,
    /// By how much of a hull's width noise moves points of the hull's surface beyond it.
    noise: f64,
}

/// One camera's share in the volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    straightened: Straightened,
    hull: usize,
}

/// Beyond the hull by this share of its width is still its edge.
const EDGE: f64 = 0.05;

/// Where rays meet.
#[derive(Clone, Copy, Debug)]
struct Triangulated {
    /// Relative to the volume's centre.
    point: Vector3,
    /// Root mean square over pixel coordinates.
    residual: f64,
    /// The largest excess of a pixel over its camera's picture region, as a share of the width.
    beyond_region: f64,
}

impl Volume {
    /// The volume of the points whose place is known.
    #[must_use]
    pub fn of(data: &Dataset) -> Self {
        let count = data.known().count().max(1) as f64;
        let centre = data.known().fold(Vector3::zeros(), |sum, (p, _)| sum + p.coords) / count;
        let (mut hulls, mut shown): (Vec<Hull>, Vec<Vec<Vector3>>) = (Vec::new(), Vec::new());
        let mut cameras = Vec::with_capacity(data.cameras);
        for camera in 0..data.cameras {
            let pairs: Vec<(Point3, Pixel)> = data
                .seen_by_camera(camera)
                .into_iter()
                .map(|(world, pixel)| (world - centre, pixel))
                .collect();
            let points: Vec<Vector3> = pairs.iter().map(|(world, _)| world.coords).collect();
            let hull = shown.iter().position(|other| *other == points);
            let straightened = Straightened::fit(&pairs);
            cameras.push(match (straightened, hull) {
                (Some(straightened), Some(hull)) => Some(Camera { straightened, hull }),
                (Some(straightened), None) => Hull::of(&points).map(|own| {
                    hulls.push(own);
                    shown.push(points);
                    Camera { straightened, hull: hulls.len() - 1 }
                }),
                (None, _) => None,
            });
        }
        let mut volume = Self { centre, hulls, cameras, residual: 0.0, noise: 0.0 };
        volume.judge_noise(data);
        volume
    }

    /// Notes how far the training points' rays miss each other, and meet beyond the hull.
    fn judge_noise(&mut self, data: &Dataset) {
        // A chart at the end of its stage lies on the hull with all its points: of these, too, nearly
        // all are to be called inside. With gross errors among them half the edge is the most.
        const NEARLY_ALL: f64 = 0.975;
        let met: Vec<(f64, f64)> = data
            .known()
            .filter_map(|(_, row)| {
                let triangulated = self.meet(&row.pixels)?;
                Some((triangulated.residual, self.beyond_hulls(&row.pixels, &triangulated)))
            })
            .collect();
        let of = |which: fn(&(f64, f64)) -> f64| met.iter().map(which).collect::<Vec<_>>();
        // Three and a half times its median is what 98 % of a normal variable stay below.
        self.residual = 3.5 * median(&of(|met| met.0));
        self.noise = percentile(&of(|met| met.1), NEARLY_ALL).clamp(0.0, EDGE / 2.0);
    }

    /// How far beyond the hull of some camera that saw it a point lies, as a share of the width.
    fn beyond_hulls(&self, pixels: &[Option<Pixel>], triangulated: &Triangulated) -> f64 {
        let asked = |index: &usize| self.seen(pixels).any(|(camera, _)| camera.hull == *index);
        let hulls = (0..self.hulls.len()).filter(asked);
        let excess = hulls.map(|index| self.hulls[index].beyond(&triangulated.point));
        excess.fold(triangulated.beyond_region, f64::max)
    }

    /// Whether what the cameras saw at `pixels` (one entry a camera) lies where they were trained.
    #[must_use]
    pub fn trust(&self, pixels: &[Option<Pixel>]) -> Trust {
        let Some(triangulated) = self.meet(pixels) else { return Trust::Outside };
        let missed = triangulated.residual / (2.0 * self.believed_miss()) - 1.0;
        self.judged(missed.max(self.beyond_hulls(pixels, &triangulated) / EDGE))
    }

    /// The residual, in pixels, of points that are believed.
    fn believed_miss(&self) -> f64 {
        // Matches of natural texture miss by a pixel where a chart's crossings miss by a tenth, and
        // what they show is where it is all the same.
        const OFF_BY: f64 = 1.5;
        f64::max(self.residual, OFF_BY)
    }

    /// By how far a point lies beyond what was shown, as a share of what is still called an edge.
    fn judged(&self, beyond: f64) -> Trust {
        if beyond > 1.0 {
            Trust::Outside
        } else if beyond > self.noise / EDGE {
            Trust::Edge
        } else {
            Trust::Inside
        }
    }

    /// [`Volume::trust`] of many points, in parallel; the order is kept.
    #[must_use]
    pub fn trust_all(&self, pixels: &[Vec<Option<Pixel>>]) -> Vec<Trust> {
        // Points a task: large enough to pay for handing it over, small enough to balance.
        const TASK: usize = 256;
        let trust = |pixels: &Vec<Option<Pixel>>| self.trust(pixels);
        pixels.par_chunks(TASK).flat_map_iter(|chunk| chunk.iter().map(trust)).collect()
    }

    /// The trained cameras with the pixels that they saw.
    fn seen<'a>(
        &'a self,
        pixels: &'a [Option<Pixel>],
    ) -> impl Iterator<Item = (&'a Camera, Pixel)> + 'a {
        self.cameras.iter().zip(pixels).filter_map(|(c, p)| Some((c.as_ref()?, (*p)?)))
    }

    /// Where the rays of the trained cameras meet; `None` for fewer than two, or in front of none.
    fn meet(&self, pixels: &[Option<Pixel>]) -> Option<Triangulated> {
        let seen = || self.seen(pixels).take(MOST_CAMERAS);
        let cameras =
            Cameras::new(seen().map(|(camera, _)| camera.straightened.camera()).collect());
        if cameras.count() < 2 {
            return None;
        }
        let ray_polynomials: Vec<RayPolynomial<f64>> =
            seen().map(|(camera, pixel)| camera.straightened.see(pixel)).collect();
        let beyond_region = seen()
            .map(|(camera, pixel)| camera.straightened.trained().beyond([pixel.x, pixel.y]))
            .fold(f64::NEG_INFINITY, f64::max);
        let mut met = cameras.meet::<_, KIND>(&ray_polynomials[..], 0.0);
        if met.squares.is_nan() {
            met = cameras.triangulate_all::<KIND>(&ray_polynomials);
        }
        let residual = (met.squares / (2 * cameras.count()) as f64).sqrt();
        let point = Vector3::from(met.point);
        residual.is_finite().then_some(Triangulated { point, residual, beyond_region })
    }

    /// Whether the parts of a volume read from a file fit together.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let whole =
            |camera: &Camera| camera.hull < self.hulls.len() && camera.straightened.is_consistent();
        self.cameras.iter().flatten().all(whole)
            && self.hulls.iter().all(Hull::is_consistent)
            && self
                .centre
                .iter()
                .chain([&self.residual, &self.noise])
                .all(|value| value.is_finite())
    }

    /// How many cameras' pixels it takes.
    #[must_use]
    pub fn cameras(&self) -> usize {
        self.cameras.len()
    }
}

/// More cameras than this do not say more of where a point lies.
const MOST_CAMERAS: usize = 16;

/// What a straightened camera says of a point.
const KIND: u8 = batch_triangulation::ALONG;
