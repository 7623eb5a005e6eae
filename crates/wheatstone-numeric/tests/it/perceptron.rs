//! Perceptrons, their gradients and their starts.

mod curvature;
mod forward;
mod jacobian;

use wheatstone_numeric::{
    perceptron::{Batch, OutputActivation, Perceptron, Workspace},
    random::Random,
};

fn rows(n: usize, width: usize, random: &mut Random) -> Vec<Vec<f64>> {
    (0..n).map(|_| (0..width).map(|_| random.uniform(0.0, 1.0)).collect()).collect()
}

#[test]
fn gradient_agrees_with_differences_for_every_shape() {
    let shapes: [&[usize]; 4] = [&[4, 8, 8, 3], &[6, 5, 3], &[2, 1], &[4, 3, 2, 5, 1]];
    for (seed, sizes) in shapes.into_iter().enumerate() {
        for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
            let mut random = Random::new(seed as u64);
            let mut net = Perceptron::nguyen_widrow(sizes, 1.3, output, &mut random);
            // 37 samples: two full blocks and one that is padded.
            let inputs = rows(37, sizes[0], &mut random);
            let targets = rows(37, sizes[sizes.len() - 1], &mut random);
            let batch = Batch::new(&inputs, &targets);
            let mut work = Workspace::new(sizes);
            let mut gradient = vec![0.0; net.weights().len()];
            net.mean_square_error(&batch, &mut gradient, &mut work);
            let weights = net.weights().to_vec();
            let mut error_at = |index: usize, step: f64| {
                let mut moved = weights.clone();
                moved[index] += step;
                net.set_weights(&moved);
                let squares = inputs.iter().zip(&targets).flat_map(|(x, t)| {
                    net.evaluate(x).into_iter().zip(t.clone()).map(|(o, t)| (o - t) * (o - t))
                });
                squares.sum::<f64>() / (37 * sizes[sizes.len() - 1]) as f64
            };
            for (index, slope) in gradient.iter().enumerate() {
                let step = 1e-5;
                let difference = (error_at(index, step) - error_at(index, -step)) / (2.0 * step);
                assert!(
                    (slope - difference).abs() < 1e-8,
                    "{sizes:?} {output:?} weight {index}: {slope} against {difference}"
                );
            }
        }
    }
}

#[test]
fn batch_error_is_the_reference_error() {
    let mut random = Random::new(3);
    let net = Perceptron::nguyen_widrow(&[4, 8, 8, 3], 1.0, OutputActivation::Linear, &mut random);
    let (inputs, targets) = (rows(50, 4, &mut random), rows(50, 3, &mut random));
    let mut gradient = vec![0.0; net.weights().len()];
    let error = net.mean_square_error(
        &Batch::new(&inputs, &targets),
        &mut gradient,
        &mut Workspace::new(net.sizes()),
    );
    let reference = inputs
        .iter()
        .zip(&targets)
        .flat_map(|(x, t)| net.evaluate(x).into_iter().zip(t.clone()))
        .map(|(o, t)| (o - t) * (o - t))
        .sum::<f64>()
        / 150.0;
    assert!((error - reference).abs() < 1e-14 * reference);
}

#[test]
fn nguyen_widrow_spreads_the_active_ranges_over_the_inputs() {
    let mut random = Random::new(5);
    let net = Perceptron::nguyen_widrow(&[1, 9, 1], 1.0, OutputActivation::Linear, &mut random);
    // Each unit is at one half somewhere; those places must reach across 0..1.
    let (weights, biases) = (&net.weights()[..9], &net.weights()[9..18]);
    let centres: Vec<f64> = weights.iter().zip(biases).map(|(w, b)| -b / w).collect();
    assert!(centres.iter().all(|c| (-0.01..=1.01).contains(c)), "{centres:?}");
    let spread = centres.iter().fold(0.0_f64, |most, c| most.max((c - 0.5).abs()));
    assert!(spread > 0.4, "{centres:?}");
}
