//! Whether pixels belong together: whether their rays miss each other by more than noise makes them.

use super::Reconstructor;
use crate::{dataset::Dataset, numeric::statistics::chi_square_upper_quantile};

/// No detector or matcher is better than this many pixels (sub-pixel detectors end at a hundredth), so
/// that what misses by less is no sign of a wrong match, whatever the fit's own points say.
const LEAST_SIGMA: f64 = 0.01;

/// The residual, in pixels, that a true match exceeds with probability `rate` at most, where the
/// standard deviation of a pixel coordinate is `sigma`. A point takes three of the two numbers of each
/// of `n = cameras_seen` cameras, so that `2 n residual^2 / sigma^2` is chi-square with `2 n - 3` degrees
/// of freedom. Infinite for fewer than two cameras. Errors from rounding are bounded, which keeps the
/// rate lower still.
#[must_use]
pub fn largest_residual(sigma: f64, cameras_seen: usize, rate: f64) -> f64 {
    if cameras_seen < 2 {
        return f64::INFINITY;
    }
    let numbers = 2 * cameras_seen;
    let limit = chi_square_upper_quantile(rate, numbers - 3);
    sigma.max(LEAST_SIGMA) * (limit / numbers as f64).sqrt()
}

/// Whether a point's residual is larger than chance makes it: see [`largest_residual`]. A residual that
/// does not exist (NaN) says nothing.
#[must_use]
pub fn is_mismatch(residual: f64, sigma: f64, cameras_seen: usize, rate: f64) -> bool {
    residual > largest_residual(sigma, cameras_seen, rate)
}

/// Standard deviation of a pixel coordinate that the residuals of these points speak for, with three
/// numbers of each point spent on its place. `None` for methods that have no residual.
#[must_use]
pub fn sigma_of_residuals(reconstructor: &dyn Reconstructor, data: &Dataset) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0.0);
    for row in &data.correspondences {
        let Some(found) = reconstructor.locate(&row.pixels) else { continue };
        let numbers = (2 * row.seen_by()) as f64;
        if found.residual.is_finite() {
            squares += numbers * found.residual * found.residual;
            freedom += numbers - 3.0;
        }
    }
    (freedom > 0.0).then(|| (squares / freedom).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        chart::line_grid::LineGrid,
        method::AnyMethod,
        progress::Silent,
        synthetic::{Noise, Rig, Stage, chart_correspondences, random_correspondences},
    };

    #[test]
    fn true_matches_are_called_false_at_the_stated_rate_or_less() {
        for (cameras, noise) in
            [(2, Noise::Normal(0.1)), (2, Noise::Quantised), (4, Noise::Normal(0.3))]
        {
            let rig = Rig::named("paper", cameras).unwrap();
            let chart = LineGrid::default().into();
            let views = Stage::default().views().unwrap();
            let train = chart_correspondences(&rig, &chart, &views, (noise, 3), None);
            let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
            let fit = &*fit.reconstructor;
            let sigma = sigma_of_residuals(fit, &train).unwrap();
            assert!((sigma / noise.sigma() - 1.0).abs() < 0.06, "{noise}: {sigma}");
            let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 4), 10_000);
            for rate in [0.01_f64, 0.001] {
                let flagged = exam.correspondences.iter().filter(|row| {
                    let residual = fit.locate(&row.pixels).unwrap().residual;
                    is_mismatch(residual, sigma, cameras, rate)
                });
                let (count, expected) = (flagged.count() as f64, 10_000.0 * rate);
                // Four standard deviations of a count, and that of sigma's own error.
                let most = expected * 1.25 + 4.0 * expected.sqrt();
                assert!(count <= most, "{cameras}, {noise}: {count} at {rate}");
                let least = if noise == Noise::Quantised { 0.0 } else { 0.5 * expected - 3.0 };
                assert!(count >= least, "{cameras}, {noise}: {count} at {rate}");
            }
        }
    }

    #[test]
    fn false_matches_are_told() {
        let rig = Rig::named("paper", 2).unwrap();
        let (chart, noise) = (LineGrid::default().into(), Noise::Normal(0.1));
        let views = Stage::default().views().unwrap();
        let train = chart_correspondences(&rig, &chart, &views, (noise, 3), None);
        let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
        let rows = &train.correspondences;
        let sigma = sigma_of_residuals(&*fit.reconstructor, &train).unwrap();
        let false_pairs = rows.iter().zip(rows.iter().skip(40)).filter(|(one, other)| {
            let pair = [one.pixels[0], other.pixels[1]];
            fit.reconstructor
                .locate(&pair)
                .is_none_or(|found| is_mismatch(found.residual, sigma, 2, 0.001))
        });
        // Some points of a chart lie on each other's epipolar lines.
        assert!(false_pairs.count() > (rows.len() - 40) * 95 / 100);
        assert!(!is_mismatch(f64::NAN, 0.1, 2, 0.001));
        assert!(!is_mismatch(1e-9, 0.0, 2, 0.001), "exact data is not a mismatch by rounding");
        assert_eq!(largest_residual(0.1, 1, 0.001), f64::INFINITY);
    }
}
