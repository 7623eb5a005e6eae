//! The default recipe: inverse distance, second-order steps, decay by the evidence, several starts.

use super::{
    Network, Noise, Samples, Scale, Targets, scaled, scales,
    set_network::{Query, SetNetwork},
};
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
    method::{
        dlt::{Dlt, DltReconstructor},
        neural_camera::{EpipolarCheck, Motions},
    },
};
use rayon::prelude::*;
use std::ops::Range;
use wheatstone_numeric::{
    backpropagation::CurvePoint,
    evidence::{Evidence, Trained, TrainingCurve},
    perceptron::{Batch, Perceptron},
    progress::Progress,
    random::Random,
    statistics::{mean, root_mean_square},
};

/// Mean to 0, standard deviation to 1: the decay's prior then suits every coordinate.
fn standard(values: &[f64]) -> Scale {
    let middle = mean(values);
    let deviations: Vec<f64> = values.iter().map(|value| value - middle).collect();
    Scale { low: middle, high: middle + root_mean_square(&deviations) }
}

/// A start: nearly linear, so that bends appear only where the data ask for them.
fn start(settings: &Network, cameras: usize, random: &mut Random) -> Perceptron {
    let sizes = settings.sizes(cameras);
    let mut perceptron = Perceptron::nguyen_widrow(&sizes, settings.gain, settings.output, random);
    // Of 0.3, 0.6 and 1 times Nguyen and Widrow's weights, and small normal ones, this reached the
    // most evidence over the synthetic rigs.
    let small: Vec<f64> = perceptron.weights().iter().map(|weight| 0.3 * weight).collect();
    perceptron.set_weights(&small);
    perceptron
}

/// Trains from several starts and takes the one with the most evidence, which is told.
///
/// A start goes on as long as it would overtake the best, were it to win as much again as in its last steps.
fn train(
    settings: &Network,
    (training, starts): (&Evidence, Range<u64>),
    batch: &Batch,
    (cameras, seed): (usize, u64),
    progress: &dyn Progress,
) -> Result<(Perceptron, Trained, u64)> {
    let begin = |number| {
        let perceptron = start(settings, cameras, &mut Random::stream(seed, number));
        (number, TrainingCurve::new(perceptron, batch))
    };
    let mut courses: Vec<(u64, TrainingCurve)> = starts.map(begin).collect();
    let mut most = f64::NEG_INFINITY;
    loop {
        let has_hope = |course: &TrainingCurve| {
            let lag = most - course.log_evidence();
            let hope = course.gain(LOOK_BACK).max(0.0);
            !course.is_settled()
                && course.steps() < training.steps
                && (hope.is_infinite() || lag <= hope)
        };
        let running = courses.par_iter_mut().filter(|(_, course)| has_hope(course));
        let round = |(_, course): &mut (u64, TrainingCurve)| {
            let steps = ROUND.min(training.steps - course.steps());
            course.go_on((steps, training.least_gain), progress).map(|()| 1)
        };
        if running.map(round).try_reduce(|| 0, |one, other| Ok(one + other))? == 0 {
            break;
        }
        most = courses
            .iter()
            .map(|(_, course)| course.log_evidence())
            .fold(f64::NEG_INFINITY, f64::max);
    }
    let best =
        courses.into_iter().max_by(|(_, a), (_, b)| a.log_evidence().total_cmp(&b.log_evidence()));
    let (start, best) = best.ok_or(Error::Cancelled)?;
    let (perceptron, trained) = best.finish()?;
    Ok((perceptron, trained, start))
}

/// Steps that each start takes before they are compared again.
const ROUND: u64 = 10;

/// Steps by whose gain what a start may still reach is judged. Over 82 sets of seven rigs, with four starts each,
/// more than 5 were lost in two, 20 and 89 (the latter where there is nothing to learn); by the gain of ten
/// steps in thirteen, and in seventeen where all but one were given up after sixty steps.
const LOOK_BACK: usize = 20;

/// What the networks of all sets of cameras learn from.
pub(super) struct Lesson<'a> {
    pub(super) train: &'a Dataset,
    /// What the targets mean.
    pub(super) targets: Targets,
    /// Cameras fitted to the same points.
    pub(super) check: Option<&'a EpipolarCheck>,
    /// How charts may have stood otherwise.
    pub(super) motions: Option<Motions>,
}

impl Lesson<'_> {
    /// Cameras without distortion, and where they locate each sample; none where they have nothing to say of one.
    fn base(
        &self,
        cameras: &[usize],
        samples: &Samples,
        progress: &dyn Progress,
    ) -> Option<(DltReconstructor, Vec<Point3>)> {
        let own = Dlt::default().cameras(&self.train.of_cameras(cameras), progress).ok()?.bare();
        let place = |row: &Vec<f64>| {
            let pixels: Vec<Option<Pixel>> =
                row.chunks_exact(2).map(|xy| Some(Pixel::new(xy[0], xy[1]))).collect();
            let point = own.point(&pixels)?;
            self.targets.of(point).iter().all(|value| value.is_finite()).then_some(point)
        };
        let places = samples.inputs.iter().map(place).collect::<Option<_>>()?;
        Some((own, places))
    }
}

/// Few chart placements: what the network says between them nothing contradicts.
struct FewViews<'a> {
    settings: &'a Network,
    training: &'a Evidence,
    unit: (&'a [Vec<f64>], &'a [Vec<f64>]),
    views: &'a [usize],
}

/// With more views than this, each lies between others and the evidence is enough.
const FEW: usize = 4;

/// How many times worse than its base the network must be on views left out to be silenced. One view
/// less is a harder task than the one at hand: with three planes of a sound rig the ratio is 0.8 to
/// 1.3; with a plane a tenth of a millimetre out of place, 2 to 9.
const HARM: f64 = 1.5;

impl FewViews<'_> {
    /// Whether the network, trained from `start` without one view after the other, is worse on the views left
    /// out than its base, which corresponds to the outputs `nothing`. Only asked of few views.
    fn network_does_harm(
        &self,
        nothing: &[f64],
        start: u64,
        (cameras, seed): (usize, u64),
        progress: &dyn Progress,
    ) -> Result<bool> {
        let distinct = distinct(self.views);
        if !(3..=FEW).contains(&distinct.len()) {
            return Ok(false);
        }
        let brief = Evidence { starts: 1, ..self.training.clone() };
        let (mut with, mut without) = (0.0, 0.0);
        for left_out in distinct {
            let part = |rows: &[Vec<f64>], inside: bool| -> Vec<Vec<f64>> {
                let kept = rows.iter().zip(self.views).filter(|(_, v)| (**v == left_out) == inside);
                kept.map(|(row, _)| row.clone()).collect()
            };
            let batch = Batch::new(&part(self.unit.0, false), &part(self.unit.1, false));
            let (perceptron, ..) = train(
                self.settings,
                (&brief, start..start + 1),
                &batch,
                (cameras, seed),
                progress,
            )?;
            for (input, target) in part(self.unit.0, true).iter().zip(&part(self.unit.1, true)) {
                with += squared_distance(&perceptron.evaluate(input), target);
                without += squared_distance(nothing, target);
            }
        }
        Ok(with > HARM * HARM * without)
    }
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Makes the network say nothing: its base alone remains.
fn silence(perceptron: &mut Perceptron, trained: &mut Trained, nothing: &[f64]) {
    let mut weights = vec![0.0; perceptron.weights().len()];
    let biases = weights.len() - nothing.len();
    weights[biases..].copy_from_slice(nothing);
    perceptron.set_weights(&weights);
    trained.covariance.fill(0.0);
    trained.effective_parameters = 0.0;
}

/// What the network of a set of cameras learns from, and what it is made of beside its weights.
struct Setup<'a> {
    lesson: &'a Lesson<'a>,
    cameras: &'a [usize],
    samples: Samples,
    base: Option<DltReconstructor>,
    queries: Vec<Query>,
    inputs: Vec<Scale>,
    outputs: [Scale; 3],
    /// Scaled inputs and targets.
    unit: (Vec<Vec<f64>>, Vec<Vec<f64>>),
    batch: Batch,
}

/// A network as it was trained, and from which start.
struct Learned {
    network: SetNetwork,
    trained: Trained,
    start: u64,
}

impl<'a> Setup<'a> {
    fn new(lesson: &'a Lesson, cameras: &'a [usize], progress: &dyn Progress) -> Result<Self> {
        let samples = Samples::of(lesson.train, cameras);
        let frame = &lesson.targets;
        let (base, places) = lesson.base(cameras, &samples, progress).unzip();
        let from_base = |(index, point): (usize, &Point3)| {
            let base = places.as_ref().map_or([0.0; 3], |places| frame.of(places[index]));
            let of = frame.of(*point);
            [0, 1, 2].map(|axis| of[axis] - base[axis]).to_vec()
        };
        let targets: Vec<Vec<f64>> = samples.points.iter().enumerate().map(from_base).collect();
        let inputs = scales(&samples.inputs, &["a camera's x", "a camera's y"], standard)?;
        let outputs = scales(&targets, &["the direction", "the direction", "distance"], standard)?;
        let unit = (scaled(&samples.inputs, &inputs), scaled(&targets, &outputs));
        let query = |(index, row): (usize, &Vec<f64>)| Query {
            pixels: row.chunks_exact(2).map(|xy| Some(Pixel::new(xy[0], xy[1]))).collect(),
            unit: unit.0[index].clone(),
            base: places.as_ref().map(|places| places[index]),
        };
        let queries = samples.inputs.iter().enumerate().map(query).collect();
        let outputs = [outputs[0], outputs[1], outputs[2]];
        let batch = Batch::new(&unit.0, &unit.1);
        Ok(Self { lesson, cameras, samples, base, queries, inputs, outputs, unit, batch })
    }

    /// The network with so many units.
    fn learn(
        &self,
        settings: &Network,
        (training, starts): (&Evidence, Range<u64>),
        (seed, progress): (u64, &dyn Progress),
    ) -> Result<Learned> {
        let start_from = (self.cameras.len(), seed);
        let (mut perceptron, mut trained, start) =
            train(settings, (training, starts), &self.batch, start_from, progress)?;
        let nothing: Vec<f64> = self.outputs.iter().map(|scale| scale.to_unit(0.0)).collect();
        let unit = (&self.unit.0[..], &self.unit.1[..]);
        let few = FewViews { settings, training, unit, views: &self.samples.views };
        if self.base.is_some() && few.network_does_harm(&nothing, start, start_from, progress)? {
            silence(&mut perceptron, &mut trained, &nothing);
        }
        let covariance = &trained.covariance;
        let triangle = (0..covariance.nrows())
            .flat_map(|row| (0..=row).map(move |column| covariance[(row, column)]))
            .collect();
        let mut network = SetNetwork {
            cameras: self.cameras.to_vec(),
            perceptron,
            inputs: self.inputs.clone(),
            outputs: self.outputs,
            targets: self.lesson.targets.clone(),
            base: self.base.clone(),
            noise: Noise::Targets { variance: [0.0; 3] },
            weight_covariance: triangle,
            modes: Vec::new(),
            effective_parameters: Some(trained.effective_parameters),
        };
        let pixel = self.lesson.check.map(|check| check.pixel_variance(self.cameras));
        network.learn_noise((&self.samples, &self.queries), &trained, pixel);
        Ok(Learned { network, trained, start })
    }

    /// Whether the network errs by more than the pixels' noise, so that it may have too few units. Of few views the
    /// evidence does not tell.
    fn asks_for_units(&self, learned: &Learned) -> bool {
        /// Of the variance. Fits that are right come to 0.9 to 1.1.
        const MOST: f64 = 1.1;
        distinct(&self.samples.views).len() > FEW
            && learned.network.misfit(&self.samples.points).is_some_and(|misfit| misfit > MOST)
    }
}

/// The network of a set of cameras; from which start it was trained, and how its errors fell. It gets more units as
/// long as it errs by more than the pixels' noise, and the evidence grows (MacKay 1992, doi:10.1162/neco.1992.4.3.448).
pub(super) fn fit(
    settings: &Network,
    (training, starts): (&Evidence, Range<u64>),
    (lesson, cameras): (&Lesson<'_>, &[usize]),
    (seed, progress): (u64, &dyn Progress),
) -> Result<(SetNetwork, (u64, Vec<CurvePoint>))> {
    let setup = Setup::new(lesson, cameras, progress)?;
    let learn =
        |settings: &Network| setup.learn(settings, (training, starts.clone()), (seed, progress));
    let (mut settings, mut best) = (settings.clone(), learn(settings)?);
    let points = setup.samples.points.len();
    while setup.asks_for_units(&best) {
        settings = settings.larger();
        if points < settings.points_needed(cameras.len()) {
            break;
        }
        let next = learn(&settings)?;
        if next.trained.log_evidence <= best.trained.log_evidence {
            break;
        }
        best = next;
    }
    let Learned { mut network, trained, start } = best;
    if let Some(motions) = &lesson.motions {
        network.follow(lesson.train, motions, &trained);
    }
    let count = (3 * points) as f64;
    let curve = trained.curve.iter().enumerate();
    let curve = curve
        .map(|(step, square)| CurvePoint { epoch: step as u64, mean_square_error: square / count });
    Ok((network, (start, curve.collect())))
}

/// The views that there are.
fn distinct(views: &[usize]) -> Vec<usize> {
    let mut distinct = views.to_vec();
    distinct.sort_unstable();
    distinct.dedup();
    distinct
}
