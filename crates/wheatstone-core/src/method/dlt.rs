//! Direct linear transformation, then triangulation: each camera a 3x4 matrix found in closed form
//! from known points, each located point the one with the least pixel errors.
//!
//! Source: Abdel-Aziz & Karara 1971 (reprint doi:10.14358/PERS.81.2.103), on normalised coordinates
//! (Hartley 1997, doi:10.1109/34.601246); triangulation as in Hartley & Sturm 1997
//! (doi:10.1006/cviu.1997.0547). Lens distortion is not modelled.

use super::{
    AnyMethod, Fit, FormulaCameras, Formulas, Located, Method, PlacedCamera, Plan, Reconstructor,
    checks::{enough, linear_camera, on_one_plane},
    lens_numbers::LensNumbers,
    matrix_uncertainty::MatrixUncertainty,
    only_default,
    point_covariance::Observation,
};
use crate::{
    Result,
    dataset::Dataset,
    geometry::{Pixel, Point3, ProjectionMatrix, triangulation},
};
use nalgebra::{Matrix3, Matrix3xX};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// There is nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dlt {}

/// The fitted cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DltReconstructor {
    /// World to pixel, a camera each.
    cameras: Vec<ProjectionMatrix>,
    /// What is not known about each of them; empty where nobody asks.
    uncertainty: Vec<MatrixUncertainty>,
    /// Standard deviation of one pixel coordinate about its prediction, over all cameras.
    pixel_sigma: f64,
}

impl Dlt {
    /// Fits every camera.
    ///
    /// # Errors
    ///
    /// As [`Method::fit`].
    pub(super) fn cameras(
        &self,
        train: &Dataset,
        progress: &dyn Progress,
    ) -> Result<DltReconstructor> {
        let mut cameras = Vec::with_capacity(train.cameras);
        let mut uncertainty = Vec::with_capacity(train.cameras);
        let (mut squares, mut freedom) = (0.0, 0.0);
        for camera in 0..train.cameras {
            progress.check()?;
            let pairs = train.seen_by_camera(camera);
            enough("dlt", Some(camera), ProjectionMatrix::POINTS_NEEDED, pairs.len())?;
            let flat = || on_one_plane(camera);
            let fitted = linear_camera(camera, &pairs)?;
            let errors =
                pairs.iter().filter_map(|(world, pixel)| Some(fitted.project(*world)? - pixel));
            squares += errors.map(|error| error.norm_squared()).sum::<f64>();
            // Two equations a point, eleven unknowns a camera.
            freedom += (2 * pairs.len()) as f64 - 11.0;
            uncertainty.push(MatrixUncertainty::new(&fitted, &pairs).ok_or_else(flat)?);
            cameras.push(fitted);
        }
        let pixel_sigma = (squares / f64::max(freedom, 1.0)).sqrt();
        Ok(DltReconstructor { cameras, uncertainty, pixel_sigma })
    }
}

impl DltReconstructor {
    /// The point with the least pixel errors.
    pub(super) fn point(&self, pixels: &[Option<Pixel>]) -> Option<Point3> {
        let (cameras, seen): (Vec<&ProjectionMatrix>, Vec<Pixel>) =
            self.cameras.iter().zip(pixels).filter_map(|(c, p)| Some((c, (*p)?))).unzip();
        let start = triangulation::linear(cameras.iter().copied().zip(seen.iter().copied()))?;
        let found = triangulation::refine(start, &seen, |index, point| {
            cameras[index].project_with_jacobian(point)
        })?;
        Some(found.point)
    }

    /// Derivatives of the point that these pixels give by their coordinates, three rows; those of second
    /// order in the errors left out.
    pub(super) fn slopes(&self, point: Point3, pixels: &[Option<Pixel>]) -> Option<Matrix3xX<f64>> {
        let mut normal = Matrix3::zeros();
        let mut by_pixel = Matrix3xX::zeros(2 * self.cameras.len());
        for (index, (camera, pixel)) in self.cameras.iter().zip(pixels).enumerate() {
            if pixel.is_some() {
                let (_, slopes) = camera.project_with_jacobian(point)?;
                normal += slopes.transpose() * slopes;
                by_pixel.columns_mut(2 * index, 2).copy_from(&slopes.transpose());
            }
        }
        Some(normal.try_inverse()? * by_pixel)
    }

    /// fx, fy, cx, cy and skew of each camera; `None` where a matrix is no camera's, or nothing is
    /// known of it.
    pub(super) fn lenses(&self) -> Option<Vec<LensNumbers<5>>> {
        let all = self.cameras.iter().zip(&self.uncertainty);
        all.map(|(matrix, uncertainty)| uncertainty.lens(matrix)).collect()
    }

    /// The cameras, for who locates many points.
    pub(super) fn placed(&self) -> Option<Vec<PlacedCamera<'static>>> {
        self.cameras.iter().map(PlacedCamera::plain).collect()
    }

    /// The same cameras, for who asks only where points are.
    pub(super) fn bare(self) -> Self {
        Self { uncertainty: Vec::new(), ..self }
    }
}

impl Method for Dlt {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        Ok(Fit::of(self.cameras(train, progress)?))
    }

    fn summary(&self) -> &'static str {
        "linear cameras in closed form, then triangulation; no lens distortion (1971)"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

impl DltReconstructor {
    /// Cameras whose matrices are taken for exact, with this standard deviation of one pixel coordinate.
    #[must_use]
    pub fn known(cameras: Vec<ProjectionMatrix>, pixel_sigma: f64) -> Self {
        let uncertainty = cameras.iter().map(|_| MatrixUncertainty::known(pixel_sigma)).collect();
        Self { cameras, uncertainty, pixel_sigma }
    }

    /// World to pixel, a camera each.
    #[must_use]
    pub fn matrices(&self) -> &[ProjectionMatrix] {
        &self.cameras
    }

    /// Where a camera observes a world point; `None` behind it, and for a camera that there is not.
    #[must_use]
    pub fn project(&self, camera: usize, world: Point3) -> Option<Pixel> {
        self.cameras.get(camera)?.project(world)
    }
}

impl Reconstructor for DltReconstructor {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let point = self.point(pixels)?;
        let seen = self.cameras.iter().zip(&self.uncertainty).zip(pixels);
        let seen = seen.filter_map(|(camera, pixel)| Some((camera, (*pixel)?)));
        let observation =
            |((camera, open), pixel): ((&ProjectionMatrix, &MatrixUncertainty), Pixel)| {
                let (predicted, slopes) = camera.project_with_jacobian(point)?;
                let covariance = open.pixel_covariance(camera, point, pixel)?;
                Some(Observation { pixel, predicted, slopes, covariance, weight: 1.0 })
            };
        let observations: Option<Vec<Observation>> = seen.map(observation).collect();
        Located::by_least_squares(point, &observations?)
    }

    fn pixel_sigma(&self, camera: usize, pixel: Pixel, _world: Point3) -> Option<f64> {
        Some(self.uncertainty.get(camera)?.noise.variance(pixel).sqrt())
    }

    fn plan(&self) -> Plan<'_> {
        let sure = self.cameras.iter().zip(&self.uncertainty);
        let matrices: Option<Vec<_>> = sure.map(|(camera, open)| open.matrix(camera)).collect();
        match (self.placed(), matrices) {
            (Some(placed), Some(matrices)) if matrices.len() == placed.len() => {
                let noise = self.uncertainty.iter().map(|open| &open.noise).collect();
                let formulas = Formulas::Matrices(matrices);
                Plan::Formulas(FormulaCameras { placed, formulas, noise })
            }
            (Some(placed), _) => Plan::Cameras(placed),
            (None, _) => Plan::PointByPoint,
        }
    }

    fn effective_parameters(&self) -> Option<f64> {
        // Eleven a camera, whatever their number.
        Some(11.0 / 2.0)
    }

    fn is_consistent(&self) -> bool {
        self.cameras.len() >= 2
            && [0, self.cameras.len()].contains(&self.uncertainty.len())
            && self.uncertainty.iter().all(MatrixUncertainty::is_consistent)
            && self.pixel_sigma >= 0.0
            && self.cameras.iter().all(|camera| camera.0.iter().all(|value| value.is_finite()))
    }
}
