//! Where cameras stand as the first one observes them, and how certain that is.

use super::{AnyReconstructor, Intrinsics, pose_error::PoseError};
use crate::geometry::{Point3, Vector3};
use serde::Serialize;

/// Where a camera stands as the first one observes it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RelativePose {
    /// The camera, counted from 0.
    pub camera: usize,
    /// Distance of the projection centres, in the unit of the world.
    pub baseline: f64,
    /// Its standard deviation by what the fit leaves uncertain.
    pub baseline_sigma: Option<f64>,
    /// Angle between the optical axes, in radians.
    pub angle: f64,
    /// Its standard deviation in radians; none for axes that are parallel within a few of them.
    pub angle_sigma: Option<f64>,
}

impl AnyReconstructor {
    /// Where each camera but the first stands; `None` for a map without cameras. Standard deviations are those of
    /// `brown`, `kannala-brandt`, `tsai` and `neural-camera`.
    #[must_use]
    pub fn relative_poses(&self) -> Option<Vec<RelativePose>> {
        let cameras = self.intrinsics()?;
        let errors = match self {
            Self::Brown(fitted) => Some(fitted.pose_errors()),
            Self::KannalaBrandt(fitted) => Some(fitted.pose_errors()),
            Self::Tsai(fitted) => Some(fitted.pose_errors()),
            Self::NeuralCamera(fitted) => Some(fitted.pose_errors()),
            _ => None,
        };
        let beside = |camera: usize| {
            let pair = [&cameras[0], &cameras[camera]];
            let errors = errors.as_ref().map(|all| [&all[0][..], &all[camera][..]]);
            RelativePose { camera, ..between(pair, errors) }
        };
        Some((1..cameras.len()).map(beside).collect())
    }
}

fn between(cameras: [&Intrinsics; 2], errors: Option<[&[PoseError]; 2]>) -> RelativePose {
    /// Nearer to parallel the angle does not depend linearly on the errors.
    const LINEAR: f64 = 3.0;
    let [first, other] = cameras.map(|camera| Point3::from(camera.centre));
    let axes = cameras.map(|camera| Vector3::from(camera.axis));
    let (between, angle) = (other - first, axes[0].angle(&axes[1]));
    let deviation = |of: &dyn Fn([PoseError; 2]) -> f64| {
        let [first, other] = errors?;
        let squares = first.iter().zip(other).map(|(own, other)| of([*own, *other]).powi(2));
        Some(squares.sum::<f64>().sqrt())
    };
    let direction = between.normalize();
    let turned = |[own, other]: [PoseError; 2]| own.axis.dot(&axes[1]) + other.axis.dot(&axes[0]);
    let angle_sigma = deviation(&|pair| turned(pair) / libm::sin(angle));
    RelativePose {
        camera: 0,
        baseline: between.norm(),
        baseline_sigma: deviation(&|[own, other]| direction.dot(&(other.centre - own.centre))),
        angle,
        angle_sigma: angle_sigma.filter(|sigma| angle > LINEAR * sigma),
    }
}
