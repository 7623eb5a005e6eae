//! How the cameras of a scene stand, and which depths they search.

use crate::{pair::RectifiedPair, scene::SceneReconstructor};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;
use wheatstone_core::{
    geometry::{Pixel, Point3, Pose},
    rectification::VirtualPair,
};

impl SceneReconstructor<'_> {
    /// The virtual cameras of the first two: the left one's frame is that of depths, its picture that of disparities.
    #[must_use]
    pub fn pair(&self) -> &VirtualPair {
        &self.pairs[0].rectification.pair
    }

    /// Where the virtual camera of one of the settings' cameras stands in the world.
    #[must_use]
    pub fn centre(&self, camera: usize) -> Option<Point3> {
        let of = |pair: &RectifiedPair<'_>| {
            let side = pair.rectification.pair.cameras.iter().position(|own| *own == camera)?;
            Some(pair.rectification.pair.centres()[side])
        };
        self.pairs.iter().find_map(of)
    }

    /// Where one of the settings' cameras looks at a pixel, as a unit vector in the world. Of a method without rays it is the
    /// direction from its virtual camera. `None` where it looks nowhere.
    #[must_use]
    pub fn direction(&self, camera: usize, pixel: Pixel) -> Option<Vector3<f64>> {
        let ray = self.model.reconstructor.unproject(camera, pixel);
        let of_pair = || self.pairs.iter().find_map(|pair| pair.direction(camera, pixel));
        ray.map(|ray| ray.direction.normalize()).or_else(of_pair)
    }

    /// How one of the settings' cameras stands in the world: its own frame to the world's, x to the right, y down and z
    /// forward in the middle of its picture. Of a camera before a mirror the picture's y is down. `None` where the middle
    /// looks nowhere.
    #[must_use]
    pub fn view(&self, camera: usize) -> Option<Pose> {
        let [width, height] = self.settings.sizes[self.order(camera)].map(f64::from);
        let (x, y) = ((width - 1.0) / 2.0, (height - 1.0) / 2.0);
        let look = |x: f64, y: f64| self.direction(camera, Pixel::new(x, y));
        let forward = look(x, y)?;
        let lower = look(x, y + height / 8.0)? - forward;
        let down = (lower - forward * forward.dot(&lower)).try_normalize(0.0)?;
        let rotation = Matrix3::from_columns(&[down.cross(&forward), down, forward]);
        Some(Pose { rotation, translation: self.centre(camera)?.coords })
    }

    /// The disparities of the first two cameras that are searched, in pixels.
    #[must_use]
    pub fn disparities(&self) -> Range<i32> {
        self.pairs[0].range.clone()
    }

    /// The nearest and the farthest depth that are searched, in the model's unit; infinite where far points are.
    #[must_use]
    pub fn depths(&self) -> [f64; 2] {
        let pair = self.pair();
        let infinite = pair.principal[0][0] - pair.principal[1][0];
        let depth = |disparity: i32| {
            let parallax = f64::from(disparity) - infinite;
            if parallax > 0.0 { pair.focal * pair.baseline / parallax } else { f64::INFINITY }
        };
        let Range { start, end } = self.disparities();
        [depth(end - 1), depth(start)]
    }
}
