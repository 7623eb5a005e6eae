//! How long the network's kernels take, on the paper's network (4-8-8-3) and 400 pairs:
//! `cargo bench --bench kernels` prints one JSON object of microseconds, the median of nine runs each.
//! With `-- training single 100000` it trains so many epochs and prints the error, and with
//! `-- steps 210` it takes so many Levenberg-Marquardt steps, in runs of fifteen, so that the evidence, which no
//! other program works out, is asked for once in fifteen steps: `bench/peers/network.py` runs those beside
//! other programs and compares CPU seconds.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for developers: its figures go to standard output, and it may panic"
)]

use std::{hint::black_box, time::Instant};
use wheatstone::numeric::{
    backpropagation::{Backpropagation, Precision},
    cholesky::{Cholesky, Lower},
    evidence::TrainingCurve,
    perceptron::{
        Batch, Curvature, Forward, GradientPass, OutputActivation, Perceptron, Workspace,
    },
    progress::Silent,
    random::Random,
    simd::Real,
};

const SIZES: [usize; 4] = [4, 8, 8, 3];

/// The world of `bench/peers/training.c`: smooth targets of four numbers in 0..1.
fn lesson(random: &mut Random) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    (0..400)
        .map(|_| {
            let x: Vec<f64> = (0..4).map(|_| random.uniform(0.0, 1.0)).collect();
            let targets = vec![
                0.5 * (x[0] + x[1] * x[2]),
                0.5 * (x[1] + x[3] * x[0]),
                0.3 / (0.5 + x[0] * x[2]),
            ];
            (x, targets)
        })
        .unzip()
}

/// Median microseconds of nine runs of `times` calls.
fn median(times: u32, mut call: impl FnMut()) -> f64 {
    let mut runs: Vec<f64> = (0..9)
        .map(|_| {
            let start = Instant::now();
            (0..times).for_each(|_| call());
            start.elapsed().as_secs_f64() / f64::from(times)
        })
        .collect();
    runs.sort_by(f64::total_cmp);
    1e6 * runs[4]
}

/// Of a hundred thousand points through the network.
fn forward<T: Real>(network: &Perceptron, random: &mut Random) -> f64 {
    let mut column =
        || -> Vec<T> { (0..100_000).map(|_| T::nearest(random.uniform(0.0, 1.0))).collect() };
    let inputs = [column(), column(), column(), column()];
    let inputs: Vec<&[T]> = inputs.iter().map(Vec::as_slice).collect();
    let mut outputs = vec![vec![T::default(); 100_000]; 3];
    let mut outputs: Vec<&mut [T]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
    let forward = Forward::<T>::new(network);
    median(20, || forward.columns(&inputs, &mut outputs))
}

fn kernels(network: &Perceptron, batch: &Batch, random: &mut Random) {
    let weights = network.weights();
    let mut gradient = vec![0.0; weights.len()];
    let mut single = GradientPass::<f32>::new(network, batch);
    let mut double = GradientPass::<f64>::new(network, batch);
    let mut curvature = Curvature::new(network, batch);
    let mut hessian = Lower::zeros(weights.len());
    let mut work = Workspace::new(&SIZES);
    curvature.hessian(weights, &[1.0; 3], &mut hessian);
    let positive = hessian.clone();
    let factors = Cholesky::of(positive.clone(), |_| 1.0).unwrap();
    let mut buffer = gradient.clone();
    let figures = [
        ("pass_single", median(1000, || _ = single.run(weights, &[1.0; 3], &mut gradient))),
        ("pass_double", median(500, || _ = double.run(weights, &[1.0; 3], &mut gradient))),
        (
            "pass_plain",
            median(100, || _ = network.mean_square_error(batch, &mut gradient, &mut work)),
        ),
        ("hessian", median(100, || curvature.hessian(weights, &[1.0; 3], &mut hessian))),
        ("cholesky", median(200, || _ = black_box(Cholesky::of(positive.clone(), |_| 1.0)))),
        ("diagonal_of_inverse", median(200, || _ = black_box(factors.diagonal_of_inverse()))),
        ("solve", median(1000, || buffer = factors.solve(&buffer))),
        ("forward_single_100000", forward::<f32>(network, random)),
        ("forward_double_100000", forward::<f64>(network, random)),
    ];
    let figures = figures.map(|(name, microseconds)| format!("\"{name}\": {microseconds:.2}"));
    println!("{{{}}}", figures.join(", "));
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let mut random = Random::new(1);
    let (inputs, targets) = lesson(&mut random);
    let batch = Batch::new(&inputs, &targets);
    let mut network = Perceptron::nguyen_widrow(&SIZES, 1.0, OutputActivation::Linear, &mut random);
    match given.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["training", precision, epochs] => {
            let precision =
                if precision == "single" { Precision::Single } else { Precision::Double };
            let epochs = epochs.parse().unwrap();
            let settings = Backpropagation { epochs, precision, ..Backpropagation::default() };
            let mut error = 0.0;
            settings
                .train(&mut network, &batch, &Silent, &mut |point, _| {
                    error = point.mean_square_error;
                })
                .unwrap();
            println!("{{\"error\": {error:e}}}");
        }
        ["steps", steps] => {
            const RUN: u64 = 16;
            let mut last = 0.0;
            for _ in 0..steps.parse::<u64>().unwrap() / RUN {
                let mut course = TrainingCurve::new(network.clone(), &batch);
                course.go_on((RUN, f64::NEG_INFINITY), &Silent).unwrap();
                last = course.log_evidence();
            }
            println!("{{\"log_evidence\": {last}}}");
        }
        _ => kernels(&network, &batch, &mut random),
    }
}
