//! Curvature beside that of the plain Jacobian.

use nalgebra::{DMatrix, DVector};
use wheatstone_numeric::{
    cholesky::Lower,
    perceptron::{Batch, Curvature, OutputActivation, Perceptron},
    random::Random,
};

/// More than one portion of 80, and the last one not full.
const SAMPLES: usize = 101;

fn world(sizes: &[usize], output: OutputActivation) -> (Perceptron, Vec<Vec<f64>>, Batch) {
    let mut random = Random::new(9);
    let network = Perceptron::nguyen_widrow(sizes, 1.2, output, &mut random);
    let inputs: Vec<Vec<f64>> =
        (0..SAMPLES).map(|_| (0..sizes[0]).map(|_| random.uniform(0.0, 1.0)).collect()).collect();
    let targets = vec![vec![0.0; sizes[sizes.len() - 1]]; inputs.len()];
    let batch = Batch::new(&inputs, &targets);
    (network, inputs, batch)
}

#[test]
fn is_that_of_the_plain_jacobian_for_every_shape() {
    let shapes: [&[usize]; 5] = [&[4, 8, 8, 3], &[6, 9, 2], &[2, 1], &[3, 2, 5, 4, 1], &[1, 12, 2]];
    for sizes in shapes {
        for output in [OutputActivation::Linear, OutputActivation::Sigmoid] {
            let (network, inputs, batch) = world(sizes, output);
            let (count, outputs) = (network.weights().len(), sizes[sizes.len() - 1]);
            let variances: Vec<f64> = (0..outputs).map(|o| 0.5 + o as f64).collect();
            let mut wanted = DMatrix::zeros(count, count);
            let mut rows = vec![0.0; outputs * count];
            for input in &inputs {
                network.jacobian(input, &mut rows);
                for (row, variance) in rows.chunks_exact(count).zip(&variances) {
                    let row = DVector::from_column_slice(row);
                    wanted += &row * row.transpose() / *variance;
                }
            }
            let mut found = Lower::zeros(count);
            let mut curvature = Curvature::new(&network, &batch);
            // Twice: nothing of the first pass may be left.
            for _ in 0..2 {
                curvature.hessian(network.weights(), &variances, &mut found);
            }
            let found = DMatrix::from_fn(count, count, |i, j| found.get(i.max(j), i.min(j)));
            assert!((&found - &wanted).norm() < 1e-13 * wanted.norm(), "{sizes:?} {output:?}");
        }
    }
}
