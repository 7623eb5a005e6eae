//! A camera's intrinsic parameters, with their standard deviations and correlations.

use super::{AnyReconstructor, FittedCameras};
use crate::{camera::CameraModel, geometry::Point3};
use serde::Serialize;

/// One intrinsic parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct IntrinsicParameter {
    /// OpenCV's name: fx, fy, cx, cy, then the distortion coefficients.
    pub name: &'static str,
    /// In pixels for the first four; a coefficient has no unit, tauX and tauY are in radians.
    pub value: f64,
    /// Its standard deviation; none where it was not adjusted.
    pub sigma: Option<f64>,
}

/// The intrinsic parameters of one camera, and where it stands.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Intrinsics {
    /// Focal lengths, principal point, and the coefficients that are adjusted or not 0.
    pub parameters: Vec<IntrinsicParameter>,
    /// Correlation of each parameter with each, row by row; 0 where one was not adjusted, 1 with itself.
    pub correlation: Vec<Vec<f64>>,
    /// The projection centre in the world.
    pub centre: [f64; 3],
}

const BROWN: [&str; 18] = [
    "fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2", "k4", "k5", "k6", "s1", "s2", "s3", "s4",
    "tauX", "tauY",
];
const KANNALA_BRANDT: [&str; 8] = ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"];

/// Focal lengths and principal point, which are always told.
const PINHOLE: usize = 4;

impl AnyReconstructor {
    /// The intrinsic parameters of each camera; `None` for a map without a parametric lens.
    #[must_use]
    pub fn intrinsics(&self) -> Option<Vec<Intrinsics>> {
        match self {
            Self::Brown(fitted) => Some(of_all(fitted, &BROWN)),
            Self::KannalaBrandt(fitted) => Some(of_all(fitted, &KANNALA_BRANDT)),
            _ => None,
        }
    }
}

fn of_all<L: CameraModel + Clone>(
    fitted: &FittedCameras<L>,
    names: &[&'static str],
) -> Vec<Intrinsics> {
    let camera = |index: usize| {
        let (camera, open) = (&fitted.cameras[index], &fitted.uncertainty[index]);
        let mut model = camera.model.clone();
        let values: Vec<f64> = model.parameters_mut().into_iter().map(|value| *value).collect();
        let covariance = |a: usize, b: usize| open.of_model(a, b);
        let all = names.iter().zip(&values).enumerate();
        let told: Vec<usize> = all
            .filter(|(number, (_, value))| {
                *number < PINHOLE || **value != 0.0 || covariance(*number, *number).is_some()
            })
            .map(|(number, _)| number)
            .collect();
        let sigma = |number: usize| Some(covariance(number, number)?.sqrt());
        let parameter = |number: &usize| IntrinsicParameter {
            name: names[*number],
            value: values[*number],
            sigma: sigma(*number),
        };
        let correlation = |a: usize, b: usize| {
            if a == b {
                return 1.0;
            }
            let found = || Some(covariance(a, b)? / (sigma(a)? * sigma(b)?));
            found().unwrap_or(0.0)
        };
        let row = |a: &usize| told.iter().map(|b| correlation(*a, *b)).collect();
        Intrinsics {
            parameters: told.iter().map(parameter).collect(),
            correlation: told.iter().map(row).collect(),
            centre: Point3::from(camera.camera_from_world.inverse().translation).into(),
        }
    };
    (0..fitted.cameras.len()).map(camera).collect()
}
