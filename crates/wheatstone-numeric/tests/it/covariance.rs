//! Covariances beside those of plain matrices and of repeated fits.

use nalgebra::DMatrix;
use wheatstone_numeric::{
    covariance::{Covariance, LeastSquaresCovariance},
    least_squares::solve,
    random::Random,
    statistics::root_mean_square,
};

#[test]
fn the_triangle_is_the_matrix() {
    let mut random = Random::new(3);
    let root = DMatrix::from_fn(6, 6, |_, _| random.normal());
    let matrix = &root * root.transpose();
    let slopes: Vec<[f64; 2]> = (0..6).map(|_| [random.normal(), random.normal()]).collect();
    let rows = DMatrix::from_fn(2, 6, |row, column| slopes[column][row]);
    let wanted = &rows * &matrix * rows.transpose();
    let kept = Covariance::of(&matrix);
    assert!((kept.of_two(&slopes) - wanted.fixed_view::<2, 2>(0, 0)).norm() < 1e-12 * 50.0);
    let first: Vec<f64> = slopes.iter().map(|slope| slope[0]).collect();
    assert!((kept.of_one(&first) - wanted[(0, 0)]).abs() < 1e-10);
    assert!(kept.is_sound(6) && !kept.is_sound(5));
    let negative: Covariance = serde_json::from_str("[1.0, 0.0, -1.0]").unwrap();
    assert!(!negative.is_sound(2));
}

#[test]
fn a_lines_covariance_is_that_of_repeated_fits() {
    let mut random = Random::new(4);
    // y = a + b x, errors growing with x, fitted as if they did not.
    let places: Vec<f64> = (0..30).map(|index| f64::from(index) / 29.0).collect();
    let sigma = |x: f64| 0.1 + 0.5 * x;
    let mut spread = LeastSquaresCovariance::new(2);
    places.iter().for_each(|x| spread.add(&[1.0, *x], sigma(*x).powi(2)));
    let covariance = spread.covariance().unwrap();
    let design: Vec<f64> = places.iter().flat_map(|x| [1.0, *x]).collect();
    let draws: Vec<f64> = (0..4000)
        .map(|_| {
            let y: Vec<f64> = places.iter().map(|x| sigma(*x) * random.normal()).collect();
            let line = solve(&design, 2, &y, 1).unwrap();
            line[0] + 2.0 * line[1]
        })
        .collect();
    let scatter = root_mean_square(&draws);
    assert!((covariance.of_one(&[1.0, 2.0]).sqrt() / scatter - 1.0).abs() < 0.05);
}

/// Two unknowns that do nearly the same: their own variances are a ten thousand millionth of what rounding would have to
/// leave alone, and what they predict together is known as well as ever.
#[test]
fn predictions_of_unknowns_that_are_nearly_one_are_known() {
    const APART: f64 = 1e-5;
    let (mut near, mut plain) = (LeastSquaresCovariance::new(2), LeastSquaresCovariance::new(2));
    for index in 0..200 {
        let x = f64::from(index) / 100.0 - 1.0;
        let variance = 1.0 + 0.5 * x;
        near.add(&[1.0, 1.0 + APART * x], variance);
        plain.add(&[1.0, x], variance);
    }
    let (near, plain) = (near.covariance().unwrap(), plain.covariance().unwrap());
    for x in [-1.0, -0.3, 0.4, 1.0] {
        let (told, truth) = (near.of_one(&[1.0, 1.0 + APART * x]), plain.of_one(&[1.0, x]));
        assert!((told / truth - 1.0).abs() < 1e-3, "{x}: {told} {truth}");
    }
}
