//! Cameras with a parametric lens, placed in the world: what the methods that fit such cameras leave.
//!
//! A point is located where it explains all pixels best (Hartley & Sturm 1997,
//! doi:10.1006/cviu.1997.0547), from the point nearest to all rays.

use super::{
    CameraUncertainty, FitErrors, FittedCamera, Located, Plan, Reconstructor,
    fit_errors::Displacements, point_covariance::Observation, pose_error::PoseError,
};
use crate::{
    camera::AdjustableCamera,
    geometry::{Pixel, Point3, Pose, Ray, triangulation},
};
use nalgebra::{DMatrix, Matrix2x3, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::covariance::square_root;

/// Cameras fitted to the same points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedCameras<L> {
    /// The cameras, in the order of the data.
    pub cameras: Vec<FittedCamera<L>>,
    /// What is not known about each of them.
    pub uncertainty: Vec<CameraUncertainty>,
    /// Standard deviation of one pixel coordinate about its prediction, over all cameras.
    pub pixel_sigma: f64,
}

impl<L: AdjustableCamera> FittedCameras<L> {
    /// Where each camera's adjusted numbers begin among those of all cameras, and the square root of the covariance of all:
    /// a column an independent error.
    fn errors(&self) -> (Vec<usize>, DMatrix<f64>) {
        let numbers = || self.uncertainty.iter().map(CameraUncertainty::numbers);
        let firsts: Vec<usize> =
            numbers().scan(0, |next, own| Some(std::mem::replace(next, *next + own))).collect();
        let count = numbers().sum();
        let mut covariance = DMatrix::zeros(count, count);
        for (open, first) in self.uncertainty.iter().zip(&firsts) {
            open.put(&mut covariance, *first);
        }
        (firsts, square_root(&covariance))
    }

    /// What each independent error of the fit does to each camera's pose.
    pub(super) fn pose_errors(&self) -> Vec<Vec<PoseError>> {
        let (firsts, root) = self.errors();
        let each = self.cameras.iter().zip(&self.uncertainty).zip(firsts);
        each.map(|((camera, open), first)| {
            let own = root.rows(first, open.numbers());
            let error =
                |column| open.pose_error(camera, own.column(column).clone_owned().as_slice());
            (0..root.ncols()).map(error).collect()
        })
        .collect()
    }

    /// What cameras linked by charts add to the covariance of a point's right side, seen by the cameras
    /// `places`.
    fn shared(
        &self,
        point: Point3,
        places: &[usize],
        observations: &[Observation],
    ) -> Option<Matrix3<f64>> {
        if !self.uncertainty.iter().any(CameraUncertainty::is_linked) {
            return Some(Matrix3::zeros());
        }
        let (mut earlier, mut sum) = (Vec::new(), Matrix3::zeros());
        for (index, (camera, open)) in self.cameras.iter().zip(&self.uncertainty).enumerate() {
            let seen = places.iter().position(|place| *place == index);
            let own: Vec<Vector3<f64>> = match seen.and_then(|place| observations.get(place)) {
                Some(observation) => {
                    let slopes = open.slopes(camera, point)?;
                    let turned = observation.slopes.transpose() * observation.weight;
                    let by = |slope: &[f64; 2]| turned * Vector2::from(*slope);
                    slopes[..open.numbers()].iter().map(by).collect()
                }
                None => vec![Vector3::zeros(); open.numbers()],
            };
            sum += open.shared_with(&own, &earlier);
            earlier.extend(own);
        }
        Some(sum)
    }
}

impl<L: AdjustableCamera> Reconstructor for FittedCameras<L> {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let mut cameras = Vec::with_capacity(self.cameras.len());
        let mut seen = Vec::with_capacity(self.cameras.len());
        let mut rays = Vec::with_capacity(self.cameras.len());
        let mut places = Vec::with_capacity(self.cameras.len());
        let all = self.cameras.iter().zip(&self.uncertainty).enumerate();
        for ((index, (camera, open)), pixel) in all.zip(pixels) {
            // A pixel that no light can reach says nothing.
            let Some((pixel, ray)) = pixel.and_then(|p| Some((p, camera.ray(p)?))) else {
                continue;
            };
            cameras.push((camera, open));
            places.push(index);
            seen.push(pixel);
            rays.push(ray);
        }
        let start = triangulation::nearest(rays.into_iter(), 0.0)?;
        // In units of each camera's noise.
        let unit = |index: usize| cameras[index].1.weight.sqrt();
        let scaled: Vec<Pixel> =
            seen.iter().enumerate().map(|(index, pixel)| pixel * unit(index)).collect();
        let found = triangulation::refine(start, &scaled, |index, point| {
            let (pixel, slopes) = cameras[index].0.project_with_jacobian(point)?;
            Some((pixel * unit(index), slopes * unit(index)))
        })?;
        let observation =
            |((camera, open), pixel): (&(&FittedCamera<L>, &CameraUncertainty), Pixel)| {
                let (predicted, slopes) = camera.project_with_jacobian(found.point)?;
                let covariance = open.pixel_covariance(camera, found.point, pixel)?;
                Some(Observation { pixel, predicted, slopes, covariance, weight: open.weight })
            };
        let observations: Option<Vec<Observation>> =
            cameras.iter().zip(seen).map(observation).collect();
        let observations = observations?;
        let shared = self.shared(found.point, &places, &observations)?;
        Located::by_linked_cameras(found.point, &observations, shared)
    }

    fn pixel_sigma(&self, camera: usize, pixel: Pixel, _world: Point3) -> Option<f64> {
        Some(self.uncertainty.get(camera)?.noise.variance(pixel).sqrt())
    }

    fn project(&self, camera: usize, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        self.cameras.get(camera)?.project_with_jacobian(world)
    }

    fn unproject(&self, camera: usize, pixel: Pixel) -> Option<Ray> {
        self.cameras.get(camera)?.ray(pixel)
    }

    fn fit_errors(&self) -> Option<FitErrors<'_>> {
        let (firsts, root) = self.errors();
        let count = root.ncols();
        let displacements: Displacements = Box::new(move |index, world| {
            let (camera, open) = (self.cameras.get(index)?, self.uncertainty.get(index)?);
            let slopes = open.slopes(camera, world)?;
            let own = root.rows(*firsts.get(index)?, open.numbers());
            let by = |error: usize| {
                let numbers = own.column(error).into_owned();
                let each = slopes.iter().zip(numbers.iter());
                each.map(|(slope, value)| Vector2::from(*slope) * *value).sum()
            };
            Some((0..count).map(by).collect())
        });
        Some(FitErrors { count, displacements })
    }

    fn plan(&self) -> Plan<'_> {
        let each = self.cameras.iter().zip(&self.uncertainty);
        let cameras: Option<Vec<_>> =
            each.map(|(camera, open)| camera.placed(open.middle(), open.weight)).collect();
        cameras.map_or(Plan::PointByPoint, Plan::Cameras)
    }

    fn effective_parameters(&self) -> Option<f64> {
        let adjusted: usize = self.uncertainty.iter().map(CameraUncertainty::numbers).sum();
        Some(adjusted as f64 / (2 * self.cameras.len()) as f64)
    }

    fn is_consistent(&self) -> bool {
        // Far above rounding, far below anything a file could mean.
        const CROOKED: f64 = 1e-6;
        let mut earlier = 0;
        let camera_holds = |(camera, open): (&FittedCamera<L>, &CameraUncertainty)| {
            let before = earlier;
            earlier += open.numbers();
            let Pose { rotation, translation } = &camera.camera_from_world;
            let square = rotation * rotation.transpose() - Matrix3::identity();
            let mut model = camera.model.clone();
            square.norm() < CROOKED
                && rotation.determinant() > 0.0
                && translation.iter().all(|value| value.is_finite())
                && model.parameters_mut().iter().all(|value| value.is_finite())
                && open.is_consistent(model.parameters_mut().len(), before)
        };
        !self.cameras.is_empty()
            && self.uncertainty.len() == self.cameras.len()
            && self.pixel_sigma >= 0.0
            && self.pixel_sigma.is_finite()
            && self.cameras.iter().zip(&self.uncertainty).all(camera_holds)
    }
}
