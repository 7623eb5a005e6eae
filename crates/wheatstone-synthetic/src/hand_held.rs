//! A chart waved by hand before the cameras, and what they see of it: the chart's own coordinates, and
//! no place in the world.

use super::{Noise, Rig, correspondences::Placement};
use wheatstone_charts::chart::AnyChart;
use wheatstone_core::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::{Point3, Pose, Vector3},
};
use wheatstone_numeric::random::Random;

/// How a chart is waved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandHeld {
    /// How often it is held still.
    pub views: usize,
    /// From where, in the rig's unit.
    pub near: f64,
    /// To where.
    pub far: f64,
    /// Most turn about the chart's x and about its y, in radians.
    pub tilt: f64,
}

impl Default for HandHeld {
    /// Thirty views over the distances of the paper's stage, tilted by up to 29 degrees.
    fn default() -> Self {
        Self { views: 30, near: 65.0, far: 125.0, tilt: 0.5 }
    }
}

impl HandHeld {
    /// How large a board in the hand is, as a share of a chart that fills the pictures: it stays in them when tilted.
    pub const SIZE: f64 = 0.75;

    /// So many views between a stage's distances, from a little beyond the first, where a tilted board still is in the
    /// pictures.
    #[must_use]
    pub fn between([near, far]: [f64; 2], views: usize) -> Self {
        let near = 1.3 * near;
        Self { views, near, far: (0.9 * far).max(near), ..Self::default() }
    }

    /// The placements, near to far; named in that order.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] for no views, or distances that do not rise.
    pub fn placements(&self, chart: &AnyChart, seed: u64) -> Result<Vec<Placement>> {
        if self.views == 0 || self.views > 1000 || self.near <= 0.0 || self.far < self.near {
            return Err(Error::Setting {
                setting: "hand-held views".into(),
                value: format!("{} from {} to {}", self.views, self.near, self.far),
                need: "1 to 1000 views, and 0 < near <= far".into(),
            });
        }
        let points = chart.points();
        let middle = points.iter().map(|p| p.coords).sum::<Vector3>() / points.len().max(1) as f64;
        let mut random = Random::stream(seed, 1838);
        let place = |view: usize| {
            let share = view as f64 / (self.views as f64 - 1.0).max(1.0);
            let mut up_to = |most: f64| random.uniform(-most, most);
            let aside = 0.06 * (self.near + self.far) / 2.0;
            let turn = Vector3::new(up_to(self.tilt), up_to(self.tilt), up_to(0.6 * self.tilt));
            let depth = self.near + share * (self.far - self.near);
            let centre = Vector3::new(up_to(aside), up_to(aside), depth);
            let mut pose = Pose::from_rotation_vector(centre, turn);
            pose.translation -= pose.rotation * middle;
            (format!("{:03}", view + 1), pose)
        };
        Ok((0..self.views).map(place).collect())
    }
}

/// What each camera observes of a chart at these placements, without its places; and those places, in the
/// order of the rows.
#[must_use]
pub fn hand_held_correspondences(
    rig: &Rig,
    chart: &AnyChart,
    placements: &[Placement],
    (noise, seed): (Noise, u64),
) -> (Dataset, Vec<Point3>) {
    let mut random = Random::new(seed);
    let (mut rows, mut places) = (Vec::new(), Vec::new());
    for (view, (_, world_from_chart)) in placements.iter().enumerate() {
        for (id, point) in chart.points().into_iter().enumerate() {
            let world = world_from_chart.transform(point);
            let seen = rig.cameras.iter().map(|camera| camera.project_visible(world));
            let pixels: Vec<_> =
                seen.map(|pixel| pixel.map(|pixel| noise.apply(pixel, &mut random))).collect();
            if pixels.iter().any(Option::is_some) {
                let board = Some([point.x, point.y]);
                let id = Some(id.to_string());
                rows.push(Correspondence { view, id, pixels, world: None, board });
                places.push(world);
            }
        }
    }
    let data = Dataset {
        unit: "cm".into(),
        cameras: rig.cameras.len(),
        views: placements.iter().map(|(name, _)| name.clone()).collect(),
        correspondences: rows,
    };
    (data, places)
}
