//! How an error grows with the distance: the exponent of the growth, and its confidence interval.

use super::results::{BeyondPoint, Growth, TRAINED_TO};
use wheatstone_numeric::least_squares::solve;

/// Exponents that are tried: from nearly constant to far steeper than any claim.
const STEP: f64 = 0.01;
const GREATEST: f64 = 8.0;

/// The F distribution's 95 % quantile for one degree of freedom and as many as eleven distances leave after two
/// numbers of the curve, or three.
const F_9: f64 = 5.117;
const F_8: f64 = 5.318;

/// The exponent p of `b Z^p`, by least squares, of a value at each distance.
pub(super) fn power(points: &[BeyondPoint], value: fn(&BeyondPoint) -> f64) -> Growth {
    let basis = |p: f64| move |z: f64| vec![libm::pow(z / TRAINED_TO, p)];
    profile(points, value, &|p| left(points, value, &basis(p)), F_9 / 9.0)
}

/// The exponent p of `a + b (Z - 140)^p`, of growth beyond the trained range.
pub(super) fn beyond(points: &[BeyondPoint], value: fn(&BeyondPoint) -> f64) -> Growth {
    let basis = |p: f64| move |z: f64| vec![1.0, libm::pow(z - TRAINED_TO, p)];
    profile(points, value, &|p| left(points, value, &basis(p)), F_8 / 8.0)
}

/// The exponent that leaves the least sum of squares, and those whose sum is not significantly larger (the profile
/// of the likelihood: Bates & Watts 1988, doi:10.1002/9780470316757, chapter 6).
fn profile(
    points: &[BeyondPoint],
    value: fn(&BeyondPoint) -> f64,
    left: &dyn Fn(f64) -> f64,
    allowance: f64,
) -> Growth {
    let exponents = (1..=(GREATEST / STEP) as u32).map(|index| f64::from(index) * STEP);
    let sums: Vec<(f64, f64)> = exponents.map(|exponent| (exponent, left(exponent))).collect();
    let best = sums.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, 0.0));
    // Rounding leaves something of the most perfect of curves.
    let rounding = 1e-18 * points.iter().map(|point| value(point).powi(2)).sum::<f64>();
    let most = best.1 * (1.0 + allowance) + rounding;
    let within = || sums.iter().filter(|(_, sum)| *sum <= most).map(|(exponent, _)| *exponent);
    let interval = [within().fold(best.0, f64::min), within().fold(best.0, f64::max)];
    Growth { exponent: best.0, interval }
}

/// The sum of squares that the best growing curve of a form leaves.
fn left(
    points: &[BeyondPoint],
    value: fn(&BeyondPoint) -> f64,
    basis: &dyn Fn(f64) -> Vec<f64>,
) -> f64 {
    let rows: Vec<f64> = points.iter().flat_map(|point| basis(point.distance)).collect();
    let values: Vec<f64> = points.iter().map(value).collect();
    let columns = rows.len() / points.len().max(1);
    let Some(fit) = solve(&rows, columns, &values, 1) else { return f64::INFINITY };
    if fit[columns - 1] < 0.0 {
        return f64::INFINITY;
    }
    let curve = |row: &[f64]| row.iter().zip(&fit).map(|(row, fit)| row * fit).sum::<f64>();
    rows.chunks(columns).zip(&values).map(|(row, value)| (value - curve(row)).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    fn points(noise: f64, percent: impl Fn(f64) -> f64) -> Vec<BeyondPoint> {
        let mut random = Random::new(4);
        let at = |step: u32| {
            let distance = 150.0 + 5.0 * f64::from(step);
            let percent = percent(distance) * (1.0 + noise * random.normal());
            BeyondPoint { distance, percent, error: 0.01 * percent * distance }
        };
        (0..=10).map(at).collect()
    }

    #[test]
    fn exponents_are_found_and_intervals_hold_them() {
        let percent: fn(&BeyondPoint) -> f64 = |point| point.percent;
        let error: fn(&BeyondPoint) -> f64 = |point| point.error;
        for truth in [1.0, 1.5, 2.0] {
            let exact = beyond(&points(0.0, |z| 4.0 + 0.1 * libm::pow(z - 140.0, truth)), percent);
            assert!((exact.exponent - truth).abs() < 0.011, "{exact:?}");
            assert!(exact.interval[1] - exact.interval[0] < 0.1, "{exact:?}");
            // In percent one power less than in centimetres.
            let exact = power(&points(0.0, |z| 1e-3 * libm::pow(z, truth - 1.0)), error);
            assert!((exact.exponent - truth).abs() < 0.011, "{exact:?}");
            let noisy = power(&points(0.02, |z| 1e-3 * libm::pow(z, truth - 1.0)), error);
            let [low, high] = noisy.interval;
            assert!(low < truth && truth < high && high - low > 0.1, "{noisy:?}");
        }
    }

    #[test]
    fn an_error_that_falls_has_no_growth() {
        let found = beyond(&points(0.0, |z| 30.0 - 0.1 * z), |point| point.percent);
        assert!(found.exponent < 0.1, "{found:?}");
    }
}
