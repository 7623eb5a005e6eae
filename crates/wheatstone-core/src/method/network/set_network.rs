//! The network of a set of cameras: it locates points that all of them saw.

use super::{Noise, Scale, mode::Mode, targets::Targets};
use crate::{
    geometry::{Pixel, Point3},
    method::{Reconstructor, dlt::DltReconstructor},
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::perceptron::Perceptron;

/// A trained network with its scales.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SetNetwork {
    /// Which cameras, counted from 0, in rising order.
    pub(super) cameras: Vec<usize>,
    pub(super) perceptron: Perceptron,
    /// x and y of each camera.
    pub(super) inputs: Vec<Scale>,
    /// The three targets.
    pub(super) outputs: [Scale; 3],
    /// What the targets mean.
    pub(super) targets: Targets,
    /// What the targets are counted from: the point that distortion-free cameras would locate.
    pub(super) base: Option<DltReconstructor>,
    /// Of located points about their places.
    pub(super) noise: Noise,
    /// Lower triangle of the weights' covariance, row by row; empty where it is not known.
    pub(super) weight_covariance: Vec<f64>,
    /// How it follows charts whose places were found; nothing where they were known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) modes: Vec<Mode>,
    /// How many of the weights the data determine.
    pub(super) effective_parameters: Option<f64>,
}

/// A point that the map is asked for.
pub(super) struct Query {
    /// Those of the set's cameras.
    pub(super) pixels: Vec<Option<Pixel>>,
    /// x and y of each camera, scaled.
    pub(super) unit: Vec<f64>,
    /// Where the base locates it, if there is one.
    pub(super) base: Option<Point3>,
}

impl SetNetwork {
    /// A point seen at `pixels`, one entry a camera of the rig; `None` where a camera of the set did not see it, or
    /// the base has nothing to say of it.
    pub(super) fn query(&self, pixels: &[Option<Pixel>]) -> Option<Query> {
        let own = self.cameras.iter().map(|camera| pixels.get(*camera).copied().flatten());
        let own: Vec<Pixel> = own.collect::<Option<_>>()?;
        let pixels: Vec<Option<Pixel>> = own.iter().copied().map(Some).collect();
        let base = match &self.base {
            Some(base) => Some(base.point(&pixels)?),
            None => None,
        };
        let row: Vec<f64> = own.iter().flat_map(|pixel| [pixel.x, pixel.y]).collect();
        Some(Query { pixels, unit: self.scaled_inputs(&row), base })
    }

    pub(super) fn scaled_inputs(&self, inputs: &[f64]) -> Vec<f64> {
        inputs.iter().zip(&self.inputs).map(|(value, scale)| scale.to_unit(*value)).collect()
    }

    /// The targets of a point.
    pub(super) fn predict(&self, Query { unit, base, .. }: &Query) -> [f64; 3] {
        let outputs = self.perceptron.evaluate(unit);
        let base = base.map_or([0.0; 3], |point| self.targets.of(point));
        [0, 1, 2].map(|axis| base[axis] + self.outputs[axis].restore(outputs[axis]))
    }

    /// Standard deviation that is assumed of a pixel coordinate of a world point; `None` where nothing is.
    pub(super) fn pixel_sigma(&self, world: Point3) -> Option<f64> {
        self.noise.pixel_sigma(self.targets.of(world))
    }

    pub(super) fn is_consistent(&self) -> bool {
        let sizes = self.perceptron.sizes();
        let count = self.perceptron.weights().len();
        let base = self.base.as_ref().map_or(0, Reconstructor::cameras);
        self.perceptron.is_consistent()
            && sizes.first() == Some(&self.inputs.len())
            && sizes.last() == Some(&3)
            && self.cameras.len() >= 2
            && self.cameras.is_sorted_by(|a, b| a < b)
            && self.inputs.len() == 2 * self.cameras.len()
            && self.inputs.iter().chain(&self.outputs).all(|scale| scale.is_sound())
            && self.targets.is_consistent()
            && self
                .base
                .as_ref()
                .is_none_or(|own| own.is_consistent() && base == self.cameras.len())
            && self.noise.is_consistent()
            && self.modes.iter().all(|mode| mode.is_consistent(count, base))
            && [0, count * (count + 1) / 2].contains(&self.weight_covariance.len())
            && self.weight_covariance.iter().all(|value| value.is_finite())
    }
}
