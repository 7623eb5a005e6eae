//! Statistics beside printed tables.

use wheatstone_numeric::statistics::{
    chi_square_beyond, chi_square_upper_quantile, mean, median, percentile, root_mean_square,
};

#[test]
fn chi_square_quantiles_are_those_of_the_tables() {
    // Abramowitz & Stegun 1964, table 26.8, which has five or six digits.
    for (freedom, rate, value) in [
        (1, 0.05, 3.84146),
        (1, 0.01, 6.63490),
        (1, 0.001, 10.828),
        (2, 0.05, 5.99147),
        (3, 0.05, 7.81473),
        (3, 0.001, 16.266),
        (5, 0.95, 1.145476),
        (5, 0.001, 20.515),
        (7, 0.01, 18.4753),
        (13, 0.001, 34.528),
        (30, 0.5, 29.3360),
        (100, 0.05, 124.342),
    ] {
        let found = chi_square_upper_quantile(rate, freedom);
        assert!((found / value - 1.0).abs() < 5e-5, "{freedom} {rate}: {found}, not {value}");
        assert!((chi_square_beyond(found, freedom) / rate - 1.0).abs() < 1e-9);
    }
    // With two degrees of freedom it is an exponential distribution, far out as well.
    for rate in [1e-12, 1e-6, 0.3, 0.9] {
        let exact = -2.0 * libm::log(rate);
        assert!((chi_square_upper_quantile(rate, 2) / exact - 1.0).abs() < 1e-9, "{rate}");
    }
    assert_eq!(chi_square_upper_quantile(0.0, 3), f64::INFINITY);
    assert_eq!(chi_square_beyond(0.0, 3), 1.0);
}

#[test]
fn summaries_of_a_known_sample() {
    let values = [4.0, 1.0, 3.0, 2.0];
    assert_eq!(median(&values), 2.5);
    assert_eq!(percentile(&values, 0.0), 1.0);
    assert_eq!(percentile(&values, 1.0), 4.0);
    assert_eq!(mean(&values), 2.5);
    assert_eq!(root_mean_square(&[3.0, -4.0]), 12.5_f64.sqrt());
    assert_eq!(median(&[]), 0.0);
}
