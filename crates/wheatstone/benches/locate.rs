//! How long many points take: `cargo bench --bench locate` prints one JSON object of nanoseconds a point,
//! the median of nine runs each, on one thread; of points alone, with error bars, and with trust as well.
//! With `-- brown points 100 2` it locates a million points a hundred times on two threads, and nothing
//! else: `bench/peers/locate.py` runs those beside other programs and compares CPU seconds.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for developers: its figures go to standard output, and it may panic"
)]

use std::{hint::black_box, time::Instant};
use wheatstone::{
    chart::{AnyChart, line_grid::LineGrid},
    dataset::volume::Volume,
    geometry::{PixelColumns, columns_of},
    method::{AnyMethod, AnyReconstructor, LocatedBatch, Locator, network::Training},
    numeric::progress::Silent,
    synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
};

/// Methods with their presets, in the order of the report.
const METHODS: [&str; 6] = ["dlt", "brown", "soloff", "neural-camera", "network:paper", "network"];

struct World {
    map: AnyReconstructor,
    volume: Volume,
    columns: Vec<[Vec<f64>; 2]>,
}

impl World {
    /// A method fitted to the paper's chart, and so many points to be located.
    fn new(method: &str, points: usize) -> Self {
        let rig = Rig::named("paper", 2).unwrap();
        let chart: AnyChart = LineGrid::default().into();
        // A polynomial of the depth is for volumes that are thin, as in particle image velocimetry.
        let (near, far, step) =
            if method == "soloff" { (90.0, 110.0, 5.0) } else { (50.0, 140.0, 15.0) };
        let views = Stage { near, far, step }.views().unwrap();
        let noise = Noise::Normal(0.1);
        let train = chart_correspondences(&rig, &chart, &views, (noise, 3), Some(400));
        let (name, preset) = method.split_once(':').unwrap_or((method, "default"));
        let mut method = AnyMethod::named(name).unwrap().preset(preset).unwrap();
        if let AnyMethod::Network(network) = &mut method
            && let Training::Backpropagation(training) = &mut network.training
        {
            // The time of a point does not depend on what the network has learned.
            training.epochs = 100;
        }
        let map = method.fit_checked(&train, 0, &Silent).unwrap().reconstructor;
        let exam = random_correspondences(&rig, &chart, (near, far), (noise, 4), points);
        let rows: Vec<_> = exam.correspondences.into_iter().map(|row| row.pixels).collect();
        Self { map, volume: Volume::of(&train), columns: columns_of(&rows, 2) }
    }

    fn pixels(&self) -> PixelColumns<'_> {
        PixelColumns::new(self.columns.iter().map(|[x, y]| [x.as_slice(), y.as_slice()]).collect())
    }

    fn locator(&self, what: &str) -> Locator<'_> {
        match what {
            "points" => Locator::new(&*self.map, None).points_only(),
            "bars" => Locator::new(&*self.map, None),
            _ => Locator::new(&*self.map, Some(&self.volume)),
        }
    }

    /// Median nanoseconds a point, once what is made on demand is made.
    fn nanoseconds(&self, what: &str) -> f64 {
        let (pixels, mut locator) = (self.pixels(), self.locator(what));
        let mut places = locator.locate(&pixels);
        let mut runs: Vec<f64> = (0..9)
            .map(|_| {
                let start = Instant::now();
                locator.locate_into(&pixels, black_box(&mut places));
                start.elapsed().as_secs_f64()
            })
            .collect();
        runs.sort_by(f64::total_cmp);
        1e9 * runs[4] / pixels.points() as f64
    }
}

fn on<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    if let [method, what, times, threads] = &given[..] {
        let world = World::new(method, 1_000_000);
        on(threads.parse().unwrap(), || {
            let (pixels, mut locator) = (world.pixels(), world.locator(what));
            let mut places = LocatedBatch::default();
            for _ in 0..times.parse::<u32>().unwrap() {
                locator.locate_into(&pixels, black_box(&mut places));
            }
        });
        return;
    }
    let figures = METHODS.map(|method| {
        let world = World::new(method, 1 << 18);
        let of = |what: &str| on(1, || world.nanoseconds(what));
        let all = ["points", "bars", "trust"].map(|what| format!("\"{what}\": {:.1}", of(what)));
        format!("\"{method}\": {{{}}}", all.join(", "))
    });
    println!("{{{}}}", figures.join(", "));
}
