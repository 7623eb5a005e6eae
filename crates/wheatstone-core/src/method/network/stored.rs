//! Networks as model files have them: those of sets of cameras, or, in older files, one of all cameras.

use super::{EpipolarCheck, NetworkReconstructor, Noise, Scale, SetNetwork, Targets, mode::Mode};
use crate::method::dlt::DltReconstructor;
use serde::Deserialize;
use wheatstone_numeric::perceptron::Perceptron;

#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum Stored {
    Sets(Sets),
    One(Box<One>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sets {
    cameras: usize,
    sets: Vec<SetNetwork>,
    epipolar_check: Option<EpipolarCheck>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct One {
    perceptron: Perceptron,
    inputs: Vec<Scale>,
    outputs: [Scale; 3],
    targets: Targets,
    base: Option<DltReconstructor>,
    noise: Noise,
    weight_covariance: Vec<f64>,
    #[serde(alias = "witness")]
    epipolar_check: Option<EpipolarCheck>,
    #[serde(default)]
    modes: Vec<Mode>,
    effective_parameters: Option<f64>,
}

impl From<Stored> for NetworkReconstructor {
    fn from(stored: Stored) -> Self {
        match stored {
            Stored::Sets(Sets { cameras, sets, epipolar_check }) => {
                Self { cameras, sets, epipolar_check }
            }
            Stored::One(one) => {
                let One { perceptron, inputs, outputs, targets, base, .. } = *one;
                let cameras = inputs.len() / 2;
                let network = SetNetwork {
                    cameras: (0..cameras).collect(),
                    perceptron,
                    inputs,
                    outputs,
                    targets,
                    base,
                    noise: one.noise,
                    weight_covariance: one.weight_covariance,
                    modes: one.modes,
                    effective_parameters: one.effective_parameters,
                };
                Self { cameras, sets: vec![network], epipolar_check: one.epipolar_check }
            }
        }
    }
}
