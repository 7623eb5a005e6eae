//! Reweighted least squares beside plain ones.

use wheatstone_numeric::{least_squares::solve, random::Random, reweighted::Reweighted};

/// Powers of places, which are far from orthogonal; the last column again, so that two are not told apart.
fn matrix(rows: usize) -> Vec<f64> {
    let mut random = Random::new(4);
    let row = |x: f64| [1.0, x, x * x, x * x * x, x * x * x];
    (0..rows).flat_map(|_| row(random.uniform(1.0, 3.0))).collect()
}

#[test]
fn fits_as_the_plain_solution_of_the_weighted_rows_does() {
    const RIDGE: f64 = 1e-5;
    let (a, mut random) = (matrix(60), Random::new(5));
    let mut problem = Reweighted::new(&a, 5, RIDGE, 1000).unwrap();
    for terms in [3, 5, 4] {
        let weights: Vec<f64> = (0..60).map(|_| libm::exp(3.0 * random.normal())).collect();
        let sides: Vec<[f64; 2]> = (0..60).map(|_| [random.normal(), 5.0]).collect();
        let (mut left, mut right) = (Vec::new(), Vec::new());
        for ((row, weight), side) in a.chunks_exact(5).zip(&weights).zip(&sides) {
            left.extend(row[..terms].iter().map(|value| value * weight.sqrt()));
            right.extend(side.map(|value| value * weight.sqrt()));
        }
        for own in 0..terms {
            left.extend((0..terms).map(|column| if column == own { RIDGE } else { 0.0 }));
            right.extend([0.0; 2]);
        }
        let wanted = solve(&left, terms, &right, 2).unwrap();
        let found = problem.fitted(terms, &weights, &sides).unwrap();
        for (row, found) in a.chunks_exact(5).zip(&found) {
            for side in 0..2 {
                let at = (0..terms).map(|term| row[term] * wanted[(term, side)]).sum::<f64>();
                assert!((at - found[side]).abs() < 1e-8, "{terms} terms: {at} {found:?}");
            }
        }
    }
    assert!(problem.fitted(5, &[f64::NAN; 60], &[[0.0]; 60]).is_none());
    assert!(Reweighted::new(&[f64::INFINITY, 1.0], 1, RIDGE, 9).is_none());
}

#[test]
fn of_many_rows_a_part_is_fitted_and_all_are_told() {
    let a = matrix(1000);
    let side: Vec<[f64; 1]> = a.chunks_exact(5).map(|row| [row[1] - 2.0 * row[3]]).collect();
    let fitted = Reweighted::new(&a, 5, 1e-9, 100).unwrap();
    let found = fitted.clone().fitted(5, &[1.0; 1000], &side).unwrap();
    assert!(found.iter().zip(&side).all(|(a, b)| (a[0] - b[0]).abs() < 1e-7));
}
