//! A map whose error bars hold what is uncertain of the charts that it was fitted to.

use super::{Located, Reconstructor};
use crate::geometry::{Pixel, Point3, Ray, StageCovariance};
use nalgebra::Matrix2x3;

/// A map, its covariances widened by those of its charts' places; it has no [`super::Plan`] of its own.
pub struct OnStage<'a> {
    map: &'a dyn Reconstructor,
    stage: Option<&'a StageCovariance>,
}

impl<'a> OnStage<'a> {
    /// Of a map; without a stage it is the map itself.
    #[must_use]
    pub fn new(map: &'a dyn Reconstructor, stage: Option<&'a StageCovariance>) -> Self {
        Self { map, stage }
    }
}

impl Reconstructor for OnStage<'_> {
    fn cameras(&self) -> usize {
        self.map.cameras()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let mut located = self.map.locate(pixels)?;
        if let Some(stage) = self.stage {
            located.covariance += stage.at(located.point);
        }
        Some(located)
    }

    fn locate_point(&self, pixels: &[Option<Pixel>]) -> Option<Point3> {
        self.map.locate_point(pixels)
    }

    fn pixel_sigma(&self, camera: usize, pixel: Pixel, world: Point3) -> Option<f64> {
        self.map.pixel_sigma(camera, pixel, world)
    }

    fn project(&self, camera: usize, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.map.project(camera, world)
    }

    fn unproject(&self, camera: usize, pixel: Pixel) -> Option<Ray> {
        self.map.unproject(camera, pixel)
    }

    fn effective_parameters(&self) -> Option<f64> {
        self.map.effective_parameters()
    }
}
