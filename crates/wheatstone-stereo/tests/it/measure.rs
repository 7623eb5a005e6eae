//! Errors of a map in numbers.

use wheatstone_stereo::DisparityMap;

/// A measured pixel beside its truth.
#[derive(Clone, Copy)]
pub(crate) struct Judged {
    pub(crate) truth: f64,
    pub(crate) error: f64,
    pub(crate) sigma: f64,
    pub(crate) confidence: f32,
}

/// Pixels above a confidence of which the truth is known.
pub(crate) fn confident(
    map: &DisparityMap,
    above: f32,
    truth: impl Fn(usize, usize) -> Option<f64>,
) -> Vec<Judged> {
    let pixels = (0..map.width * map.height).map(|at| (at % map.width, at / map.width));
    pixels
        .filter_map(|(x, y)| {
            let found = map.at(x, y).filter(|found| found.confidence > above)?;
            let truth = truth(x, y)?;
            let error = f64::from(found.disparity) - truth;
            let (sigma, confidence) = (f64::from(found.sigma), found.confidence);
            Some(Judged { truth, error, sigma, confidence })
        })
        .collect()
}

pub(crate) fn share(judged: &[Judged], holds: impl Fn(&Judged) -> bool) -> f64 {
    judged.iter().filter(|judged| holds(judged)).count() as f64 / judged.len().max(1) as f64
}

/// The share of errors above a bound, in pixels.
pub(crate) fn bad(judged: &[Judged], most: f64) -> f64 {
    share(judged, |judged| judged.error.abs() > most)
}

pub(crate) fn root_mean_square(judged: &[Judged]) -> f64 {
    (judged.iter().map(|judged| judged.error.powi(2)).sum::<f64>() / judged.len() as f64).sqrt()
}

/// The amplitude of errors that follow the fraction of the disparity, in pixels.
pub(crate) fn locking(judged: &[Judged]) -> f64 {
    let amplitude = |wave: fn(f64) -> f64| {
        let products = judged
            .iter()
            .map(|judged| judged.error * wave(2.0 * std::f64::consts::PI * judged.truth));
        2.0 * products.sum::<f64>() / judged.len() as f64
    };
    libm::hypot(amplitude(libm::sin), amplitude(libm::cos))
}

pub(crate) fn median_error(judged: &[Judged]) -> f64 {
    let mut errors: Vec<f64> = judged.iter().map(|judged| judged.error.abs()).collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}
