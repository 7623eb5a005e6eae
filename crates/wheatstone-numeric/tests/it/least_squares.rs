//! Least squares that are factored once.

use nalgebra::DVector;
use wheatstone_numeric::{
    least_squares::{Factored, null_direction, null_vector, solve},
    random::Random,
};

#[test]
fn what_is_factored_once_solves_as_what_is_solved_once() {
    let mut random = Random::new(3);
    let a: Vec<f64> = (0..60).map(|_| random.normal()).collect();
    let factored = Factored::new(&a, 4).unwrap();
    for _ in 0..3 {
        let b: Vec<f64> = (0..15).map(|_| random.normal()).collect();
        let wanted = solve(&a, 4, &b, 1).unwrap();
        assert!((factored.solve(&b).unwrap() - wanted.column(0)).norm() < 1e-13);
    }
    assert!(factored.solve(&[f64::NAN; 15]).is_none());
    assert!(Factored::new(&[1.0, 2.0, 2.0, 4.0, 3.0, 6.0], 2).is_none());
}

#[test]
fn finds_the_direction_that_a_matrix_forgets() {
    let mut random = Random::new(8);
    let hidden = DVector::from_vec(vec![0.5, -0.5, 0.5, 0.5]);
    for height in [3, 4, 50] {
        let rows: Vec<f64> = (0..height)
            .flat_map(|_| {
                let row = DVector::from_fn(4, |_, _| random.normal());
                (&row - &hidden * row.dot(&hidden)).iter().copied().collect::<Vec<_>>()
            })
            .collect();
        let found = null_vector(&rows, 4).unwrap();
        let overlap = found.vector.dot(&hidden).abs();
        assert!((overlap - 1.0).abs() < 1e-12, "{height} rows: {found:?}");
        assert!(found.least < 1e-12 && found.is_determined());
        let iterated = null_direction(&rows, 4);
        assert_eq!(iterated.is_some(), height > 4);
        let overlap = iterated.map_or(1.0, |vector| vector.dot(&hidden).abs());
        assert!((overlap - 1.0).abs() < 1e-12, "{height} rows");
    }
    assert!(null_vector(&[1.0, 2.0, 3.0, 4.0], 4).is_none());
    let twice = [1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 3.0, 6.0, 9.0];
    assert!(!null_vector(&twice, 3).unwrap().is_determined());
}

#[test]
fn solves_an_overdetermined_system_and_refuses_a_deficient_one() {
    let a = [1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0];
    let b = [1.0, 3.0, 5.0, 7.0];
    let x = solve(&a, 2, &b, 1).unwrap();
    assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12);
    assert!(solve(&[1.0, 2.0, 2.0, 4.0, 3.0, 6.0], 2, &[1.0, 2.0, 3.0], 1).is_none());
}
