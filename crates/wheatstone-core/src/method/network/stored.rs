//! Networks as model files have them: those of sets of cameras, or, in older files, one of all cameras.

use super::{EpipolarCheck, NetworkReconstructor, Noise, Scale, SetNetwork, Targets, mode::Mode};
use crate::method::dlt::DltReconstructor;
use serde::Deserialize;
use wheatstone_numeric::perceptron::Perceptron;

/// What either kind of file has. An enum of the two would not say which field is wrong.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
    cameras: Option<usize>,
    sets: Option<Vec<SetNetwork>>,
    #[serde(alias = "witness")]
    epipolar_check: Option<EpipolarCheck>,
    perceptron: Option<Perceptron>,
    inputs: Option<Vec<Scale>>,
    outputs: Option<[Scale; 3]>,
    targets: Option<Targets>,
    base: Option<DltReconstructor>,
    noise: Option<Noise>,
    weight_covariance: Option<Vec<f64>>,
    modes: Option<Vec<Mode>>,
    effective_parameters: Option<f64>,
}

impl TryFrom<Stored> for NetworkReconstructor {
    type Error = String;

    fn try_from(stored: Stored) -> Result<Self, String> {
        fn given<T>(field: &str, value: Option<T>) -> Result<T, String> {
            value.ok_or_else(|| format!("missing field `{field}`"))
        }
        let epipolar_check = stored.epipolar_check;
        if let Some(sets) = stored.sets {
            let cameras = given("cameras", stored.cameras)?;
            return Ok(Self { cameras, sets, epipolar_check });
        }
        let inputs = given("inputs", stored.inputs)?;
        let cameras = inputs.len() / 2;
        let network = SetNetwork {
            cameras: (0..cameras).collect(),
            perceptron: given("perceptron", stored.perceptron)?,
            inputs,
            outputs: given("outputs", stored.outputs)?,
            targets: given("targets", stored.targets)?,
            base: stored.base,
            noise: given("noise", stored.noise)?,
            weight_covariance: given("weight_covariance", stored.weight_covariance)?,
            modes: stored.modes.unwrap_or_default(),
            effective_parameters: stored.effective_parameters,
        };
        Ok(Self { cameras, sets: vec![network], epipolar_check })
    }
}
