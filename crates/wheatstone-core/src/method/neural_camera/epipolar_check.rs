//! Cameras that can only say whether pixels belong together: for maps that have no rays of their own.

use super::{NeuralCamera, model::Optics, pose_uncertainty::Motions};
use crate::{
    Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
    method::{
        Located, PlacedCamera, Residual, chart_pose_uncertainty, point_covariance::Observation,
    },
};
use nalgebra::{Matrix2, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// One camera without what its covariance takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CheckCamera {
    optics: Optics,
    /// Of one pixel coordinate about its prediction: the detector's and the fit's, which is the mean
    /// over the fitted points.
    variance: f64,
}

/// The cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(in crate::method) struct EpipolarCheck {
    cameras: Vec<CheckCamera>,
}

impl EpipolarCheck {
    /// Fitted to what each camera saw; with the motions of charts whose places were found.
    pub(in crate::method) fn fit(
        train: &Dataset,
        progress: &dyn Progress,
    ) -> Result<(Self, Option<Motions>)> {
        let (fitted, motions) = NeuralCamera {}.cameras(train, progress)?;
        // Charts whose places were found have taken up a part of the noise.
        let pixels: usize = train.known().map(|(_, row)| row.seen_by()).sum();
        let (all, taken) = ((2 * pixels) as f64, chart_pose_uncertainty::unknowns(train) as f64);
        let by_charts = all / (all - taken).max(1.0);
        let onlooker = |(index, camera): (usize, super::NeuralCameraModel)| {
            let equations = (2 * train.seen_by_camera(index).len()) as f64;
            // The trace of the hat matrix is the effective number of parameters.
            let mean = camera.noise().powi(2) * (1.0 + camera.effective() / equations);
            let variance = mean * by_charts;
            CheckCamera { optics: camera.optics, variance }
        };
        let cameras = fitted.into_iter().enumerate().map(onlooker).collect();
        Ok((Self { cameras }, motions))
    }

    /// How badly the rays of these pixels miss each other near `point`, and what to expect of it, as
    /// [`Located`] has them; `None` where a camera cannot see there.
    pub(in crate::method) fn residual(
        &self,
        point: Point3,
        pixels: &[Option<Pixel>],
    ) -> Option<Residual> {
        // The map's point is a good one, but not quite that of the least pixel errors: one step.
        let observations = self.observations(point, pixels)?;
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for Observation { pixel, predicted, slopes, .. } in &observations {
            normal += slopes.transpose() * slopes;
            right += slopes.transpose() * (pixel - predicted);
        }
        let nearer = point + normal.cholesky()?.solve(&right);
        Located::by_least_squares(nearer, &self.observations(nearer, pixels)?)?.residual
    }

    /// The cameras, for who asks of many points; none where one cannot be made ready.
    pub(in crate::method) fn placed(&self) -> Vec<PlacedCamera<'_>> {
        let cameras: Option<Vec<_>> =
            self.cameras.iter().map(|camera| camera.optics.placed(1.0)).collect();
        cameras.unwrap_or_default()
    }

    fn observations(&self, point: Point3, pixels: &[Option<Pixel>]) -> Option<Vec<Observation>> {
        let seen = self.cameras.iter().zip(pixels).filter_map(|(c, p)| Some((c, (*p)?)));
        let observation = |(camera, pixel): (&CheckCamera, Pixel)| {
            let (predicted, slopes) = camera.optics.project(point)?;
            let covariance = Matrix2::from_diagonal_element(camera.variance);
            Some(Observation { pixel, predicted, slopes, covariance, weight: 1.0 })
        };
        seen.map(observation).collect()
    }

    /// Of one pixel coordinate, the mean over some of the cameras.
    pub(in crate::method) fn pixel_variance(&self, cameras: &[usize]) -> f64 {
        let each = cameras.iter().map(|camera| self.cameras[*camera].variance);
        each.sum::<f64>() / cameras.len() as f64
    }

    /// How many there are.
    pub(in crate::method) fn cameras(&self) -> usize {
        self.cameras.len()
    }

    pub(in crate::method) fn is_consistent(&self) -> bool {
        let holds =
            |camera: &CheckCamera| camera.optics.is_consistent() && camera.variance.is_finite();
        self.cameras.iter().all(|camera| holds(camera) && camera.variance >= 0.0)
    }
}
