//! A camera's intrinsic parameters, with their standard deviations and correlations.

use super::{AnyReconstructor, FittedCameras, lens_numbers::LensNumbers};
use crate::{
    camera::CameraModel,
    geometry::{Point3, Vector3},
};
use serde::Serialize;

/// One intrinsic parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct IntrinsicParameter {
    /// OpenCV's name: fx, fy, cx, cy, then the distortion coefficients. Other lenses add `kappa`
    /// ([`crate::camera::tsai::Tsai::kappa`]), `skew`, which is in pixels, and `k1 of angle` and so on, of the
    /// angle from the axis as for a fisheye.
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
    /// The direction in which it looks: its optical axis in the world, a unit vector.
    pub axis: [f64; 3],
}

const BROWN: [&str; 18] = [
    "fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2", "k4", "k5", "k6", "s1", "s2", "s3", "s4",
    "tauX", "tauY",
];
const KANNALA_BRANDT: [&str; 8] = ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"];
const TSAI: [&str; 5] = ["fx", "fy", "cx", "cy", "kappa"];

/// Focal lengths and principal point, which are always told.
const PINHOLE: usize = 4;

impl AnyReconstructor {
    /// The intrinsic parameters of each camera; `None` for a map without cameras. Those of a neural
    /// camera are its lens's, without skew and learned correction.
    #[must_use]
    pub fn intrinsics(&self) -> Option<Vec<Intrinsics>> {
        match self {
            Self::Brown(fitted) => Some(of_all(fitted, &BROWN)),
            Self::KannalaBrandt(fitted) => Some(of_all(fitted, &KANNALA_BRANDT)),
            Self::Tsai(fitted) => Some(of_all(fitted, &TSAI)),
            Self::Dlt(fitted) => Some(fitted.lenses()?.iter().map(of_numbers).collect()),
            Self::NeuralCamera(fitted) => Some(fitted.lenses().iter().map(of_numbers).collect()),
            _ => None,
        }
    }

    /// The middle of its cameras' centres; `None` for a map without cameras.
    pub(crate) fn viewpoint(&self) -> Option<Point3> {
        let centres: Vec<Vector3> =
            self.intrinsics()?.into_iter().map(|camera| camera.centre.into()).collect();
        let sum: Vector3 = centres.iter().sum();
        (!centres.is_empty()).then(|| Point3::from(sum / centres.len() as f64))
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
        let pose = camera.camera_from_world;
        Intrinsics {
            parameters: parameters(&told, (names, &values), &covariance),
            correlation: correlation(&told, &covariance),
            centre: Point3::from(pose.inverse().translation).into(),
            axis: pose.rotation.row(2).transpose().into(),
        }
    };
    (0..fitted.cameras.len()).map(camera).collect()
}

fn of_numbers<const N: usize>(lens: &LensNumbers<N>) -> Intrinsics {
    let covariance = |a: usize, b: usize| Some(lens.covariance[a][b]);
    let told: Vec<usize> = (0..N).collect();
    Intrinsics {
        parameters: parameters(&told, (&lens.names, &lens.values), &covariance),
        correlation: correlation(&told, &covariance),
        centre: lens.centre.into(),
        axis: lens.axis.into(),
    }
}

type CovarianceOf<'a> = &'a dyn Fn(usize, usize) -> Option<f64>;

fn parameters(
    told: &[usize],
    (names, values): (&[&'static str], &[f64]),
    covariance: CovarianceOf,
) -> Vec<IntrinsicParameter> {
    let parameter = |number: &usize| IntrinsicParameter {
        name: names[*number],
        value: values[*number],
        sigma: covariance(*number, *number).map(f64::sqrt),
    };
    told.iter().map(parameter).collect()
}

fn correlation(told: &[usize], covariance: CovarianceOf) -> Vec<Vec<f64>> {
    let of = |a: usize, b: usize| {
        if a == b {
            return 1.0;
        }
        let scale = || Some((covariance(a, a)? * covariance(b, b)?).sqrt());
        let found = || Some(covariance(a, b)? / scale().filter(|scale| *scale > 0.0)?);
        found().unwrap_or(0.0)
    };
    told.iter().map(|a| told.iter().map(|b| of(*a, *b)).collect()).collect()
}
