//! What a page of points is made of.

use crate::plot::space::{Frustum, corners};
use serde::{Deserialize, Serialize};
use wheatstone_core::geometry::{Pixel, Point3, Vector3};
use wheatstone_numeric::random::Random;

/// A camera of a [`SceneCloud`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudCamera {
    /// Its name.
    pub name: String,
    /// Its centre in the world, in the unit of the points, where it is known.
    pub centre: Option<[f64; 3]>,
    /// Unit vectors, in the world, in which the corners of its picture look: top left, top right,
    /// bottom right, bottom left. Their mean is where the camera looks, so each has to be less than a right angle from
    /// it. Empty where they are not known.
    pub corners: Vec<[f64; 3]>,
}

impl CloudCamera {
    /// A camera whose pixels look where `look` says. `area` is left, top, right and bottom of its picture, in pixels. Corners that look
    /// more than 65 degrees from the middle are drawn there.
    #[must_use]
    pub fn looking(
        name: String,
        centre: Option<Point3>,
        area: [f64; 4],
        look: impl Fn(Pixel) -> Option<Vector3>,
    ) -> Self {
        let corners = corners(area, look).into_iter().flatten().map(Into::into).collect();
        Self { name, centre: centre.map(Into::into), corners }
    }
}

/// Points that were reconstructed from pixels of several cameras. Lists other than `points` may be
/// empty, or end early: nothing is known then of the points that are missing in them, nor where a
/// number is not finite.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneCloud {
    /// What it shows, such as the name of a file.
    pub title: String,
    /// The unit of world lengths.
    pub unit: String,
    /// X, Y and Z of each point in the world, in `unit`.
    pub points: Vec<[f32; 3]>,
    /// Red, green and blue of each point as a picture shows it (sRGB), 0 to 255.
    pub colours: Vec<[u8; 3]>,
    /// Standard deviations of X, Y and Z of each point, in `unit`.
    pub sigmas: Vec<[f32; 3]>,
    /// How sure the match of each point is, larger for surer; from 0 to 1 as a rule.
    pub confidence: Vec<f32>,
    /// One list a camera: x and y of each point's matched pixel in the camera's own picture. Pixel
    /// (0, 0) is the centre of the top-left pixel.
    pub pixels: Vec<Vec<[f32; 2]>>,
    /// The cameras, in the order of `pixels`; empty where they are not known.
    pub cameras: Vec<CloudCamera>,
    /// What speaks against the points, a sentence each without its full stop.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// Dots of a drawing: with more, the page would be larger and the drawing no clearer.
pub(super) const MOST_DOTS: usize = 4000;

impl SceneCloud {
    /// What a report draws: an even sample of the points, without their pixels.
    #[must_use]
    pub fn drawn(&self) -> Self {
        fn of<T: Copy>(column: &[T], chosen: &[usize]) -> Vec<T> {
            chosen.iter().map_while(|index| column.get(*index).copied()).collect()
        }
        let all: Vec<usize> = (0..self.points.len()).collect();
        let chosen = scattered(&all, MOST_DOTS);
        Self {
            points: of(&self.points, &chosen),
            colours: of(&self.colours, &chosen),
            sigmas: of(&self.sigmas, &chosen),
            confidence: of(&self.confidence, &chosen),
            pixels: Vec::new(),
            title: self.title.clone(),
            unit: self.unit.clone(),
            cameras: self.cameras.clone(),
            warnings: self.warnings.clone(),
        }
    }

    /// One name a camera, also for those that only pixels tell of.
    pub(super) fn names(&self) -> Vec<String> {
        let name = |index: usize| match self.cameras.get(index) {
            Some(camera) => camera.name.clone(),
            None => format!("camera {}", index + 1),
        };
        (0..self.cameras.len().max(self.pixels.len())).map(name).collect()
    }

    /// The cameras as they are drawn, under these names.
    pub(super) fn frusta<'a>(&'a self, names: &'a [String]) -> Vec<Frustum<'a>> {
        let finite = |values: &[f64; 3]| values.iter().all(|value| value.is_finite());
        let frustum = |(index, name): (usize, &'a String)| {
            let camera = self.cameras.get(index);
            let corners = camera.map_or(&[][..], |camera| &camera.corners);
            Frustum {
                name,
                centre: camera.and_then(|camera| camera.centre).filter(finite),
                corners: if corners.iter().all(finite) { corners } else { &[] },
            }
        };
        names.iter().enumerate().map(frustum).collect()
    }
}

/// So many of them, evenly. Every n-th would be columns or rows of the picture where n divides its
/// width: within its n each is chosen at random, always the same.
pub(super) fn scattered(all: &[usize], most: usize) -> Vec<usize> {
    let count = all.len().min(most);
    let step = all.len() as f64 / count.max(1) as f64;
    let mut random = Random::new(0);
    let mut place = |index: usize| ((index as f64 + random.uniform(0.0, 1.0)) * step) as usize;
    (0..count).map(|index| all[place(index).min(all.len() - 1)]).collect()
}
