//! Radii that a sample of squared distances shows.

use super::Ellipsoids;
use std::ops::Range;
use wheatstone_numeric::statistics::chi_square_upper_quantile;

/// Shares of the sample, the nearest first, that say something of the 68 % radius.
const INNER: Range<f64> = 0.2..0.9;

/// Of the 95 % radius; the farthest hundredth may be mistakes.
const OUTER: Range<f64> = 0.5..0.99;

/// Radii that a sample of squared distances shows; `None` where it shows none.
pub(super) fn radii(distances: &[f64]) -> Option<Ellipsoids> {
    let mut sorted: Vec<f64> = distances.to_vec();
    sorted.sort_by(f64::total_cmp);
    Some(Ellipsoids {
        radius2_68: radius2(&sorted, INNER, Ellipsoids::NORMAL.radius2_68)?,
        radius2_95: radius2(&sorted, OUTER, Ellipsoids::NORMAL.radius2_95)?,
    })
}

/// Where a straight line through the logarithms of the distances over those of chi-square's quantiles
/// has the quantile `normal`. Its two numbers, a scale and a power, describe lighter and heavier tails
/// alike, and vary less from sample to sample than the sample's own percentile. Each distance weighs by
/// how sure its place in the order is.
fn radius2(sorted: &[f64], shares: Range<f64>, normal: f64) -> Option<f64> {
    let (mut sum, mut sum_x, mut sum_y, mut sum_xx, mut sum_xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    // Of more points every second or third place in the order says the same.
    const PLACES: usize = 1000;
    let step = (sorted.len() / PLACES).max(1);
    for (rank, distance2) in sorted.iter().enumerate().step_by(step) {
        let share = (rank as f64 + 0.5) / sorted.len() as f64;
        if !shares.contains(&share) || *distance2 <= 0.0 {
            continue;
        }
        let quantile = chi_square_upper_quantile(1.0 - share, 3);
        let (x, y) = (libm::log(quantile / normal), libm::log(*distance2));
        // The variance of a quantile's logarithm is p (1 - p) / n over the square of the density of
        // that logarithm, which for chi-square of three is x^(3/2) exp(-x / 2) but for a factor.
        let density = quantile * quantile.sqrt() * libm::exp(-0.5 * quantile);
        let weight = density * density / (share * (1.0 - share));
        sum += weight;
        sum_x += weight * x;
        sum_y += weight * y;
        sum_xx += weight * x * x;
        sum_xy += weight * x * y;
    }
    let power = (sum * sum_xy - sum_x * sum_y) / (sum * sum_xx - sum_x * sum_x);
    let radius2 = libm::exp((sum_y - power * sum_x) / sum);
    (power > 0.0 && radius2 > 0.0 && radius2.is_finite()).then_some(radius2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::{random::Random, statistics::percentile};

    /// Powers of chi-square of three, with a scale.
    fn draws(scale: f64, power: f64, count: usize, seed: u64) -> Vec<f64> {
        let mut random = Random::new(seed);
        let mut square = || random.normal().powi(2);
        (0..count).map(|_| scale * libm::pow(square() + square() + square(), power)).collect()
    }

    #[test]
    fn any_scale_and_any_power_are_found() {
        for (scale, power) in [(1.0, 1.0), (0.6, 1.4), (2.0, 0.7)] {
            let found = radii(&draws(scale, power, 4000, 8)).unwrap();
            for (radius2, normal) in [(found.radius2_68, 3.506), (found.radius2_95, 7.815)] {
                let ratio: f64 = radius2 / (scale * libm::pow(normal, power));
                assert!((ratio - 1.0).abs() < 0.05, "{scale} {power} {found:?}");
            }
        }
    }

    #[test]
    fn the_line_scatters_less_than_the_percentile() {
        let spread = |values: &[f64]| {
            let logs: Vec<f64> = values.iter().map(|value| libm::log(*value)).collect();
            let mean = logs.iter().sum::<f64>() / logs.len() as f64;
            logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>()
        };
        let samples: Vec<Vec<f64>> = (0..200).map(|seed| draws(1.0, 1.0, 400, seed)).collect();
        let of = |radius2: &dyn Fn(&[f64]) -> f64| -> f64 {
            spread(&samples.iter().map(|sample| radius2(sample)).collect::<Vec<_>>())
        };
        let (line, inner) =
            (of(&|sample| radii(sample).unwrap().radius2_68), of(&|s| percentile(s, 0.68)));
        let (far_line, outer) =
            (of(&|sample| radii(sample).unwrap().radius2_95), of(&|s| percentile(s, 0.95)));
        assert!(line < 0.8 * inner && far_line < 0.9 * outer, "{line} {inner} {far_line} {outer}");
    }

    #[test]
    fn a_sample_without_spread_shows_nothing() {
        assert_eq!(radii(&[]), None);
        assert_eq!(radii(&[0.0; 100]), None);
    }
}
