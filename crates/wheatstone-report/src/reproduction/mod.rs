//! The 2001 paper done again: its figures, its study of architectures, its comparison with rivals,
//! and each of its claims beside what is measured here, on a synthetic rig like its own.

mod figures;
mod results;
mod verdicts;

pub use figures::write;
pub use results::{
    Architecture, BeyondCurve, BeyondPoint, Claim, LearningPoint, Reproduction, Rival, SeedRange,
    Verdict,
};

use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use wheatstone_charts::chart::{AnyChart, line_grid::LineGrid};
use wheatstone_core::{
    Result,
    dataset::Dataset,
    evaluate::{evaluate, floor, viewpoint},
    geometry::Point3,
    method::{
        AnyMethod, Reconstructor,
        network::{Network, NetworkReconstructor, Training},
    },
};
use wheatstone_numeric::{
    progress::{Muted, Progress},
    statistics::{mean, median},
};
use wheatstone_synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences};

/// What to spend.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Seeds of the paper's network.
    pub seeds: u64,
    /// Epochs of its training; the paper's figure 6 is taken at half of them.
    pub epochs: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seeds: 5, epochs: 100_000 }
    }
}

fn spread(values: &[f64]) -> SeedRange {
    SeedRange {
        least: values.iter().copied().fold(f64::INFINITY, f64::min),
        median: median(values),
        greatest: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    }
}

/// The paper's data, made again.
struct Data {
    rig: Rig,
    chart: AnyChart,
    train: Dataset,
    exam: Dataset,
    beyond: Dataset,
    from: Option<Point3>,
}

/// Whole pixels: the paper measured no finer.
const NOISE: Noise = Noise::Quantised;

impl Data {
    fn new() -> Result<Self> {
        let rig = Rig::named("paper", 2)?;
        let chart: AnyChart = LineGrid::default().into();
        let views = Stage::default().views()?;
        let train = chart_correspondences(&rig, &chart, &views, (NOISE, 1), Some(400));
        let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (NOISE, 2), 1000);
        let beyond = random_correspondences(&rig, &chart, (150.0, 200.0), (NOISE, 3), 1000);
        let from = viewpoint(&train);
        Ok(Self { rig, chart, train, exam, beyond, from })
    }

    fn percent(&self, map: &dyn Reconstructor, data: &Dataset) -> f64 {
        evaluate(map, data, self.from).map_or(f64::NAN, |found| found.mean_percent)
    }
}

/// One training of the paper's network, watched.
struct Run {
    /// Epoch, percent on the training pairs, percent on the exam.
    curve: Vec<(u64, f64, f64)>,
    /// The map half way.
    half_way: NetworkReconstructor,
}

fn run(
    network: &Network,
    data: &Data,
    (seed, half): (u64, u64),
    progress: &dyn Progress,
) -> Result<Run> {
    let (mut curve, mut half_way) = (Vec::new(), None);
    network.fit_observed(&data.train, seed, progress, &mut |point, map| {
        let training = data.percent(map, &data.train);
        curve.push((point.epoch, training, data.percent(map, &data.exam)));
        if point.epoch <= half {
            half_way = Some(map.clone());
        }
    })?;
    let half_way = half_way.ok_or(wheatstone_core::Error::Cancelled)?;
    Ok(Run { curve, half_way })
}

fn paper(hidden: &[usize], epochs: u64) -> Network {
    let mut network = Network { hidden: hidden.to_vec(), ..Network::paper() };
    if let Training::Backpropagation(training) = &mut network.training {
        training.epochs = epochs;
    }
    network
}

/// Hidden layers of the study; the paper's own first.
const ARCHITECTURES: [&[usize]; 5] = [&[8, 8], &[8], &[4, 4], &[12, 12], &[6, 6, 6]];

/// Does everything.
///
/// # Errors
///
/// [`wheatstone_core::Error::Cancelled`], or those of the fits.
pub fn reproduce(effort: Effort, progress: &dyn Progress) -> Result<Reproduction> {
    let data = Data::new()?;
    let seeds = effort.seeds.max(1);
    let tasks: Vec<(usize, u64)> =
        (0..ARCHITECTURES.len()).flat_map(|net| (0..seeds).map(move |seed| (net, seed))).collect();
    let done = AtomicU64::new(0);
    let total = tasks.len() as u64;
    let runs: Vec<Result<Run>> = tasks
        .par_iter()
        .map(|(net, seed)| {
            let network = paper(ARCHITECTURES[*net], effort.epochs);
            let run = run(&network, &data, (*seed, effort.epochs / 2), &Muted(progress));
            progress.report("training networks", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            run
        })
        .collect();
    let runs = runs.into_iter().collect::<Result<Vec<Run>>>()?;
    let by_architecture: Vec<&[Run]> = runs.chunks(seeds as usize).collect();
    let figure_5 = learning_curve(by_architecture[0]);
    let architectures: Vec<Architecture> = ARCHITECTURES
        .iter()
        .zip(&by_architecture)
        .map(|(hidden, runs)| study(hidden, runs))
        .collect();
    let (comparison, maps) = compare(&data, progress)?;
    let mut figure_6 = vec![beyond_of_networks(&data, by_architecture[0])];
    for (name, map) in &maps {
        figure_6.push(beyond_curve(name, &data, &[&**map]));
    }
    let mut whole = Reproduction {
        pairs: data.train.correspondences.len(),
        figure_5,
        figure_6,
        architectures,
        comparison,
        claims: Vec::new(),
    };
    whole.claims = verdicts::judge(&whole, effort.epochs);
    Ok(whole)
}

fn learning_curve(runs: &[Run]) -> Vec<LearningPoint> {
    let at = |index: usize, pick: fn(&(u64, f64, f64)) -> f64| {
        spread(&runs.iter().map(|run| pick(&run.curve[index])).collect::<Vec<_>>())
    };
    (0..runs[0].curve.len())
        .map(|index| LearningPoint {
            epoch: runs[0].curve[index].0,
            training_percent: at(index, |point| point.1),
            exam_percent: at(index, |point| point.2),
        })
        .collect()
}

fn study(hidden: &[usize], runs: &[Run]) -> Architecture {
    let last: Vec<f64> =
        runs.iter().filter_map(|run| run.curve.last().map(|point| point.2)).collect();
    let first_below = |run: &Run| {
        run.curve.iter().find(|point| point.2 < 5.0).map_or(f64::INFINITY, |point| point.0 as f64)
    };
    // A plain order statistic: runs that never get there count as infinitely long.
    let mut epochs: Vec<f64> = runs.iter().map(first_below).collect();
    epochs.sort_unstable_by(f64::total_cmp);
    let middle = epochs[epochs.len() / 2];
    Architecture {
        hidden: hidden.to_vec(),
        exam_percent: spread(&last),
        epochs_to_5_percent: middle.is_finite().then_some(middle as u64),
    }
}

/// Fitted maps by their names.
type Maps = Vec<(String, Box<dyn Reconstructor>)>;

/// The rivals that the paper names, and today's default beside them.
const RIVALS: [&str; 6] = ["dlt", "tsai", "brown", "interpolation", "network", "auto"];

fn compare(data: &Data, progress: &dyn Progress) -> Result<(Vec<Rival>, Maps)> {
    let (mut rows, mut maps): (Vec<Rival>, Maps) = (Vec::new(), Vec::new());
    let allowed = floor(&data.rig.cameras, &data.exam)?.rms;
    for (index, name) in RIVALS.into_iter().enumerate() {
        let fit = AnyMethod::named(name)?.fit(&data.train, 0, &Muted(progress))?;
        let inside = evaluate(&*fit.reconstructor, &data.exam, data.from)?;
        rows.push(Rival {
            method: name.into(),
            inside_percent: inside.mean_percent,
            beyond_percent: data.percent(&*fit.reconstructor, &data.beyond),
            inside_ratio_to_floor: inside.rms / allowed,
        });
        maps.push((name.into(), Box::new(Boxed(fit.reconstructor))));
        progress.report("fitting rivals", index as u64 + 1, RIVALS.len() as u64);
    }
    Ok((rows, maps))
}

/// A fitted map of any kind as a trait object.
struct Boxed(wheatstone_core::method::AnyReconstructor);

impl Reconstructor for Boxed {
    fn cameras(&self) -> usize {
        self.0.cameras()
    }

    fn locate(
        &self,
        pixels: &[Option<wheatstone_core::geometry::Pixel>],
    ) -> Option<wheatstone_core::method::Located> {
        self.0.locate(pixels)
    }

    fn pixel_sigma(
        &self,
        camera: usize,
        pixel: wheatstone_core::geometry::Pixel,
        world: Point3,
    ) -> Option<f64> {
        self.0.pixel_sigma(camera, pixel, world)
    }

    fn is_consistent(&self) -> bool {
        self.0.is_consistent()
    }
}

fn beyond_of_networks(data: &Data, runs: &[Run]) -> BeyondCurve {
    let maps: Vec<&dyn Reconstructor> =
        runs.iter().map(|run| &run.half_way as &dyn Reconstructor).collect();
    beyond_curve("network of 2001", data, &maps)
}

/// Errors of Z on chart planes at 150 to 200 cm, over all maps.
fn beyond_curve(method: &str, data: &Data, maps: &[&dyn Reconstructor]) -> BeyondCurve {
    let points: Vec<BeyondPoint> = (0..=10)
        .map(|step| {
            let distance = 150.0 + 5.0 * f64::from(step);
            let stage = Stage { near: distance, far: distance, step: 1.0 };
            let views = stage.views().unwrap_or_default();
            let noise = (NOISE, 50 + step as u64);
            let plane = chart_correspondences(&data.rig, &data.chart, &views, noise, None);
            let errors: Vec<f64> = maps
                .iter()
                .flat_map(|map| {
                    plane.known().filter_map(|(world, row)| {
                        let found = map.locate(&row.pixels)?;
                        Some(100.0 * (found.point.z - world.z).abs() / world.z)
                    })
                })
                .collect();
            BeyondPoint { distance, percent: mean(&errors) }
        })
        .collect();
    BeyondCurve {
        method: method.into(),
        linear_residual: verdicts::growth_residual(&points, 1),
        quadratic_residual: verdicts::growth_residual(&points, 2),
        points,
    }
}
