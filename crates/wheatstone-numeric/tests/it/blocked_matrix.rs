//! Products of matrices kept in blocks.

use nalgebra::DMatrix;
use wheatstone_numeric::{blocked_matrix::BlockedMatrix, random::Random};

fn drawn(rows: usize, columns: usize) -> BlockedMatrix {
    let mut random = Random::new((rows * columns) as u64);
    let mut panels = BlockedMatrix::zeros(rows, columns);
    for row in 0..rows {
        (0..columns).for_each(|column| panels.set(row, column, random.normal()));
    }
    panels
}

fn plain(panels: &BlockedMatrix) -> DMatrix<f64> {
    let (rows, columns) = panels.shape();
    DMatrix::from_fn(rows, columns, |row, column| panels.get(row, column))
}

#[test]
fn products_are_those_of_the_plain_matrices() {
    for (rows, others, columns) in [(1, 3, 2), (8, 9, 16), (21, 5, 37)] {
        let (left, right) = (drawn(rows, columns), drawn(others, columns));
        let gap = left.product(&right) - plain(&left) * plain(&right).transpose();
        assert!(gap.norm() < 1e-12);
        let gap = left.square() - plain(&left) * plain(&left).transpose();
        assert!(gap.norm() < 1e-12);
    }
}
