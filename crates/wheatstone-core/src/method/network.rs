//! The network: pixels of all cameras in, a point out, no camera model.
//!
//! The `paper` preset is that of the 2001 paper ("Camera calibration and three-dimensional world
//! reconstruction of stereo-vision using neural networks", International Journal of Systems
//! Science): world coordinates as targets, initial weights of Nguyen & Widrow 1990
//! (doi:10.1109/IJCNN.1990.137819), back-propagation with an adaptive rate.
//!
//! The default keeps its layers, and changes what they learn and how: directions and inverse
//! distance as seen from the cameras, which are smooth in the pixels where world coordinates are not,
//! and whose noise is even; counted from what distortion-free cameras would say, so that between few
//! chart planes nothing is left to invent; and second-order training that weighs fit against
//! smoothness by the evidence. Points that only some of three cameras or more saw are located by
//! networks of pairs of cameras.

mod batch;
mod covariance;
mod evidence;
mod fusion;
mod mode;
mod noise;
mod paper;
mod pose_uncertainty;
mod scale;
mod set_network;
mod stored;
mod targets;

use super::{
    AnyMethod, AnyReconstructor, Fit, Located, Method, Plan, Reconstructor, chart_pose_uncertainty,
    checks::enough, neural_camera::EpipolarCheck, unknown,
};
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
};
use noise::Noise;
use rayon::prelude::*;
use scale::{Scale, scaled, scales};
use serde::{Deserialize, Serialize};
use set_network::SetNetwork;
use targets::Targets;
use wheatstone_numeric::{
    backpropagation::{Backpropagation, CurvePoint},
    evidence::Evidence,
    perceptron::{OutputActivation, weight_count},
    progress::Progress,
};

/// How the weights are found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "by", rename_all = "kebab-case")]
pub enum Training {
    /// As in the paper: world coordinates scaled to 0..1 as targets, gradient descent.
    Backpropagation(Backpropagation),
    /// Directions and inverse distance as targets, Levenberg-Marquardt steps, weight decay by the
    /// evidence; the best of several starts.
    Evidence(Evidence),
}

/// Settings of the network and its training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Units in each hidden layer; the default recipe adds some where the data ask for them.
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

/// The trained networks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "stored::Stored")]
pub struct NetworkReconstructor {
    /// The cameras whose pixels it takes.
    cameras: usize,
    /// That of all cameras first, where as many points as it needs were seen by all; then those of pairs.
    sets: Vec<SetNetwork>,
    /// What says whether pixels belong together: the map has no rays.
    epipolar_check: Option<EpipolarCheck>,
}

/// What a fit is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Asked<'a> {
    Everything,
    /// Where points are and how sure that is, from one start if that is known.
    Points {
        start: Option<u64>,
        /// A fit to nearly the same points: networks have as many units as its.
        like: Option<&'a NetworkReconstructor>,
    },
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
        asked: Asked<'_>,
        observe: &mut dyn FnMut(CurvePoint, &NetworkReconstructor),
    ) -> Result<Fit> {
        self.refuse_odd_settings()?;
        match &self.training {
            Training::Backpropagation(training) => {
                let all = Samples::of(train, &Vec::from_iter(0..train.cameras));
                enough("network", None, self.points_needed(train.cameras), all.points.len())?;
                paper::fit(self, training, &all, (seed, progress), observe)
            }
            Training::Evidence(training) => {
                let starts = match asked {
                    Asked::Points { start: Some(start), .. } => start..start + 1,
                    _ => 0..training.starts.max(1),
                };
                // Charts whose places were found move with the cameras that watch over the network.
                let watched = asked == Asked::Everything
                    || chart_pose_uncertainty::middles(train).iter().any(Option::is_some);
                let check = watched.then(|| EpipolarCheck::fit(train, progress).ok()).flatten();
                let (epipolar_check, motions) = check.unzip();
                let lesson = evidence::Lesson {
                    train,
                    targets: Targets::from_cameras(train),
                    check: epipolar_check.as_ref(),
                    motions: motions.flatten(),
                };
                let learn = |set: &Vec<usize>| {
                    let starts = (training, starts.clone());
                    evidence::fit(&self.like(asked, set), starts, (&lesson, set), (seed, progress))
                };
                let sets = self.camera_sets(train, asked)?;
                let fits = sets.par_iter().map(learn).collect::<Result<Vec<_>>>()?;
                let cameras = train.cameras;
                let (mut sets, mut courses): (Vec<SetNetwork>, Vec<_>) = fits.into_iter().unzip();
                if !follow_alike(&sets) {
                    sets.iter_mut().for_each(|set| set.modes.clear());
                }
                let (start, curve) = courses.swap_remove(0);
                let fitted = NetworkReconstructor { cameras, sets, epipolar_check };
                Ok(Fit { curve, start: Some(start), ..Fit::of(fitted) })
            }
        }
    }

    /// With a quarter more units in each layer.
    fn larger(&self) -> Self {
        let hidden = self.hidden.iter().map(|units| units + units.div_ceil(4)).collect();
        Self { hidden, ..self.clone() }
    }

    /// With as many units as the network of a set of cameras is asked to have.
    fn like(&self, asked: Asked<'_>, cameras: &[usize]) -> Self {
        let Asked::Points { like: Some(like), .. } = asked else { return self.clone() };
        let Some(set) = like.sets.iter().find(|set| set.cameras == cameras) else {
            return self.clone();
        };
        let sizes = set.perceptron.sizes();
        Self { hidden: sizes[1..sizes.len() - 1].to_vec(), ..self.clone() }
    }

    /// Three equations a point must at least be as many as the weights.
    fn points_needed(&self, cameras: usize) -> usize {
        weight_count(&self.sizes(cameras)).div_ceil(3)
    }

    /// The sets of cameras that get a network: all, and every pair where there are more than two, as far as enough
    /// points were seen by all of the set.
    fn camera_sets(&self, train: &Dataset, asked: Asked<'_>) -> Result<Vec<Vec<usize>>> {
        let all = train.cameras;
        let seen = |set: &[usize]| {
            let by_all =
                |pixels: &[Option<Pixel>]| set.iter().all(|camera| pixels[*camera].is_some());
            train.known().filter(|(_, row)| by_all(&row.pixels)).count()
        };
        let mut sets = vec![Vec::from_iter(0..all)];
        // Who is asked for points alone is asked for those at hand.
        let in_part = asked == Asked::Everything
            || train.known().any(|(_, row)| (2..all).contains(&row.seen_by()));
        if all > 2 && in_part {
            sets.extend((0..all).flat_map(|a| (a + 1..all).map(move |b| vec![a, b])));
        }
        let counts: Vec<usize> = sets.iter().map(|set| seen(set)).collect();
        let enough_of = |index: usize| counts[index] >= self.points_needed(sets[index].len());
        // Where all saw few of the points, pairs know more together.
        let most = counts.iter().skip(1).copied().max().unwrap_or(0);
        let kept = |index: usize| enough_of(index) && (index > 0 || 4 * counts[0] >= 3 * most);
        let sets: Vec<Vec<usize>> =
            (0..sets.len()).filter(|index| kept(*index)).map(|index| sets[index].clone()).collect();
        if sets.is_empty() {
            enough("network", None, self.points_needed(all), counts[0])?;
        }
        Ok(sets)
    }
}

/// Points that all of a set of cameras saw.
struct Samples {
    /// x and y of each camera.
    inputs: Vec<Vec<f64>>,
    /// Where each is.
    points: Vec<Point3>,
    /// Which chart placement each belongs to.
    views: Vec<usize>,
}

impl Samples {
    fn of(train: &Dataset, cameras: &[usize]) -> Self {
        let mut samples = Self { inputs: Vec::new(), points: Vec::new(), views: Vec::new() };
        for (world, row) in train.known() {
            let pixels = cameras.iter().map(|camera| row.pixels[*camera]);
            if let Some(pixels) = pixels.collect::<Option<Vec<Pixel>>>() {
                samples.inputs.push(pixels.iter().flat_map(|pixel| [pixel.x, pixel.y]).collect());
                samples.points.push(world);
                samples.views.push(row.view);
            }
        }
        samples
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
        let like = whole.and_then(|whole| match &whole.reconstructor {
            AnyReconstructor::Network(network) => Some(network),
            _ => None,
        });
        let asked = Asked::Points { start: whole.and_then(|whole| whole.start), like };
        self.fit_for(train, (seed, progress), asked, &mut |_, _| ())
    }

    fn includes_pose_uncertainty(&self) -> bool {
        true
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

/// Whether all networks follow the same motions of the charts.
fn follow_alike(sets: &[SetNetwork]) -> bool {
    sets.windows(2).all(|two| two[0].modes.len() == two[1].modes.len())
}

impl NetworkReconstructor {
    /// The networks whose word on a point counts: that of just the cameras that saw it, or those of pairs of them.
    fn called_on(&self, pixels: &[Option<Pixel>]) -> Vec<&SetNetwork> {
        let seen: Vec<usize> =
            (0..pixels.len()).filter(|camera| pixels[*camera].is_some()).collect();
        if let Some(own) = self.sets.iter().find(|set| set.cameras == seen) {
            return vec![own];
        }
        let is_within = |set: &&SetNetwork| set.cameras.iter().all(|camera| seen.contains(camera));
        self.sets.iter().filter(is_within).collect()
    }
}

impl Reconstructor for NetworkReconstructor {
    fn cameras(&self) -> usize {
        self.cameras
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let sets = self.called_on(pixels);
        let targets = &sets.first()?.targets;
        let estimates = sets.iter().map(|set| set.estimate(pixels)).collect::<Option<Vec<_>>>()?;
        let (found, covariance) = fusion::fused(&estimates)?;
        let (point, jacobian) = targets.point(found)?;
        let covariance = jacobian * covariance * jacobian.transpose();
        let residual = self.epipolar_check.as_ref().and_then(|check| check.residual(point, pixels));
        Some(Located { point, covariance, residual })
    }

    fn locate_point(&self, pixels: &[Option<Pixel>]) -> Option<Point3> {
        match &*self.called_on(pixels) {
            [set] => Some(set.targets.point(set.predict(&set.query(pixels)?))?.0),
            _ => Some(self.locate(pixels)?.point),
        }
    }

    fn pixel_sigma(&self, camera: usize, _pixel: Pixel, world: Point3) -> Option<f64> {
        self.sets.iter().find(|set| set.cameras.contains(&camera))?.pixel_sigma(world)
    }

    fn plan(&self) -> Plan<'_> {
        self.learned().map_or(Plan::PointByPoint, Plan::Learned)
    }

    fn effective_parameters(&self) -> Option<f64> {
        Some(self.sets.first()?.effective_parameters? / 3.0)
    }

    fn is_consistent(&self) -> bool {
        let fits = |set: &SetNetwork| {
            set.is_consistent()
                && set.cameras.iter().all(|camera| *camera < self.cameras)
                && set.targets == self.sets[0].targets
        };
        self.cameras >= 2
            && !self.sets.is_empty()
            && self.sets.iter().all(fits)
            && follow_alike(&self.sets)
            && self
                .epipolar_check
                .as_ref()
                .is_none_or(|check| check.is_consistent() && check.cameras() == self.cameras)
    }
}
