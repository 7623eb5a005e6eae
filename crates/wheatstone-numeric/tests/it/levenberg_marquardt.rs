//! Minima of functions whose minimum is known.

use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Minimum, NormalEquations, Patience, minimise},
    progress::Silent,
};

/// Fits y = f(x, p) to exact or noisy data with derivatives by differences.
fn fit(f: impl Fn(f64, &[f64]) -> f64, data: &[(f64, f64)], start: &[f64]) -> Minimum {
    minimise(start, Patience { steps: 2000, least_gain: 1e-15 }, &Silent, |p, normal| {
        let mut cost = 0.0;
        for (x, y) in data {
            let residual = f(*x, p) - y;
            cost += 0.5 * residual * residual;
            let slope = |index: usize| {
                let step = 1e-6 * (1.0 + p[index].abs());
                let at = |by: f64| {
                    let mut moved = p.to_vec();
                    moved[index] += by;
                    f(*x, &moved)
                };
                (at(step) - at(-step)) / (2.0 * step)
            };
            normal.add(&(0..p.len()).map(slope).collect::<Vec<_>>(), residual);
        }
        Some(cost)
    })
    .unwrap()
}

#[test]
fn solves_nist_misra1a_from_its_far_start() {
    // NIST StRD nonlinear regression, Misra1a: certified b1 238.94212918, b2 5.5015643181e-4.
    let y = [
        10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47,
        81.78,
    ];
    let x = [
        77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1,
        760.0,
    ];
    let data: Vec<(f64, f64)> = x.into_iter().zip(y).collect();
    let found = fit(|x, p| p[0] * (1.0 - libm::exp(-p[1] * x)), &data, &[500.0, 1e-4]);
    assert!((found.parameters[0] / 238.942_129_18 - 1.0).abs() < 1e-7, "{found:?}");
    assert!((found.parameters[1] / 5.501_564_318_1e-4 - 1.0).abs() < 1e-7);
    assert!((2.0 * found.cost / 0.124_551_388_94 - 1.0).abs() < 1e-8);
}

#[test]
fn crosses_rosenbrocks_valley() {
    let rosenbrock = |p: &[f64]| [10.0 * (p[1] - p[0] * p[0]), 1.0 - p[0]];
    let found = minimise(&[-1.2, 1.0], Patience::default(), &Silent, |p, normal| {
        let r = rosenbrock(p);
        normal.add(&[-20.0 * p[0], 10.0], r[0]);
        normal.add_sparse(&[(0, -1.0)], r[1]);
        Some(0.5 * (r[0] * r[0] + r[1] * r[1]))
    })
    .unwrap();
    assert!(found.parameters.iter().all(|p| (p - 1.0).abs() < 1e-9), "{found:?}");
}

#[test]
fn rows_add_up_to_the_normal_equations() {
    let mut dense = NormalEquations::new(3);
    let mut sparse = dense.clone();
    dense.add(&[1.0, 0.0, 3.0], 2.0);
    sparse.add_sparse(&[(2, 3.0), (0, 1.0)], 2.0);
    assert_eq!(dense.matrix(), sparse.matrix());
    assert_eq!(dense.matrix()[(0, 2)], 3.0);
    assert_eq!(dense.gradient().as_slice(), [2.0, 0.0, 6.0]);
    // The unknowns in another order, and one between that is none.
    let row = [3.0, 1.0, 7.0, 0.0, 2.0];
    let products = row.map(|one| row.map(|other| one * other));
    let mut whole = NormalEquations::new(3);
    whole.add_square(&[1, 3, 0], 4, &products);
    assert_eq!((whole.matrix(), whole.gradient()), (dense.matrix(), dense.gradient()));
}

#[test]
fn a_search_without_damping_is_damped_at_once_where_a_step_fails() {
    let mut damping = Damping::undamped();
    damping.accept(1.0);
    assert_eq!(damping.value, 0.0);
    // From next to nothing it would take a dozen failed steps to hold anything back.
    damping.reject();
    assert_eq!(damping.value, 1e-3);
    damping.reject();
    assert!((damping.value / 1e-2 - 1.0).abs() < 1e-12);
}

#[test]
fn nielsens_damping_falls_by_kept_promises_and_rises_ever_faster() {
    let mut damping = Damping::nielsen(1.0, 1.0 / 3.0);
    // 1 - (2 q - 1)^3 at q = 1, 1/2 and 0.
    for (quality, share) in [(1.0, 1.0 / 3.0), (0.5, 1.0), (0.0, 2.0)] {
        let before = damping.value;
        damping.accept(quality);
        assert!((damping.value / before - share).abs() < 1e-12, "{quality}");
    }
    for factor in [2.0, 4.0, 8.0] {
        let before = damping.value;
        damping.reject();
        assert_eq!(damping.value, factor * before);
    }
}
