//! A camera that learns what its lens does: a projective camera with a symmetric lens, and a
//! regularised radial-basis correction for what that misses, as a function of the direction and the
//! inverse depth seen from the camera. Fitted in pixels, where the noise is; located by least pixel
//! errors; rays are straight, so that it goes on beyond the depths it was shown.
//!
//! How much correction there is, how smooth it is and how noisy the pixels are is decided by the
//! evidence: MacKay 1992 (doi:10.1162/neco.1992.4.3.415), Foresee & Hagan 1997
//! (doi:10.1109/ICNN.1997.614194). With Gaussian priors on its weights the correction is a Gaussian
//! process (Neal 1996, doi:10.1007/978-1-4612-0745-0), here in the reduced-rank form of Solin & Sarkka
//! 2020 (doi:10.1007/s11222-019-09886-w). Triangulation: Hartley & Sturm 1997
//! (doi:10.1006/cviu.1997.0547).

mod model;
mod evidence;
mod correction_basis;
mod greatest_evidence;
mod fit;
mod layout;
mod lens;
mod pose_errors;
mod pose_jacobian;
mod pose_uncertainty;
mod settings;
mod uncertainty;
mod jacobian;
mod epipolar_check;
pub(crate) mod chart_poses;
pub(crate) mod uncertain_poses;

pub(super) use {epipolar_check::EpipolarCheck, pose_uncertainty::Motions};

use super::{
    AnyMethod, Fit, FitErrors, Located, Method, Plan, Reconstructor,
    checks::{enough, linear_camera},
    fit_errors::Displacements,
    lens_numbers::LensNumbers,
    only_default,
    point_covariance::Observation,
};
use crate::{
    Result,
    camera::pinhole::Pinhole,
    dataset::Dataset,
    geometry::{Pixel, Point3, Pose, ProjectionMatrix, Ray, triangulation},
};
use fit::POINTS_NEEDED;
use model::{NeuralCameraModel, PixelCovariance};
use nalgebra::{DMatrix, Matrix2, Matrix2x3, Vector2};
use pose_uncertainty::{Following, FoundCharts};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// There is nothing to set: the evidence does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NeuralCamera {}

/// The fitted cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NeuralCameraReconstructor {
    cameras: Vec<NeuralCameraModel>,
}

impl NeuralCamera {
    /// Each camera fitted to what it saw; beside them how charts may have stood otherwise, where their
    /// places were found from the same pixels.
    fn cameras(
        &self,
        train: &Dataset,
        progress: &dyn Progress,
    ) -> Result<(Vec<NeuralCameraModel>, Option<Motions>)> {
        let charts = chart_pose_uncertainty(train);
        let fit = |camera: usize| fit_one(camera, (train, charts.as_ref()), progress);
        let fitted: Vec<Result<_>> = (0..train.cameras).into_par_iter().map(fit).collect();
        let fitted: Vec<_> = fitted.into_iter().collect::<Result<_>>()?;
        let (mut cameras, following): (Vec<_>, Vec<_>) = fitted.into_iter().unzip();
        let following: Option<Vec<Following>> = following.into_iter().collect();
        let motions = charts
            .zip(following.as_ref())
            .and_then(|(charts, following)| Motions::of(charts, following, train));
        if let (Some(motions), Some(following)) = (&motions, &following) {
            for (camera, following) in cameras.iter_mut().zip(following) {
                camera.follow(following.modes(motions.modes()));
            }
        }
        Ok((cameras, motions))
    }
}

/// The charts whose places were found from the same pixels.
fn chart_pose_uncertainty(train: &Dataset) -> Option<FoundCharts> {
    let centre = ProjectionMatrix::fit(&train.seen_by_camera(0))?.centre()?;
    FoundCharts::of(train, centre)
}

/// One camera fitted to what it saw, and how it follows charts that were found.
fn fit_one(
    camera: usize,
    (train, charts): (&Dataset, Option<&FoundCharts>),
    progress: &dyn Progress,
) -> Result<(NeuralCameraModel, Option<Following>)> {
    progress.check()?;
    let pairs = train.seen_by_camera(camera);
    enough("neural-camera", Some(camera), POINTS_NEEDED, pairs.len())?;
    let start = linear_camera(camera, &pairs)?;
    let (state, posterior) = fit::fit_state(&pairs, &start, None, progress)?;
    let (state, uncertainty) = state.uncertainty(&posterior).ok_or_else(fit::undetermined)?;
    let fitted = NeuralCameraModel::new(&state, &posterior, &uncertainty);
    let following = charts
        .and_then(|charts| Following::of(state, &uncertainty, charts.loosened(camera, train)));
    Ok((fitted.ok_or_else(fit::undetermined)?, following))
}

impl Method for NeuralCamera {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        Ok(Fit::of(NeuralCameraReconstructor { cameras: self.cameras(train, progress)?.0 }))
    }

    fn includes_pose_uncertainty(&self) -> bool {
        true
    }

    fn summary(&self) -> &'static str {
        "each camera a lens model and a learned correction, sized by the evidence; any optics"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

impl NeuralCameraReconstructor {
    /// Pose (world to camera), focal lengths and principal point of each camera's lens, without its
    /// skew, distortion and correction; `None` where one of them sees a mirrored world.
    #[must_use]
    pub fn pinholes(&self) -> Option<Vec<(Pose, Pinhole)>> {
        self.cameras.iter().map(NeuralCameraModel::pinhole).collect()
    }

    /// The numbers of each camera's lens: fx, fy, cx, cy, k1, k2, k3, p1, p2.
    pub(super) fn lenses(&self) -> Vec<LensNumbers<9>> {
        self.cameras.iter().map(NeuralCameraModel::lens_numbers).collect()
    }

    /// Standard deviation, in pixels, of what each camera's fit could not explain.
    #[must_use]
    pub fn pixel_noise(&self) -> Vec<f64> {
        self.cameras.iter().map(NeuralCameraModel::noise).collect()
    }

    /// Where a camera observes a world point, with the covariance of a detected pixel about it: that of
    /// the detector and that of the fit, in squared pixels.
    #[must_use]
    pub fn predict(&self, camera: usize, world: Point3) -> Option<(Pixel, Matrix2<f64>)> {
        let camera = self.cameras.get(camera)?;
        let (pixel, _) = camera.project(world)?;
        Some((pixel, camera.pixel_covariance(world)?))
    }

    /// Standard deviation of one coordinate of a camera's detected pixels about what the fit can
    /// explain, a camera.
    #[must_use]
    pub fn pixel_sigma(&self) -> Vec<f64> {
        self.cameras.iter().map(NeuralCameraModel::noise).collect()
    }

    /// Where a camera observes a world point, with the derivatives by the world's coordinates.
    #[must_use]
    pub fn project(&self, camera: usize, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.cameras.get(camera)?.project(world)
    }

    /// Cameras fitted to points that are nearly those they were fitted to, in a fraction of the time of a fit
    /// from nothing: they stay near the lens and the smoothness that were found then.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Degenerate`], [`crate::Error::Cancelled`].
    pub fn refit(&self, train: &Dataset, progress: &dyn Progress) -> Result<Self> {
        let refit = |(index, camera): (usize, &NeuralCameraModel)| {
            camera.refit(&train.seen_by_camera(index), progress)
        };
        let cameras = self.cameras.iter().enumerate().map(refit).collect::<Result<_>>()?;
        Ok(Self { cameras })
    }

    /// How many numbers each camera's points determined: between 11 and all of lens and correction.
    #[must_use]
    pub fn effective_parameters(&self) -> Vec<f64> {
        self.cameras.iter().map(NeuralCameraModel::effective).collect()
    }
}

impl Reconstructor for NeuralCameraReconstructor {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let (cameras, seen): (Vec<&NeuralCameraModel>, Vec<Pixel>) =
            self.cameras.iter().zip(pixels).filter_map(|(c, p)| Some((c, (*p)?))).unzip();
        if seen.len() < 2 {
            return None;
        }
        let mut start = None;
        // The first time at the middle of the depths, then nearly where the point is.
        for _ in 0..2 {
            let rays =
                cameras.iter().zip(&seen).map(|(camera, pixel)| camera.optics.ray(*pixel, start));
            start =
                Some(triangulation::nearest(rays.collect::<Option<Vec<_>>>()?.into_iter(), 0.0)?);
        }
        let start = start?;
        // In units of each camera's noise.
        let scaled: Vec<Pixel> =
            cameras.iter().zip(&seen).map(|(camera, pixel)| pixel / camera.noise()).collect();
        let found = triangulation::refine(start, &scaled, |index, point| {
            let camera = cameras[index];
            let (pixel, slopes) = camera.project(point)?;
            Some((pixel / camera.noise(), slopes / camera.noise()))
        })?;
        let mut displaced = Vec::new();
        let observation = |(camera, pixel): (&&NeuralCameraModel, Pixel)| {
            let (predicted, slopes) = camera.project(found.point)?;
            let PixelCovariance { covariance, displaced: by } =
                camera.pixel_uncertainty(found.point)?;
            displaced.push(by);
            Some(Observation {
                pixel,
                predicted,
                slopes,
                covariance,
                weight: camera.noise().powi(-2),
            })
        };
        let observations: Option<Vec<Observation>> =
            cameras.iter().zip(seen).map(observation).collect();
        let observations = observations?;
        Located::by_least_squares(found.point, &observations)?
            .with_displaced_cameras(&observations, &displaced)
    }

    fn pixel_sigma(&self, camera: usize, _pixel: Pixel, _world: Point3) -> Option<f64> {
        Some(self.cameras.get(camera)?.noise())
    }

    fn project(&self, camera: usize, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.project(camera, world)
    }

    fn unproject(&self, camera: usize, pixel: Pixel) -> Option<Ray> {
        self.cameras.get(camera)?.optics.ray(pixel, None)
    }

    fn fit_errors(&self) -> Option<FitErrors<'_>> {
        let roots: Vec<_> = self.cameras.iter().map(NeuralCameraModel::errors).collect();
        // Each camera's own errors stand one after the other, then the motions of charts, which all cameras follow.
        let own = |[weights, lens]: &[DMatrix<f64>; 2]| 2 * weights.ncols() + lens.ncols() + 2;
        let own: Vec<usize> = roots.iter().map(own).collect();
        let all: usize = own.iter().sum();
        let count = all + self.cameras.first().map_or(0, |camera| camera.modes().len());
        let displacements: Displacements = Box::new(move |index, world| {
            let camera = self.cameras.get(index)?;
            let [displaced, by_charts] = camera.displacements(roots.get(index)?, world)?;
            let first: usize = own.iter().take(index).sum();
            let mut by = vec![Vector2::zeros(); count];
            by.get_mut(first..first + displaced.len())?.copy_from_slice(&displaced);
            by.get_mut(all..)?.copy_from_slice(&by_charts);
            Some(by)
        });
        Some(FitErrors { count, displacements })
    }

    fn plan(&self) -> Plan<'_> {
        let cameras = self.cameras.iter();
        let cameras: Option<Vec<_>> =
            cameras.map(|camera| camera.optics.placed(camera.noise().powi(-2))).collect();
        cameras.map_or(Plan::PointByPoint, Plan::Cameras)
    }

    fn effective_parameters(&self) -> Option<f64> {
        Some(self.effective_parameters().iter().sum::<f64>() / (2 * self.cameras.len()) as f64)
    }

    fn is_consistent(&self) -> bool {
        !self.cameras.is_empty()
            && self.cameras.iter().all(NeuralCameraModel::is_consistent)
            && self.cameras.windows(2).all(|pair| pair[0].modes().len() == pair[1].modes().len())
    }
}
