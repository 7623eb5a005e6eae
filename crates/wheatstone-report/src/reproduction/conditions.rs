//! The paper's recipe where one thing is otherwise than in the paper.

use super::{
    ARCHITECTURES, Change, Condition, Effort,
    data::{Data, NOISE},
    paper, spread,
};
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use wheatstone_core::{
    Error, Result,
    geometry::{Pixel, Point3, Pose, Vector3},
    method::{Located, Method, Reconstructor},
};
use wheatstone_numeric::{
    backpropagation::Backpropagation,
    perceptron::{Batch, OutputActivation, Perceptron},
    progress::{Muted, Progress},
    random::Random,
};
use wheatstone_synthetic::Noise;

/// Mean error in percent and root mean square error in centimetres.
type Outcome = (f64, f64);

/// All conditions, over the seeds.
pub(super) fn all(effort: Effort, progress: &dyn Progress) -> Result<Vec<Condition>> {
    let cases = cases()?;
    let seeds = effort.seeds.max(1);
    let tasks: Vec<(usize, u64)> =
        (0..cases.len()).flat_map(|case| (0..seeds).map(move |seed| (case, seed))).collect();
    let (done, total) = (AtomicU64::new(0), tasks.len() as u64);
    let train = |&(case, seed): &(usize, u64)| {
        let (change, data) = &cases[case];
        let outcome = outcome(change, data, (effort.epochs, seed), &Muted(progress));
        progress.report("changing conditions", done.fetch_add(1, Ordering::Relaxed) + 1, total);
        outcome
    };
    let outcomes: Vec<Result<Outcome>> = tasks.par_iter().map(train).collect();
    let outcomes = outcomes.into_iter().collect::<Result<Vec<Outcome>>>()?;
    let condition = |((change, _), runs): ((Change, Data), &[Outcome])| Condition {
        change,
        exam_percent: spread(&runs.iter().map(|run| run.0).collect::<Vec<f64>>()),
        exam_rms: spread(&runs.iter().map(|run| run.1).collect::<Vec<f64>>()),
    };
    Ok(cases.into_iter().zip(outcomes.chunks(seeds as usize)).map(condition).collect())
}

/// Rigs that see what the paper's sees, through other optics.
const OTHER_CAMERAS: [&str; 6] = ["pinhole", "fisheye", "water", "glass", "bump", "scheimpflug"];

fn cases() -> Result<Vec<(Change, Data)>> {
    // Anywhere: metres away, and turned by more than a radian.
    let elsewhere = Pose::from_rotation_vector(
        Vector3::new(-137.0, 220.0, 360.0),
        Vector3::new(0.4, -0.9, 0.6),
    );
    let mut cases = vec![
        (Change::Nothing, Data::new("paper", NOISE)?),
        (Change::ExactPixels, Data::new("paper", Noise::None)?),
        (Change::Origin, Data::new("paper", NOISE)?.moved(&elsewhere)),
        (Change::Unscaled, Data::new("paper", NOISE)?),
    ];
    for name in OTHER_CAMERAS {
        cases.push((Change::Cameras(name.into()), Data::new(name, NOISE)?));
    }
    Ok(cases)
}

fn outcome(
    change: &Change,
    data: &Data,
    (epochs, seed): (u64, u64),
    progress: &dyn Progress,
) -> Result<Outcome> {
    let errors = match change {
        Change::Unscaled => {
            unscaled(data, (epochs, seed), progress).and_then(|map| data.errors(&map, &data.exam))
        }
        _ => paper(ARCHITECTURES[0], epochs)
            .fit(&data.train, seed, progress)
            .and_then(|fit| data.errors(&*fit.reconstructor, &data.exam)),
    };
    match errors {
        Ok(errors) => Ok((errors.mean_percent, errors.rms)),
        Err(Error::Cancelled) => Err(Error::Cancelled),
        // Training diverged.
        Err(_) => Ok((f64::INFINITY, f64::INFINITY)),
    }
}

/// The paper's network, trained on pixels and centimetres as they are.
fn unscaled(data: &Data, (epochs, seed): (u64, u64), progress: &dyn Progress) -> Result<Unscaled> {
    let (inputs, targets): (Vec<Vec<f64>>, Vec<Vec<f64>>) = data
        .train
        .known()
        .filter_map(|(world, row)| Some((inputs(&row.pixels)?, vec![world.x, world.y, world.z])))
        .unzip();
    let mut sizes = vec![inputs.first().map_or(0, Vec::len)];
    sizes.extend(ARCHITECTURES[0]);
    sizes.push(3);
    let mut random = Random::new(seed);
    let mut network = Perceptron::nguyen_widrow(&sizes, 1.0, OutputActivation::Linear, &mut random);
    let batch = Batch::new(&inputs, &targets);
    let training = Backpropagation { epochs, ..Backpropagation::default() };
    training.train(&mut network, &batch, progress, &mut |_, _| ())?;
    Ok(Unscaled(network))
}

fn inputs(pixels: &[Option<Pixel>]) -> Option<Vec<f64>> {
    let pixels: Vec<Pixel> = pixels.iter().copied().collect::<Option<_>>()?;
    Some(pixels.iter().flat_map(|pixel| [pixel.x, pixel.y]).collect())
}

/// A network from pixels to centimetres.
struct Unscaled(Perceptron);

impl Reconstructor for Unscaled {
    fn cameras(&self) -> usize {
        self.0.sizes()[0] / 2
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let point = self.0.evaluate(&inputs(pixels)?);
        let point = Point3::new(point[0], point[1], point[2]);
        Some(Located { point, covariance: Matrix3::zeros(), residual: None })
    }

    fn pixel_sigma(&self, _camera: usize, _pixel: Pixel, _world: Point3) -> Option<f64> {
        None
    }

    fn is_consistent(&self) -> bool {
        self.0.is_consistent()
    }
}
