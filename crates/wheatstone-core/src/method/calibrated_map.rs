//! A map whose error bars hold what its own do not: noise that differs from point to point, what a
//! camera model lacks, and what is uncertain of the charts that it was fitted to.

use super::{
    CovarianceScale, FitErrors, Located, PixelSigmas, PointNoise, Reconstructor, given_noise,
};
use crate::{
    dataset::Dataset,
    geometry::{Pixel, Point3, Ray, StageCovariance},
};
use nalgebra::Matrix2x3;

/// A map with all that is known of its error bars; it has no [`super::Plan`] of its own.
pub struct CalibratedMap<'a> {
    map: &'a dyn Reconstructor,
    noise: Option<PointNoise>,
    scale: Option<CovarianceScale>,
    stage: Option<&'a StageCovariance>,
    pixel_sigma: Option<f64>,
}

impl<'a> CalibratedMap<'a> {
    /// A map as it is.
    #[must_use]
    pub fn new(map: &'a dyn Reconstructor) -> Self {
        Self { map, noise: None, scale: None, stage: None, pixel_sigma: None }
    }

    /// With noise that differs from point to point, a scale of covariances, and what is uncertain of the places of the
    /// charts that the map was fitted to, as [`super::Locator::with_uncertainty`].
    #[must_use]
    pub fn with_uncertainty(
        mut self,
        noise: Option<PointNoise>,
        scale: Option<CovarianceScale>,
        stage: Option<&'a StageCovariance>,
    ) -> Self {
        (self.noise, self.scale, self.stage) = (noise, scale, stage);
        self
    }

    /// For pixels with this standard deviation of a coordinate, whatever those were that the map was fitted to.
    #[must_use]
    pub fn with_pixel_sigma(mut self, sigma: Option<f64>) -> Self {
        self.pixel_sigma = sigma;
        self.scale = self.scale.filter(|scale| sigma.is_none() || !scale.is_of_few());
        self
    }

    /// With the noise that the points show to which the map was fitted.
    #[must_use]
    pub fn with_noise_of(mut self, train: &Dataset) -> Self {
        self.noise = PointNoise::fit(self.map, train);
        self
    }

    /// With the scale of covariances that the errors of the points show to which the map was fitted.
    #[must_use]
    pub fn with_scale_of(mut self, train: &Dataset) -> Self {
        self.scale = CovarianceScale::fit(&self, train);
        self
    }

    /// By how much its covariances are scaled.
    #[must_use]
    pub fn scale(&self) -> Option<CovarianceScale> {
        self.scale
    }

    /// How much its noise differs from point to point.
    #[must_use]
    pub fn noise(&self) -> Option<PointNoise> {
        self.noise
    }
}

impl Reconstructor for CalibratedMap<'_> {
    fn cameras(&self) -> usize {
        self.map.cameras()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let mut located = self.map.locate(pixels)?;
        // How points of the fit differ in noise says nothing of pixels whose noise is given.
        if let (Some(noise), None) = (self.noise, self.pixel_sigma) {
            located = noise.scaled(located, pixels.iter().flatten().count());
        }
        if let Some(scale) = self.scale {
            located.covariance = scale.of(located.covariance);
        }
        if let Some(sigma) = self.pixel_sigma {
            let shares = given_noise::shares(self.map, pixels, located.point);
            let given = PixelSigmas::One(sigma).variances(0, pixels);
            located = located.for_pixels(shares, &given, self.scale.is_none());
        }
        if let Some(stage) = self.stage {
            located.covariance += stage.at(located.point);
        }
        Some(located)
    }

    fn locate_point(&self, pixels: &[Option<Pixel>]) -> Option<Point3> {
        self.map.locate_point(pixels)
    }

    fn pixel_sigma(&self, camera: usize, pixel: Pixel, world: Point3) -> Option<f64> {
        self.pixel_sigma.or_else(|| self.map.pixel_sigma(camera, pixel, world))
    }

    fn project(&self, camera: usize, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.map.project(camera, world)
    }

    fn unproject(&self, camera: usize, pixel: Pixel) -> Option<Ray> {
        self.map.unproject(camera, pixel)
    }

    fn fit_errors(&self) -> Option<FitErrors<'_>> {
        self.map.fit_errors()
    }

    fn effective_parameters(&self) -> Option<f64> {
        self.map.effective_parameters()
    }
}
