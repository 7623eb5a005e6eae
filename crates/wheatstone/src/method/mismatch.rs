//! Whether pixels belong together: whether their rays miss each other by more than noise makes them.

use super::{Located, Reconstructor, locate_all};
use crate::{geometry::Pixel, numeric::statistics::chi_square_upper_quantile};

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

/// Whether a located point's residual is larger than chance makes it: see [`largest_residual`]. A
/// residual that does not exist (NaN) says nothing.
#[must_use]
pub fn is_mismatch(found: &Located, cameras_seen: usize, rate: f64) -> bool {
    found.residual > largest_residual(found.residual_sigma, cameras_seen, rate)
}

/// What share of points seen by two cameras or more have pixels that do not belong together: they
/// miss each other, or meet nowhere. `None` where there are no such points.
#[must_use]
pub fn mismatched_share(
    reconstructor: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Option<f64> {
    let (mut seen, mut wrong) = (0_u32, 0_u32);
    for (row, found) in pixels.iter().zip(locate_all(reconstructor, pixels)) {
        let cameras = row.iter().flatten().count();
        if cameras >= 2 {
            seen += 1;
            wrong += u32::from(found.is_none_or(|found| is_mismatch(&found, cameras, rate)));
        }
    }
    (seen > 0).then(|| f64::from(wrong) / f64::from(seen))
}

/// The two cameras whose exchange makes most pixels belong together, where hardly any do as they are
/// given. Nothing is said of fewer than eight points.
#[must_use]
pub fn exchanged_cameras(
    reconstructor: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Option<(usize, usize)> {
    const LEAST_POINTS: usize = 8;
    // A quarter may be ordinary mismatches.
    const MOST_LEFT: f64 = 0.25;
    if pixels.len() < LEAST_POINTS || mismatched_share(reconstructor, pixels, rate)? < 0.75 {
        return None;
    }
    let cameras = reconstructor.cameras();
    let pairs = (0..cameras).flat_map(|a| (a + 1..cameras).map(move |b| (a, b)));
    pairs
        .filter_map(|(a, b)| {
            let mut exchanged = pixels.to_vec();
            exchanged.iter_mut().for_each(|row| row.swap(a, b));
            Some(((a, b), mismatched_share(reconstructor, &exchanged, rate)?))
        })
        .filter(|(_, share)| *share < MOST_LEFT)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(pair, _)| pair)
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
            let exam = random_correspondences(&rig, &chart, (50.0, 140.0), (noise, 4), 10_000);
            for rate in [0.01_f64, 0.001] {
                let flagged = exam
                    .correspondences
                    .iter()
                    .filter(|row| is_mismatch(&fit.locate(&row.pixels).unwrap(), cameras, rate));
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
        let false_pairs = rows.iter().zip(rows.iter().skip(40)).filter(|(one, other)| {
            let pair = [one.pixels[0], other.pixels[1]];
            fit.reconstructor.locate(&pair).is_none_or(|found| is_mismatch(&found, 2, 0.001))
        });
        // Some points of a chart lie on each other's epipolar lines.
        assert!(false_pairs.count() > (rows.len() - 40) * 95 / 100);
        let found = fit.reconstructor.locate(&rows[0].pixels).unwrap();
        let none = Located { residual: f64::NAN, residual_sigma: f64::NAN, ..found };
        assert!(!is_mismatch(&none, 2, 0.001));
        let exact = Located { residual: 1e-9, residual_sigma: 0.0, ..found };
        assert!(!is_mismatch(&exact, 2, 0.001), "exact data is not a mismatch by rounding");
        assert_eq!(largest_residual(0.1, 1, 0.001), f64::INFINITY);
    }

    #[test]
    fn exchanged_cameras_are_told_apart_from_plain_mismatches() {
        let rig = Rig::named("paper", 3).unwrap();
        let (chart, noise) = (LineGrid::default().into(), Noise::Normal(0.1));
        let views = Stage::default().views().unwrap();
        let train = chart_correspondences(&rig, &chart, &views, (noise, 3), None);
        let fit = AnyMethod::named("brown").unwrap().fit_checked(&train, 0, &Silent).unwrap();
        let pixels: Vec<_> = train.correspondences.iter().map(|row| row.pixels.clone()).collect();
        assert_eq!(exchanged_cameras(&*fit.reconstructor, &pixels, 1e-3), None);
        let mut exchanged = pixels.clone();
        exchanged.iter_mut().for_each(|row| row.swap(0, 2));
        assert_eq!(exchanged_cameras(&*fit.reconstructor, &exchanged, 1e-3), Some((0, 2)));
        let mut shifted = pixels.clone();
        let last = pixels.len() - 1;
        shifted.iter_mut().zip(&pixels).for_each(|(row, _)| row[1] = pixels[last][1]);
        assert_eq!(exchanged_cameras(&*fit.reconstructor, &shifted, 1e-3), None);
        assert!(mismatched_share(&*fit.reconstructor, &shifted, 1e-3).unwrap() > 0.9);
    }
}
