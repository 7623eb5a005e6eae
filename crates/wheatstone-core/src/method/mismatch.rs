//! Whether pixels belong together: whether their rays miss each other by more than noise makes them.

use super::{Located, LocatedBatch, Reconstructor, Residual, locate_all};
use crate::geometry::{Pixel, PixelColumns};
use wheatstone_numeric::statistics::{chi_square_beyond, chi_square_upper_quantile, median};

/// No detector or matcher is better than this many pixels (sub-pixel detectors end at a hundredth), so
/// that what misses by less is no sign of a wrong match, whatever the fit's own points say.
const LEAST_SIGMA: f64 = 0.01;

/// How far rays of a true match may miss each other, worked out once for all points.
#[derive(Clone, Debug)]
pub struct MismatchTest {
    /// The largest residual over the standard deviation of a pixel coordinate, by the number of cameras that
    /// saw the point.
    largest: Vec<f64>,
}

impl MismatchTest {
    /// One that calls a true match of at most so many cameras a false one with probability `rate` at most. A
    /// point takes three of the two numbers of each of `n` cameras that saw it, so that
    /// `2 n residual^2 / sigma^2` is chi-square with `2 n - 3` degrees of freedom. Errors from rounding are
    /// bounded, which keeps the rate lower still.
    #[must_use]
    pub fn new(rate: f64, cameras: usize) -> Self {
        let largest = |seen: usize| match 2 * seen {
            0..=3 => f64::INFINITY,
            numbers => (chi_square_upper_quantile(rate, numbers - 3) / numbers as f64).sqrt(),
        };
        Self { largest: (0..=cameras).map(largest).collect() }
    }

    /// The residual, in pixels, that a true match exceeds with the test's rate at most, where the standard
    /// deviation of a pixel coordinate is `sigma`. Infinite for fewer than two cameras.
    #[must_use]
    pub fn largest_residual(&self, sigma: f64, cameras_seen: usize) -> f64 {
        sigma.max(LEAST_SIGMA) * self.largest.get(cameras_seen).copied().unwrap_or(f64::INFINITY)
    }

    /// Whether a located point's residual is larger than chance makes it. Without one nothing is known.
    #[must_use]
    pub fn is_mismatch(&self, found: &Located, cameras_seen: usize) -> bool {
        found
            .residual
            .is_some_and(|Residual { rms, sigma }| rms > self.largest_residual(sigma, cameras_seen))
    }

    /// Whether each of many points' residuals is larger than chance makes it, as
    /// [`MismatchTest::is_mismatch`] has it. All are false where no residuals were asked for.
    #[must_use]
    pub fn mismatches(&self, pixels: &PixelColumns, places: &LocatedBatch) -> Vec<bool> {
        let mut seen = vec![0_u16; pixels.points()];
        for [x, y] in pixels.cameras() {
            for (seen, (x, y)) in seen.iter_mut().zip(x.iter().zip(*y)) {
                *seen += u16::from(!(x.is_nan() | y.is_nan()));
            }
        }
        let residuals = places.residual.iter().zip(&places.residual_sigma);
        let mut found: Vec<bool> = seen
            .iter()
            .zip(residuals)
            .map(|(seen, (residual, sigma))| {
                *residual > self.largest_residual(*sigma, usize::from(*seen))
            })
            .collect();
        found.resize(pixels.points(), false);
        found
    }
}

/// What share of points seen by two cameras or more have pixels that do not belong together: they
/// miss each other, or meet nowhere. `None` where there are no such points.
#[must_use]
pub fn mismatched_share(
    reconstructor: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
    rate: f64,
) -> Option<f64> {
    let test = MismatchTest::new(rate, reconstructor.cameras());
    let (mut seen, mut wrong) = (0_u32, 0_u32);
    for (row, found) in pixels.iter().zip(locate_all(reconstructor, pixels)) {
        let cameras = row.iter().flatten().count();
        if cameras >= 2 {
            seen += 1;
            wrong += u32::from(found.is_none_or(|found| test.is_mismatch(&found, cameras)));
        }
    }
    (seen > 0).then(|| f64::from(wrong) / f64::from(seen))
}

/// How noisy pixels are, and how noisy a map takes them to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelScatter {
    /// The standard deviation of a pixel coordinate that the residuals show, in pixels.
    pub sigma: f64,
    /// The one that the map's error bars assume, in pixels.
    pub assumed: f64,
}

/// What a point's residual says of the noise of pixels.
struct PointScatter {
    /// The squared residual over what is expected of it: a chi-square with so many degrees of freedom.
    square: f64,
    freedom: usize,
    /// That over its median.
    scale: f64,
    /// The standard deviation of a pixel coordinate that is expected in the residual, with what the fit is uncertain by.
    expected: f64,
    /// The one that is assumed of the pixels.
    assumed: f64,
}

/// How noisy pixels are, where by the residuals of most points they are clearly noisier than a map takes them to be, and
/// the residuals are those of noise: neither far beyond what any detector does, nor all of them large. `None` too for
/// fewer than 30 points seen by two cameras or more.
///
/// A few mismatches do not count: half of the residuals are below the median, whatever the others are.
#[must_use]
pub fn noisier_pixels(
    map: &dyn Reconstructor,
    pixels: &[Vec<Option<Pixel>>],
) -> Option<PixelScatter> {
    const LEAST_POINTS: usize = 30;
    /// Times the standard deviation that is expected: by less, pixels of a calibration differ from others, too.
    const CLEARLY: f64 = 1.3;
    /// No detector and no matcher is so many times worse than that of a chart; a wrong model is.
    const MOST: f64 = 30.0;
    /// Of noise, a quarter of the residuals are below its lower quartile; of pixels that are shifted, hardly any are.
    const LEAST_SMALL: f64 = 0.5 * 0.25;
    let located = pixels.iter().zip(locate_all(map, pixels));
    let points = located.filter_map(|(row, found)| PointScatter::of(map, row, &found?));
    let points: Vec<PointScatter> = points.collect();
    if points.len() < LEAST_POINTS {
        return None;
    }
    let middle = |of: fn(&PointScatter) -> f64| median(&points.iter().map(of).collect::<Vec<_>>());
    let (scale, count) = (middle(|point| point.scale), points.len() as f64);
    let share = |is_so: &dyn Fn(&PointScatter) -> bool| {
        points.iter().filter(|point| is_so(point)).count() as f64 / count
    };
    let above = share(&|point| point.scale > CLEARLY * CLEARLY);
    let small = share(&|point| chi_square_beyond(point.square / scale, point.freedom) > 0.75);
    // Two standard deviations of a count of halves.
    if above < 0.5 + 1.0 / count.sqrt() || scale > MOST * MOST || small < LEAST_SMALL {
        return None;
    }
    let (expected, assumed) = (middle(|point| point.expected), middle(|point| point.assumed));
    let sigma = (assumed * assumed + (scale - 1.0) * expected * expected).sqrt();
    Some(PixelScatter { sigma, assumed })
}

impl PointScatter {
    /// `None` for a point without a residual, and for maps that assume nothing of pixels.
    fn of(map: &dyn Reconstructor, row: &[Option<Pixel>], found: &Located) -> Option<Self> {
        let Residual { rms, sigma } = found.residual?;
        let (expected, seen) = (sigma.max(LEAST_SIGMA), row.iter().flatten().count());
        let (square, freedom) = Residual { rms, sigma: expected }.misfit(seen)?;
        let pixels = row.iter().enumerate();
        let pixels = pixels.filter_map(|(camera, pixel)| Some((camera, (*pixel)?)));
        let own = pixels.map(|(camera, pixel)| map.pixel_sigma(camera, pixel, found.point));
        let squares: Option<f64> = own.map(|own| own.map(|own| own * own)).sum();
        let assumed = (squares? / seen as f64).sqrt().max(LEAST_SIGMA);
        let scale = square / chi_square_upper_quantile(0.5, freedom);
        Some(Self { square, freedom, scale, expected, assumed })
    }
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
