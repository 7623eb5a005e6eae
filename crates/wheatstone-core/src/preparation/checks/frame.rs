//! The frame in which all is worked out.

use crate::{
    dataset::Dataset,
    geometry::{Point3, Vector3},
};
use wheatstone_numeric::statistics::median;

/// Brings world places to a middle of nothing and a size of one, so that adjustments are well
/// conditioned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) centre: Vector3,
    pub(super) size: f64,
}

impl Frame {
    pub(super) fn of(data: &Dataset) -> Self {
        let along = |axis: usize| {
            let values: Vec<f64> = data.known().map(|(world, _)| world[axis]).collect();
            median(&values)
        };
        let centre = Vector3::new(along(0), along(1), along(2));
        let distances: Vec<f64> =
            data.known().map(|(world, _)| (world.coords - centre).norm()).collect();
        Self { centre, size: median(&distances).max(1e-12) }
    }

    pub(super) fn scaled(&self, world: Point3) -> Point3 {
        Point3::from((world.coords - self.centre) / self.size)
    }

    pub(super) fn world(&self, scaled: Point3) -> Point3 {
        Point3::from(scaled.coords * self.size + self.centre)
    }
}
