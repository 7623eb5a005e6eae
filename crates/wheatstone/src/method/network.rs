//! The network of the 2001 paper: pixels of all cameras in, world coordinates out, no camera model.
//!
//! Source: "Camera calibration and three-dimensional world reconstruction of stereo-vision using
//! neural networks", International Journal of Systems Science, 2001. Initial weights: Nguyen & Widrow
//! 1990 (doi:10.1109/IJCNN.1990.137819); training: see [`crate::numeric::backpropagation`].

use super::{AnyMethod, Fit, Located, Method, Reconstructor, unknown};
use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
    numeric::{
        backpropagation::Backpropagation,
        perceptron::{Batch, OutputActivation, Perceptron, weight_count},
        random::Random,
    },
    progress::Progress,
};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// Settings of the network and its training; the defaults are the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Units in each hidden layer.
    pub hidden: Vec<usize>,
    /// Slope of the log-sigmoids.
    pub gain: f64,
    /// What the three outputs do.
    pub output: OutputActivation,
    /// How the weights are found.
    pub training: Backpropagation,
}

impl Default for Network {
    fn default() -> Self {
        Self {
            hidden: vec![8, 8],
            gain: 1.0,
            output: OutputActivation::Linear,
            training: Backpropagation::default(),
        }
    }
}

/// Maps a range of values to 0..1 and back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    /// Of the `column`-th values; `None` where all are equal.
    fn of(rows: &[Vec<f64>], column: usize) -> Option<Self> {
        let low = rows.iter().map(|row| row[column]).fold(f64::INFINITY, f64::min);
        let high = rows.iter().map(|row| row[column]).fold(f64::NEG_INFINITY, f64::max);
        (high > low).then_some(Self { low, high })
    }

    fn to_unit(self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    fn from_unit(self, value: f64) -> f64 {
        self.low + value * (self.high - self.low)
    }
}

/// The trained network with its scales.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkReconstructor {
    perceptron: Perceptron,
    /// x and y of each camera.
    inputs: Vec<Scale>,
    /// X, Y and Z.
    outputs: [Scale; 3],
    /// Standard deviation of X, Y and Z over the training points, in world units.
    world_sigma: [f64; 3],
}

/// The pixels of all cameras in one row; `None` where one did not see the point.
fn input_row(pixels: &[Option<Pixel>]) -> Option<Vec<f64>> {
    pixels
        .iter()
        .copied()
        .collect::<Option<Vec<Pixel>>>()
        .map(|all| all.iter().flat_map(|pixel| [pixel.x, pixel.y]).collect())
}

impl Network {
    fn sizes(&self, cameras: usize) -> Vec<usize> {
        let mut sizes = vec![2 * cameras];
        sizes.extend(&self.hidden);
        sizes.push(3);
        sizes
    }

    fn refuse_odd_settings(&self) -> Result<()> {
        let refuse = |setting: &str, value: String, need: &str| {
            Err(Error::Setting { setting: setting.into(), value, need: need.into() })
        };
        if self.hidden.iter().any(|units| *units == 0 || *units > 10_000) {
            return refuse("hidden", format!("{:?}", self.hidden), "1 to 10000 units a layer");
        }
        if !(self.gain.is_finite() && self.gain > 0.0) {
            return refuse("gain", self.gain.to_string(), "a number above 0");
        }
        Ok(())
    }

    /// Inputs and targets of the points that all cameras saw.
    fn samples(&self, train: &Dataset) -> Result<(Vec<Vec<f64>>, Vec<Vec<f64>>)> {
        let usable = |(world, row): (Point3, &Correspondence)| {
            Some((input_row(&row.pixels)?, world.iter().copied().collect::<Vec<f64>>()))
        };
        let (inputs, targets): (Vec<_>, Vec<_>) = train.known().filter_map(usable).unzip();
        // Three equations a point must at least be as many as the weights.
        let need = weight_count(&self.sizes(train.cameras)).div_ceil(3);
        if inputs.len() < need {
            return Err(Error::TooFew {
                method: "network".into(),
                what: "points seen by all cameras".into(),
                need,
                got: inputs.len(),
            });
        }
        Ok((inputs, targets))
    }
}

fn scales(rows: &[Vec<f64>], what: &[&str]) -> Result<Vec<Scale>> {
    let of = |column: usize| {
        Scale::of(rows, column).ok_or_else(|| Error::Degenerate {
            problem: format!("{} is the same for all points", what[column % what.len()]),
            hint: "points must differ in every coordinate".into(),
        })
    };
    (0..rows.first().map_or(0, Vec::len)).map(of).collect()
}

fn scaled(rows: &[Vec<f64>], scales: &[Scale]) -> Vec<Vec<f64>> {
    rows.iter()
        .map(|row| row.iter().zip(scales).map(|(value, scale)| scale.to_unit(*value)).collect())
        .collect()
}

impl Method for Network {
    fn fit(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
        self.refuse_odd_settings()?;
        let (inputs, targets) = self.samples(train)?;
        let input_scales = scales(&inputs, &["a camera's x", "a camera's y"])?;
        let output_scales = scales(&targets, &["X", "Y", "Z"])?;
        let batch = Batch::new(&scaled(&inputs, &input_scales), &scaled(&targets, &output_scales));
        let mut perceptron = Perceptron::nguyen_widrow(
            &self.sizes(train.cameras),
            self.gain,
            self.output,
            &mut Random::new(seed),
        );
        let mut curve = Vec::new();
        self.training
            .train(&mut perceptron, &batch, progress, &mut |point, _| curve.push(point))?;
        let mut fitted = NetworkReconstructor {
            perceptron,
            inputs: input_scales,
            outputs: [output_scales[0], output_scales[1], output_scales[2]],
            world_sigma: [0.0; 3],
        };
        let mut squares = [0.0; 3];
        for (input, target) in inputs.iter().zip(&targets) {
            let point = fitted.evaluate(input);
            for axis in 0..3 {
                squares[axis] += (point[axis] - target[axis]).powi(2);
            }
        }
        fitted.world_sigma = squares.map(|sum| (sum / inputs.len() as f64).sqrt());
        Ok(Fit { reconstructor: fitted.into(), curve })
    }

    fn summary(&self) -> &'static str {
        "the 2001 paper's network, pixels in and world coordinates out; no camera model"
    }

    fn presets(&self) -> &'static [&'static str] {
        &["default", "paper"]
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        if self.presets().contains(&name) {
            Ok(Self::default().into())
        } else {
            Err(unknown("preset", name, self.presets()))
        }
    }
}

impl NetworkReconstructor {
    fn evaluate(&self, inputs: &[f64]) -> Point3 {
        let unit: Vec<f64> =
            inputs.iter().zip(&self.inputs).map(|(value, scale)| scale.to_unit(*value)).collect();
        let out = self.perceptron.evaluate(&unit);
        let axis = |axis: usize| self.outputs[axis].from_unit(out[axis]);
        Point3::new(axis(0), axis(1), axis(2))
    }
}

impl Reconstructor for NetworkReconstructor {
    fn cameras(&self) -> usize {
        self.inputs.len() / 2
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let point = self.evaluate(&input_row(pixels)?);
        let variances = self.world_sigma.map(|sigma| sigma * sigma);
        let covariance = Matrix3::from_diagonal(&variances.into());
        Some(Located { point, covariance, residual: f64::NAN })
    }

    fn is_consistent(&self) -> bool {
        let sizes = self.perceptron.sizes();
        let finite = |scale: &Scale| scale.high > scale.low && (scale.high - scale.low).is_finite();
        self.perceptron.is_consistent()
            && sizes.first() == Some(&self.inputs.len())
            && sizes.last() == Some(&3)
            && self.inputs.len() >= 4
            && self.inputs.len() % 2 == 0
            && self.inputs.iter().chain(&self.outputs).all(finite)
            && self.world_sigma.iter().all(|sigma| *sigma >= 0.0)
    }
}
