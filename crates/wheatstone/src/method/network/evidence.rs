//! The default recipe: inverse depth, second-order steps, decay by the evidence, several starts.

use super::{Fit, Network, NetworkReconstructor, Scale, Targets, scaled, scales};
use crate::{
    Error, Result,
    geometry::{Pixel, Point3},
    method::{Reconstructor, dlt::DltReconstructor},
    numeric::{
        backpropagation::CurvePoint,
        evidence::{Course, Evidence, Trained},
        perceptron::{Batch, Perceptron},
        random::Random,
        statistics::{mean, root_mean_square},
    },
    progress::{Muted, Progress},
};
use rayon::prelude::*;

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

/// Trains for a while from several starts, then on from the one with the most evidence.
fn train(
    settings: &Network,
    training: &Evidence,
    batch: &Batch,
    (cameras, seed): (usize, u64),
    progress: &dyn Progress,
) -> Result<(Perceptron, Trained)> {
    let courses: Vec<Result<Course>> = (0..training.starts.max(1))
        .into_par_iter()
        .map(|number| {
            let perceptron = start(settings, cameras, &mut Random::stream(seed, number));
            let mut course = Course::new(perceptron, batch);
            course.go_on(batch, (training.first_steps, training.least_gain), &Muted(progress))?;
            Ok(course)
        })
        .collect();
    let courses = courses.into_iter().collect::<Result<Vec<Course>>>()?;
    let best = courses.into_iter().max_by(|a, b| a.log_evidence().total_cmp(&b.log_evidence()));
    let mut best = best.ok_or(Error::Cancelled)?;
    best.go_on(batch, (training.steps, training.least_gain), progress)?;
    best.finish(batch)
}

/// What is learned from: pixels of all cameras, places, and the cameras without distortion.
pub(super) struct Lesson {
    pub(super) inputs: Vec<Vec<f64>>,
    pub(super) points: Vec<Point3>,
    pub(super) base: Option<DltReconstructor>,
}

impl Lesson {
    /// What `base` says of each point; no base where it has nothing to say of one.
    fn base_targets(&mut self, frame: &Targets) -> Vec<[f64; 3]> {
        let of = |base: &DltReconstructor, row: &Vec<f64>| {
            let pixels: Vec<Option<Pixel>> =
                row.chunks_exact(2).map(|xy| Some(Pixel::new(xy[0], xy[1]))).collect();
            let targets = frame.of(base.locate(&pixels)?.point);
            targets.iter().all(|value| value.is_finite()).then_some(targets)
        };
        let all = self
            .base
            .as_ref()
            .and_then(|base| self.inputs.iter().map(|row| of(base, row)).collect());
        all.unwrap_or_else(|| {
            self.base = None;
            vec![[0.0; 3]; self.inputs.len()]
        })
    }
}

pub(super) fn fit(
    settings: &Network,
    training: &Evidence,
    mut lesson: Lesson,
    frame: Targets,
    (seed, progress): (u64, &dyn Progress),
) -> Result<Fit> {
    let base = lesson.base_targets(&frame);
    let Lesson { inputs, points, .. } = &lesson;
    let from_base = |(point, base): (&Point3, &[f64; 3])| {
        let of = frame.of(*point);
        [0, 1, 2].map(|axis| of[axis] - base[axis]).to_vec()
    };
    let targets: Vec<Vec<f64>> = points.iter().zip(&base).map(from_base).collect();
    let input_scales = scales(inputs, &["a camera's x", "a camera's y"], standard)?;
    let output_scales = scales(&targets, &["the direction", "the direction", "depth"], standard)?;
    let unit = (scaled(inputs, &input_scales), scaled(&targets, &output_scales));
    let batch = Batch::new(&unit.0, &unit.1);
    let (perceptron, trained) =
        train(settings, training, &batch, (inputs[0].len() / 2, seed), progress)?;
    let covariance = &trained.covariance;
    let triangle = (0..covariance.nrows())
        .flat_map(|row| (0..=row).map(move |column| covariance[(row, column)]))
        .collect();
    let curve = trained.curve.iter().enumerate();
    let count = (3 * inputs.len()) as f64;
    let reconstructor = NetworkReconstructor {
        perceptron,
        inputs: input_scales,
        outputs: [output_scales[0], output_scales[1], output_scales[2]],
        targets: frame,
        base: lesson.base,
        noise: [trained.noise[0], trained.noise[1], trained.noise[2]],
        weight_covariance: triangle,
        effective_parameters: Some(trained.effective_parameters),
    };
    Ok(Fit {
        reconstructor: reconstructor.into(),
        curve: curve
            .map(|(step, square)| CurvePoint {
                epoch: step as u64,
                mean_square_error: square / count,
            })
            .collect(),
    })
}
