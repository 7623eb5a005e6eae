//! Factors beside those of plain matrices.

use nalgebra::{DMatrix, DVector};
use wheatstone_numeric::{blocked_matrix::BlockedMatrix, cholesky::Cholesky, random::Random};

fn positive(size: usize) -> DMatrix<f64> {
    let mut random = Random::new(size as u64);
    let square = DMatrix::from_fn(size, size, |_, _| random.normal());
    &square * square.transpose()
}

#[test]
fn agrees_with_the_plain_factors_at_sizes_about_the_panels() {
    for size in [1, 7, 8, 9, 16, 31, 139] {
        let matrix = positive(size);
        let more = |index: usize| 1.0 + 0.01 * index as f64;
        let whole = &matrix + DMatrix::from_diagonal(&DVector::from_fn(size, |i, _| more(i)));
        let reference = whole.clone().cholesky().unwrap();
        let found = Cholesky::new(&matrix.lower_triangle(), more).unwrap();
        let right = DVector::from_fn(size, |i, _| libm::sin(i as f64));
        let solved = DVector::from_vec(found.solve(right.as_slice()));
        assert!((&whole * &solved - &right).norm() <= 1e-11 * right.norm());
        let mut rows = BlockedMatrix::zeros(3, size);
        (0..size).for_each(|index| rows.set(1, index, right[index]));
        found.take_lower(&mut rows);
        let half = (0..size).map(|index| rows.get(1, index).powi(2)).sum::<f64>();
        assert!((half - right.dot(&solved)).abs() <= 1e-11 * half);
        found.take_upper(&mut rows);
        let gap = |index: usize| (rows.get(1, index) - solved[index]).abs();
        assert!((0..size).all(|index| gap(index) <= 1e-11 * solved.norm()));
        assert!((found.inverse() - reference.inverse()).norm() < 1e-11 * size as f64);
        let diagonal = DVector::from_vec(found.diagonal_of_inverse());
        assert!((diagonal - reference.inverse().diagonal()).norm() < 1e-11);
        let determinant = 2.0 * reference.l().diagonal().iter().map(|d| libm::log(*d)).sum::<f64>();
        assert!((found.log_determinant() - determinant).abs() < 1e-9);
    }
}

#[test]
fn what_is_not_positive_definite_has_no_factors() {
    let matrix = positive(20);
    assert!(Cholesky::new(&matrix, |_| 0.1).is_some());
    assert!(Cholesky::new(&matrix, |i| if i == 11 { -1e3 } else { 0.1 }).is_none());
    assert!(Cholesky::new(&matrix, |i| if i == 3 { f64::NAN } else { 0.1 }).is_none());
    assert!(Cholesky::new(&matrix, |i| if i == 19 { f64::INFINITY } else { 0.1 }).is_none());
}
