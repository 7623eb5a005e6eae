//! The network: pixels of all cameras in, a point out, no camera model.
//!
//! The `paper` preset is that of the 2001 paper ("Camera calibration and three-dimensional world
//! reconstruction of stereo-vision using neural networks", International Journal of Systems
//! Science): world coordinates as targets, initial weights of Nguyen & Widrow 1990
//! (doi:10.1109/IJCNN.1990.137819), back-propagation with an adaptive rate.
//!
//! The default keeps its layers, and changes what they learn and how: directions and inverse depth
//! as seen from the cameras, which are smooth in the pixels where world coordinates are not, and
//! whose noise is even; counted from what distortion-free cameras would say, so that between few
//! chart planes nothing is left to invent; and second-order training that weighs fit against
//! smoothness by the evidence.

mod evidence;
mod batch;
mod covariance;
mod noise;
mod paper;
mod pose_uncertainty;
mod targets;

use super::{
    AnyMethod, Fit, Located, Method, Plan, Reconstructor, chart_pose_uncertainty,
    checks::enough,
    dlt::{Dlt, DltReconstructor},
    neural_camera::EpipolarCheck,
    unknown,
};
use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
};
use noise::{Noise, direction};
use serde::{Deserialize, Serialize};
use targets::Targets;
use wheatstone_numeric::{
    backpropagation::{Backpropagation, CurvePoint},
    evidence::Evidence,
    perceptron::{OutputActivation, Perceptron, weight_count},
    progress::Progress,
};

/// How the weights are found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "by", rename_all = "kebab-case")]
pub enum Training {
    /// As in the paper: world coordinates scaled to 0..1 as targets, gradient descent.
    Backpropagation(Backpropagation),
    /// Directions and inverse depth as targets, Levenberg-Marquardt steps, weight decay by the
    /// evidence; the best of several starts.
    Evidence(Evidence),
}

/// Settings of the network and its training.
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
    pub training: Training,
}

impl Default for Network {
    fn default() -> Self {
        Self { training: Training::Evidence(Evidence::default()), ..Self::paper() }
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
    fn to_unit(self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    fn restore(self, value: f64) -> f64 {
        self.low + value * (self.high - self.low)
    }

    fn is_sound(self) -> bool {
        self.high > self.low && (self.high - self.low).is_finite()
    }
}

/// How `(column of values) -> scale` is chosen.
type Scaling = fn(&[f64]) -> Scale;

/// A scale a column; refuses columns that are all equal.
fn scales(rows: &[Vec<f64>], what: &[&str], scaling: Scaling) -> Result<Vec<Scale>> {
    let of = |column: usize| {
        let values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        let scale = scaling(&values);
        if scale.is_sound() {
            return Ok(scale);
        }
        Err(Error::Degenerate {
            problem: format!("{} is the same for all points", what[column % what.len()]),
            hint: "points must differ in every coordinate".into(),
        })
    };
    (0..rows.first().map_or(0, Vec::len)).map(of).collect()
}

fn scaled(rows: &[Vec<f64>], scales: &[Scale]) -> Vec<Vec<f64>> {
    let row = |row: &Vec<f64>| {
        row.iter().zip(scales).map(|(value, scale)| scale.to_unit(*value)).collect()
    };
    rows.iter().map(row).collect()
}

/// The trained network with its scales.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkReconstructor {
    perceptron: Perceptron,
    /// x and y of each camera.
    inputs: Vec<Scale>,
    /// The three targets.
    outputs: [Scale; 3],
    /// What the targets mean.
    targets: Targets,
    /// What the targets are counted from: the point that distortion-free cameras would locate.
    base: Option<DltReconstructor>,
    /// Of located points about their places.
    noise: Noise,
    /// Lower triangle of the weights' covariance, row by row; empty where it is not known.
    weight_covariance: Vec<f64>,
    /// What says whether pixels belong together: the map has no rays.
    #[serde(alias = "witness")]
    epipolar_check: Option<EpipolarCheck>,
    /// How it follows charts whose places were found; nothing where they were known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    modes: Vec<pose_uncertainty::Mode>,
    /// How many of the weights the data determine.
    effective_parameters: Option<f64>,
}

/// A point that the map is asked for.
struct Query<'a> {
    pixels: &'a [Option<Pixel>],
    /// x and y of each camera, scaled.
    unit: Vec<f64>,
    /// Where the base locates it, if there is one.
    base: Option<Point3>,
}

/// The pixels of all cameras in one row; `None` where one did not see the point.
fn input_row(pixels: &[Option<Pixel>]) -> Option<Vec<f64>> {
    pixels
        .iter()
        .copied()
        .collect::<Option<Vec<Pixel>>>()
        .map(|all| all.iter().flat_map(|pixel| [pixel.x, pixel.y]).collect())
}

/// What a fit is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Everything,
    /// Where points are and how sure that is, from one start if that is known.
    Points {
        start: Option<u64>,
    },
}

/// Points that all cameras saw.
struct Samples {
    /// x and y of each camera.
    inputs: Vec<Vec<f64>>,
    /// Where each is.
    points: Vec<Point3>,
    /// Which chart placement each belongs to.
    views: Vec<usize>,
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
            return refuse("hidden", format!("{:?}", self.hidden), "1 to 10000 units per layer");
        }
        if !(self.gain.is_finite() && self.gain > 0.0) {
            return refuse("gain", self.gain.to_string(), "a number above 0");
        }
        Ok(())
    }

    /// As [`Method::fit`]; `observe` gets every point of the learning curve, and the map as it then
    /// is, where the training goes by back-propagation.
    ///
    /// # Errors
    ///
    /// As [`Method::fit`].
    pub fn fit_observed(
        &self,
        train: &Dataset,
        seed: u64,
        progress: &dyn Progress,
        observe: &mut dyn FnMut(CurvePoint, &NetworkReconstructor),
    ) -> Result<Fit> {
        self.fit_for(train, (seed, progress), Asked::Everything, observe)
    }

    fn fit_for(
        &self,
        train: &Dataset,
        (seed, progress): (u64, &dyn Progress),
        asked: Asked,
        observe: &mut dyn FnMut(CurvePoint, &NetworkReconstructor),
    ) -> Result<Fit> {
        self.refuse_odd_settings()?;
        let Samples { inputs, points, views } = self.samples(train)?;
        match &self.training {
            Training::Backpropagation(training) => {
                paper::fit(self, training, (&inputs, &points), (seed, progress), observe)
            }
            Training::Evidence(training) => {
                let base = Dlt::default().cameras(train, progress).ok().map(DltReconstructor::bare);
                // Charts whose places were found move with the cameras that watch over the network.
                let watched = asked == Asked::Everything
                    || chart_pose_uncertainty::middles(train).iter().any(Option::is_some);
                let epipolar_check =
                    watched.then(|| EpipolarCheck::fit(train, progress).ok()).flatten();
                let lesson = evidence::TrainingRun { inputs, points, views, base, epipolar_check };
                let frame = Targets::from_cameras(train, &lesson.points);
                let starts = match asked {
                    Asked::Points { start: Some(start) } => start..start + 1,
                    _ => 0..training.starts.max(1),
                };
                evidence::fit(self, (training, starts), lesson, (frame, train), (seed, progress))
            }
        }
    }

    /// The points that all cameras saw.
    fn samples(&self, train: &Dataset) -> Result<Samples> {
        let mut views = Vec::new();
        let usable = |(world, row): (Point3, &Correspondence)| {
            let input = input_row(&row.pixels)?;
            views.push(row.view);
            Some((input, world))
        };
        let (inputs, points): (Vec<_>, Vec<_>) = train.known().filter_map(usable).unzip();
        // Three equations a point must at least be as many as the weights.
        let need = weight_count(&self.sizes(train.cameras)).div_ceil(3);
        enough("network", None, need, inputs.len())?;
        Ok(Samples { inputs, points, views })
    }
}

impl Method for Network {
    fn fit(&self, train: &Dataset, seed: u64, progress: &dyn Progress) -> Result<Fit> {
        self.fit_observed(train, seed, progress, &mut |_, _| ())
    }

    fn fit_fold(
        &self,
        train: &Dataset,
        whole: Option<&Fit>,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Fit> {
        let asked = Asked::Points { start: whole.and_then(|whole| whole.start) };
        self.fit_for(train, (seed, progress), asked, &mut |_, _| ())
    }

    fn summary(&self) -> &'static str {
        "a small network from pixels to a point; no camera model; the preset `paper` is that of 2001"
    }

    fn presets(&self) -> &'static [&'static str] {
        &["default", "paper"]
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        match name {
            "default" => Ok(Self::default().into()),
            "paper" => Ok(Self::paper().into()),
            _ => Err(unknown("preset", name, self.presets())),
        }
    }
}

impl NetworkReconstructor {
    fn scaled_inputs(&self, inputs: &[f64]) -> Vec<f64> {
        inputs.iter().zip(&self.inputs).map(|(value, scale)| scale.to_unit(*value)).collect()
    }

    /// A point seen at `pixels`; `None` where a camera did not see it, or the base has nothing to say of it.
    fn query<'a>(&self, pixels: &'a [Option<Pixel>]) -> Option<Query<'a>> {
        let unit = self.scaled_inputs(&input_row(pixels)?);
        let base = match &self.base {
            Some(base) => Some(base.point(pixels)?),
            None => None,
        };
        Some(Query { pixels, unit, base })
    }

    /// The targets of a point.
    fn predict(&self, Query { unit, base, .. }: &Query<'_>) -> [f64; 3] {
        let outputs = self.perceptron.evaluate(unit);
        let base = base.map_or([0.0; 3], |point| self.targets.of(point));
        [0, 1, 2].map(|axis| base[axis] + self.outputs[axis].restore(outputs[axis]))
    }
}

impl Reconstructor for NetworkReconstructor {
    fn cameras(&self) -> usize {
        self.inputs.len() / 2
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let query = self.query(pixels)?;
        let targets = self.predict(&query);
        let (point, jacobian) = self.targets.point(targets)?;
        let covariance = jacobian * self.target_covariance(&query, targets)? * jacobian.transpose();
        let residual = self.epipolar_check.as_ref().and_then(|check| check.residual(point, pixels));
        Some(Located { point, covariance, residual })
    }

    fn locate_point(&self, pixels: &[Option<Pixel>]) -> Option<Point3> {
        Some(self.targets.point(self.predict(&self.query(pixels)?))?.0)
    }

    fn pixel_sigma(&self, camera: usize, _pixel: Pixel, world: Point3) -> Option<f64> {
        match &self.noise {
            Noise::Pixels { noise } if camera < self.cameras() => {
                Some(noise.variance(direction(self.targets.of(world))).sqrt())
            }
            _ => None,
        }
    }

    fn plan(&self) -> Plan<'_> {
        self.learned().map_or(Plan::PointByPoint, Plan::Learned)
    }

    fn effective_parameters(&self) -> Option<f64> {
        self.effective_parameters.map(|weights| weights / 3.0)
    }

    fn is_consistent(&self) -> bool {
        let sizes = self.perceptron.sizes();
        let count = self.perceptron.weights().len();
        let base = self.base.as_ref().map_or(0, Reconstructor::cameras);
        self.perceptron.is_consistent()
            && sizes.first() == Some(&self.inputs.len())
            && sizes.last() == Some(&3)
            && self.inputs.len() >= 4
            && self.inputs.len().is_multiple_of(2)
            && self.inputs.iter().chain(&self.outputs).all(|scale| scale.is_sound())
            && self.targets.is_consistent()
            && self
                .base
                .as_ref()
                .is_none_or(|base| base.is_consistent() && base.cameras() == self.cameras())
            && self.noise.is_consistent()
            && self.epipolar_check.as_ref().is_none_or(|epipolar_check| {
                epipolar_check.is_consistent() && epipolar_check.cameras() == self.cameras()
            })
            && self.modes.iter().all(|mode| mode.is_consistent(count, base))
            && [0, count * (count + 1) / 2].contains(&self.weight_covariance.len())
            && self.weight_covariance.iter().all(|value| value.is_finite())
    }
}
