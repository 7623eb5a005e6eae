//! Correspondences: matched pixels with the points that they show, divided into what is fitted and what
//! is judged.

pub mod split;
pub mod volume;

use crate::{
    Error, Result,
    geometry::{Pixel, Point3, Pose},
    unit,
};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use wheatstone_numeric::{least_squares::null_vector, random::Random};

/// One physical point as each camera saw it.
#[derive(Clone, Debug, PartialEq)]
pub struct Correspondence {
    /// Index into [`Dataset::views`]; 0 where no views are known.
    pub view: usize,
    /// The point's name within its view, where it has one.
    pub id: Option<String>,
    /// Where each camera saw it.
    pub pixels: Vec<Option<Pixel>>,
    /// Where it is in the world, where that is known.
    pub world: Option<Point3>,
    /// Where it is on a chart whose own place is not known, or was found from these pixels.
    pub board: Option<[f64; 2]>,
}

impl Correspondence {
    /// How many cameras saw it.
    #[must_use]
    pub fn seen_by(&self) -> usize {
        self.pixels.iter().flatten().count()
    }

    /// Whether the pose of its chart was estimated from these pixels.
    #[must_use]
    pub fn has_estimated_pose(&self) -> bool {
        self.world.is_some() && self.board.is_some()
    }
}

/// Where a chart stands (world from chart) by the rows of a view that have a place on it and one in the world; `None` for
/// fewer than three, or points on a line.
pub(crate) fn chart_pose<'a>(rows: impl Iterator<Item = &'a Correspondence>) -> Option<Pose> {
    let pair = |row: &Correspondence| {
        let [x, y] = row.board?;
        Some((Point3::new(x, y, 0.0), row.world?))
    };
    Pose::aligning(&rows.filter_map(pair).collect::<Vec<_>>())
}

/// Correspondences of one set of cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    /// The unit of world lengths.
    pub unit: String,
    /// Number of cameras.
    pub cameras: usize,
    /// The views' names; none where the file has no views.
    pub views: Vec<String>,
    /// The points.
    pub correspondences: Vec<Correspondence>,
}

impl Dataset {
    /// The same cameras with some of the points.
    #[must_use]
    pub fn subset(&self, keep: impl Fn(usize, &Correspondence) -> bool) -> Self {
        let kept = self.correspondences.iter().enumerate().filter(|(index, c)| keep(*index, c));
        Self {
            unit: self.unit.clone(),
            cameras: self.cameras,
            views: self.views.clone(),
            correspondences: kept.map(|(_, c)| c.clone()).collect(),
        }
    }

    /// The same points as some of the cameras saw them, in the order given.
    pub(crate) fn of_cameras(&self, cameras: &[usize]) -> Self {
        let mut part = self.subset(|_, _| true);
        part.cameras = cameras.len();
        for row in &mut part.correspondences {
            row.pixels = cameras.iter().map(|camera| row.pixels[*camera]).collect();
        }
        part
    }

    /// The same points with lengths in another unit; as they are where it is their own.
    ///
    /// # Errors
    ///
    /// [`Error::Mismatch`] where one of the units is not known.
    pub fn in_unit(mut self, unit: &str) -> Result<Self> {
        if self.unit == unit {
            return Ok(self);
        }
        let Some(factor) = unit::factor(&self.unit, unit) else {
            return Err(Error::Mismatch { what: "unit", model: unit.into(), data: self.unit });
        };
        for row in &mut self.correspondences {
            row.world = row.world.map(|world| world * factor);
            row.board = row.board.map(|board| board.map(|length| length * factor));
        }
        self.unit = unit.into();
        Ok(self)
    }

    /// The points whose place in the world is known.
    pub fn known(&self) -> impl Iterator<Item = (Point3, &Correspondence)> + Clone {
        self.correspondences.iter().filter_map(|c| Some((c.world?, c)))
    }

    /// Whether the pose of some chart was estimated from these pixels.
    #[must_use]
    pub fn has_estimated_poses(&self) -> bool {
        self.correspondences.iter().any(Correspondence::has_estimated_pose)
    }

    /// World points with their pixels in one camera.
    #[must_use]
    pub fn seen_by_camera(&self, camera: usize) -> Vec<(Point3, Pixel)> {
        self.known().filter_map(|(world, c)| Some((world, (*c.pixels.get(camera)?)?))).collect()
    }

    /// How flat the known points lie: their extent across the best plane as a share of that along
    /// it, 0 for points on a plane.
    #[must_use]
    pub fn flatness(&self) -> f64 {
        let count = self.known().count() as f64;
        let centre =
            self.known().fold(nalgebra::Vector3::zeros(), |sum, (p, _)| sum + p.coords) / count;
        let rows: Vec<f64> = self
            .known()
            .flat_map(|(p, _)| (p.coords - centre).iter().copied().collect::<Vec<_>>())
            .collect();
        null_vector(&rows, 3).map_or(0.0, |found| found.least)
    }
}

/// A dataset in the form in which a model file keeps it: compact, and exact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedDataset {
    /// The unit of world lengths.
    pub unit: String,
    /// The views' names.
    pub views: Vec<String>,
    /// Each point's view.
    pub view: Vec<usize>,
    /// Each point's name.
    pub id: Vec<Option<String>>,
    /// Each point's pixels, `[x, y]` a camera.
    pub pixels: Vec<Vec<Option<[f64; 2]>>>,
    /// Each point's place in the world.
    pub world: Vec<Option<[f64; 3]>>,
}

impl SavedDataset {
    /// How far its known points are from their middle, root mean square, in world units.
    #[must_use]
    pub fn spread(&self) -> f64 {
        let points: Vec<Point3> = self.world.iter().flatten().map(|w| Point3::from(*w)).collect();
        let count = points.len().max(1) as f64;
        let middle = points.iter().map(|p| p.coords).sum::<nalgebra::Vector3<f64>>() / count;
        (points.iter().map(|p| (p.coords - middle).norm_squared()).sum::<f64>() / count).sqrt()
    }

    /// Places in the space that its known points span: some of those, and as many as `count` on the way
    /// from one of them to another, at random.
    #[must_use]
    pub fn places(&self, count: usize, seed: u64) -> Vec<Point3> {
        let own: Vec<Point3> = self.world.iter().flatten().map(|p| Point3::from(*p)).collect();
        if own.is_empty() {
            return own;
        }
        let mut random = Random::new(seed);
        let mut any = || own[random.below(own.len())];
        let ends: Vec<(Point3, Point3)> = (0..count).map(|_| (any(), any())).collect();
        let between = ends.into_iter().map(|(a, b)| a + (b - a) * random.uniform(0.0, 1.0));
        let between: Vec<Point3> = between.collect();
        let stride = own.len().div_ceil(count.max(1));
        own.iter().skip(seed as usize % stride).step_by(stride).copied().chain(between).collect()
    }

    /// Which share of another dataset's points are among these, with the same pixels and the same place: 0 to 1.
    #[must_use]
    pub fn share_of(&self, data: &Dataset) -> f64 {
        let bits = |pixels: &[Option<[f64; 2]>], world: Option<[f64; 3]>| -> Vec<Option<u64>> {
            let pixels = pixels.iter().flat_map(|pixel| match pixel {
                Some(place) => place.map(|value| Some(value.to_bits())),
                None => [None; 2],
            });
            let world = world.map_or([None; 3], |place| place.map(|value| Some(value.to_bits())));
            pixels.chain(world).collect()
        };
        let own: HashSet<Vec<Option<u64>>> = self
            .pixels
            .iter()
            .zip(&self.world)
            .map(|(pixels, world)| bits(pixels, *world))
            .collect();
        let among = data.known().filter(|(world, row)| {
            let pixels: Vec<Option<[f64; 2]>> =
                row.pixels.iter().map(|pixel| pixel.map(Into::into)).collect();
            own.contains(&bits(&pixels, Some((*world).into())))
        });
        among.count() as f64 / data.known().count().max(1) as f64
    }

    /// The dataset again; places on charts whose own place is not known are not kept.
    #[must_use]
    pub fn restored(&self) -> Dataset {
        let row = |(index, pixels): (usize, &Vec<Option<[f64; 2]>>)| Correspondence {
            view: self.view.get(index).copied().unwrap_or(0),
            id: self.id.get(index).cloned().flatten(),
            pixels: pixels.iter().map(|pixel| pixel.map(Pixel::from)).collect(),
            world: self.world.get(index).copied().flatten().map(Point3::from),
            board: None,
        };
        Dataset {
            unit: self.unit.clone(),
            cameras: self.pixels.first().map_or(0, Vec::len),
            views: self.views.clone(),
            correspondences: self.pixels.iter().enumerate().map(row).collect(),
        }
    }
}

impl From<&Dataset> for SavedDataset {
    fn from(data: &Dataset) -> Self {
        let all = &data.correspondences;
        Self {
            unit: data.unit.clone(),
            views: data.views.clone(),
            view: all.iter().map(|c| c.view).collect(),
            id: all.iter().map(|c| c.id.clone()).collect(),
            pixels: all
                .iter()
                .map(|c| c.pixels.iter().map(|p| p.map(|p| [p.x, p.y])).collect())
                .collect(),
            world: all.iter().map(|c| c.world.map(|w| [w.x, w.y, w.z])).collect(),
        }
    }
}
