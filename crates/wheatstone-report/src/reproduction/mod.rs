//! The 2001 paper done again: its figures, its study of architectures, its comparison with rivals,
//! and each of its claims beside what is measured here, on a synthetic rig like its own.

mod conditions;
mod data;
mod figures;
mod growth;
mod report;
mod results;
mod setup;
mod verdicts;

pub use figures::write;
pub use results::{
    Architecture, BeyondCurve, BeyondPoint, Change, Claim, Condition, Drives, Growth,
    LearningPoint, Reproduction, Rival, SeedRange, Verdict,
};

use data::{Data, NOISE};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use wheatstone_core::{
    Result,
    dataset::Correspondence,
    evaluate::floor,
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
use wheatstone_synthetic::random_correspondences;

/// What to spend.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Seeds of every network.
    pub seeds: u64,
    /// Epochs of their training.
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

/// One training of the paper's network, watched.
struct Run {
    /// Epoch, percent on the training pairs, percent on the exam.
    curve: Vec<(u64, f64, f64)>,
    /// The map after as many epochs as figure 6 was taken at, or at the end if that comes before.
    at_figure_6: NetworkReconstructor,
}

/// Epochs after which the paper took its figure 6.
const FIGURE_6_EPOCHS: u64 = 50_000;

fn run(network: &Network, data: &Data, seed: u64, progress: &dyn Progress) -> Result<Run> {
    let (mut curve, mut at_figure_6) = (Vec::new(), None);
    network.fit_observed(&data.train, seed, progress, &mut |point, map| {
        let training = data.percent(map, &data.train);
        curve.push((point.epoch, training, data.percent(map, &data.exam)));
        if point.epoch <= FIGURE_6_EPOCHS {
            at_figure_6 = Some(map.clone());
        }
    })?;
    let at_figure_6 = at_figure_6.ok_or(wheatstone_core::Error::Cancelled)?;
    Ok(Run { curve, at_figure_6 })
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

/// Does everything but the drives of the robot, whose claim stays untested until
/// [`Reproduction::with_drives`].
///
/// # Errors
///
/// [`wheatstone_core::Error::Cancelled`], or those of the fits.
pub fn reproduce(effort: Effort, progress: &dyn Progress) -> Result<Reproduction> {
    let data = Data::new("paper", NOISE)?;
    let seeds = effort.seeds.max(1);
    let tasks: Vec<(usize, u64)> =
        (0..ARCHITECTURES.len()).flat_map(|net| (0..seeds).map(move |seed| (net, seed))).collect();
    let done = AtomicU64::new(0);
    let total = tasks.len() as u64;
    let runs: Vec<Result<Run>> = tasks
        .par_iter()
        .map(|(net, seed)| {
            let network = paper(ARCHITECTURES[*net], effort.epochs);
            let run = run(&network, &data, *seed, &Muted(progress));
            progress.report("training networks", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            run
        })
        .collect();
    let runs = runs.into_iter().collect::<Result<Vec<Run>>>()?;
    let by_architecture: Vec<&[Run]> = runs.chunks(seeds as usize).collect();
    let study = |(hidden, runs): (&&[usize], &&[Run])| study(hidden, runs);
    let (comparison, maps) = compare(&data, progress)?;
    let mut figure_6 = vec![beyond_of_networks(&data, by_architecture[0])];
    figure_6.extend(maps.iter().map(|(name, map)| beyond_curve(name, &data, &[&**map])));
    let mut whole = Reproduction {
        epochs: effort.epochs,
        seeds,
        pairs: data.train.correspondences.len(),
        setup: setup::of(&data)?,
        figure_5: learning_curve(by_architecture[0]),
        figure_6,
        architectures: ARCHITECTURES.iter().zip(&by_architecture).map(study).collect(),
        comparison,
        conditions: conditions::all(effort, progress)?,
        drives: None,
        claims: Vec::new(),
    };
    whole.claims = verdicts::judge(&whole);
    Ok(whole)
}

impl Reproduction {
    /// With drives of the robot, by which the paper's claim about it is judged.
    #[must_use]
    pub fn with_drives(mut self, drives: Drives) -> Self {
        self.drives = Some(drives);
        self.claims = verdicts::judge(&self);
        self
    }
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
        let inside = data.errors(&*fit.reconstructor, &data.exam)?;
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
        runs.iter().map(|run| &run.at_figure_6 as &dyn Reconstructor).collect();
    beyond_curve(verdicts::NETWORK, data, &maps)
}

/// Errors of Z at 150 to 200 cm, over all maps.
fn beyond_curve(method: &str, data: &Data, maps: &[&dyn Reconstructor]) -> BeyondCurve {
    // So many that chance changes a mean by some percent of it.
    const POINTS: usize = 1000;
    let at = |step: u32| {
        let distance = 150.0 + 5.0 * f64::from(step);
        let (range, noise) = ((distance, distance), (NOISE, 50 + u64::from(step)));
        let plane = random_correspondences(&data.rig, &data.chart, range, noise, POINTS);
        let of = |map: &&dyn Reconstructor| -> Vec<f64> {
            let error = |(world, row): (Point3, &Correspondence)| {
                Some((map.locate_point(&row.pixels)?.z - world.z).abs())
            };
            plane.known().filter_map(error).collect()
        };
        let error = mean(&maps.iter().flat_map(of).collect::<Vec<f64>>());
        BeyondPoint { distance, percent: 100.0 * error / distance, error }
    };
    let points: Vec<BeyondPoint> = (0..=10).map(at).collect();
    BeyondCurve {
        method: method.into(),
        percent_growth: growth::beyond(&points, |point| point.percent),
        error_growth: growth::power(&points, |point| point.error),
        points,
    }
}
