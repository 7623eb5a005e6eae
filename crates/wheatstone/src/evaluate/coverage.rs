//! Error ellipsoids that hold as many points as they say.
//!
//! For normal errors the squared Mahalanobis distance of a point from its place is chi-square with
//! three degrees of freedom. Two things make it otherwise: pixels rounded to a raster, whose errors
//! are bounded, so that so are the points'; and a model that is wrong, whose errors are no noise at
//! all. The first is known from the pixels, and its law is sampled; the second shows on points held
//! out of the fit.

use crate::{
    dataset::{Dataset, split::FoldKind},
    geometry::{Pixel, Point3, Vector3},
    method::Reconstructor,
    numeric::{
        random::Random,
        statistics::{mean, percentile},
    },
};
use nalgebra::{Matrix3, Matrix3xX};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How large ellipsoids must be drawn: squared Mahalanobis radii, no unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ellipsoids {
    /// Of the ellipsoid that holds 68 % of all points.
    pub radius2_68: f64,
    /// Of that which holds 95 %.
    pub radius2_95: f64,
}

/// A point that was left out of the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Whether its view lies among those that were fitted.
    pub kind: FoldKind,
    /// Its squared Mahalanobis distance from its known place, by its own covariance.
    pub distance2: f64,
}

/// What share of points with known places their ellipsoids hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coverage {
    /// By the 68 % ellipsoid, 0 to 1.
    pub p68: f64,
    /// By the 95 % ellipsoid.
    pub p95: f64,
}

/// The squared Mahalanobis distance of every located point from its known place, by its own
/// covariance.
#[must_use]
pub fn mahalanobis2(reconstructor: &dyn Reconstructor, data: &Dataset) -> Vec<f64> {
    data.known()
        .filter_map(|(world, row)| {
            let located = reconstructor.locate(&row.pixels)?;
            let error = located.point - world;
            let distance2 = error.dot(&located.covariance.cholesky()?.solve(&error));
            distance2.is_finite().then_some(distance2)
        })
        .collect()
}

/// What share of the points of `data` their ellipsoids hold; `None` where none is located with a
/// covariance.
#[must_use]
pub fn coverage(
    reconstructor: &dyn Reconstructor,
    data: &Dataset,
    ellipsoids: &Ellipsoids,
) -> Option<Coverage> {
    let distances = mahalanobis2(reconstructor, data);
    let held = |radius2: f64| {
        distances.iter().filter(|distance2| **distance2 <= radius2).count() as f64
            / distances.len() as f64
    };
    (!distances.is_empty())
        .then(|| Coverage { p68: held(ellipsoids.radius2_68), p95: held(ellipsoids.radius2_95) })
}

/// With fewer held-out points than this their distances say less than the law of the noise does.
const LEAST_HELD_OUT: usize = 60;

/// With as many held-out points the inner percentile scatters by two percent of coverage.
const MANY: usize = 500;

/// Chi-square of two degrees of freedom that chance exceeds once in twenty times: an alarm by chance
/// costs little, as the radii of held-out points are then nearly those of the law.
const SIGNIFICANT: f64 = 5.99;

impl Ellipsoids {
    /// Of normal errors: quantiles of chi-square with three degrees of freedom.
    pub const NORMAL: Self = Self { radius2_68: 3.506, radius2_95: 7.815 };

    /// Radii for a map fitted to `data`, by the law of its pixels' noise; where points held out of
    /// fits contradict that, by those points. They contradict it where Pearson's chi-square of the
    /// numbers inside, between and outside of the two ellipsoids is larger than chance makes it once
    /// in twenty times.
    #[must_use]
    pub fn estimate(
        reconstructor: &dyn Reconstructor,
        data: &Dataset,
        held_out: &[Distance],
    ) -> Self {
        let by_law = Self::of_noise(reconstructor, data);
        let among = |kinds: &[FoldKind]| -> Vec<f64> {
            let kept = held_out.iter().filter(|point| kinds.contains(&point.kind));
            kept.map(|point| point.distance2).collect()
        };
        // Ellipsoids speak of where the fit was shown points.
        let mut distances = among(&[FoldKind::Interpolation]);
        if distances.len() < LEAST_HELD_OUT {
            distances = among(&[FoldKind::Interpolation, FoldKind::Extrapolation]);
        }
        if distances.len() < LEAST_HELD_OUT {
            return by_law;
        }
        distances.extend(own_distances(reconstructor, data, &distances));
        if !by_law.is_contradicted_by(&distances) {
            return by_law;
        }
        Self::of_sample(&distances).unwrap_or(by_law)
    }

    /// Pearson's test.
    fn is_contradicted_by(&self, distances: &[f64]) -> bool {
        let count = distances.len() as f64;
        let below = |radius2: f64| distances.iter().filter(|d| **d <= radius2).count() as f64;
        let (inner, both) = (below(self.radius2_68), below(self.radius2_95));
        let cells = [(inner, 0.68), (both - inner, 0.27), (count - both, 0.05)];
        let square = |(seen, share): (f64, f64)| (seen - share * count).powi(2) / (share * count);
        cells.into_iter().map(square).sum::<f64>() > SIGNIFICANT
    }

    /// Radii of a sample of distances, as those of a power of chi-square with a scale of its own, both
    /// by maximum likelihood: two numbers describe lighter and heavier tails alike, and vary less from
    /// sample to sample than the sample's own percentiles. Of many distances the inner percentile is
    /// surer than any law.
    fn of_sample(distances: &[f64]) -> Option<Self> {
        let logs: Vec<f64> =
            distances.iter().filter(|d| **d > 0.0).map(|d| libm::log(*d)).collect();
        let middle = mean(&logs);
        // With d = s x^q and x chi-square: s^(1/q) is the mean of d^(1/q) over three.
        let log_scale = |power: f64| {
            let powers: Vec<f64> =
                logs.iter().map(|log| libm::exp((log - middle) / power)).collect();
            libm::log(mean(&powers) / 3.0)
        };
        let likelihood = |power: f64| -libm::log(power) - 1.5 * log_scale(power);
        let power = greatest(likelihood, (0.2, 5.0))?;
        let radius2 =
            |normal: f64| libm::exp(middle + power * (log_scale(power) + libm::log(normal)));
        let found = Self {
            radius2_68: if distances.len() < MANY {
                radius2(Self::NORMAL.radius2_68)
            } else {
                percentile(distances, 0.68)
            },
            radius2_95: radius2(Self::NORMAL.radius2_95),
        };
        let sound = |radius2: f64| radius2 > 0.0 && radius2.is_finite();
        (sound(found.radius2_68) && sound(found.radius2_95)).then_some(found)
    }

    /// Radii by the law of the pixels' noise: that of rounding where all pixels lie on a raster, and
    /// normal as far as there is more of it.
    fn of_noise(reconstructor: &dyn Reconstructor, data: &Dataset) -> Self {
        /// Half a million draws leave a radius uncertain by a fifth of a percent.
        const POINTS: usize = 256;
        let Some(step) = raster(data) else { return Self::NORMAL };
        let stride = data.correspondences.len().div_ceil(POINTS).max(1);
        let rows: Vec<&[Option<Pixel>]> =
            data.known().step_by(stride).map(|(_, row)| row.pixels.as_slice()).collect();
        let distances: Vec<f64> = rows
            .into_par_iter()
            .enumerate()
            .filter_map(|(index, pixels)| {
                Linear::at(reconstructor, pixels)
                    .map(|map| map.distances(step, &mut Random::stream(DRAWS_SEED, index as u64)))
            })
            .flatten_iter()
            .collect();
        if distances.is_empty() {
            return Self::NORMAL;
        }
        Self { radius2_68: percentile(&distances, 0.68), radius2_95: percentile(&distances, 0.95) }
    }
}

/// The distances of the fit's own points, where they are as large as those of points left out: a fit
/// without a view is a little worse than the fit with it, and the fit's own points are told a little
/// too well; together they err less, and there are more of them. A method that bends to its points
/// says nothing by them.
fn own_distances(reconstructor: &dyn Reconstructor, data: &Dataset, held_out: &[f64]) -> Vec<f64> {
    // Four hundred points of two cameras lose a tenth to some forty unknowns a camera.
    const ALIKE: f64 = 1.1;
    let own = mahalanobis2(reconstructor, data);
    let ratio = percentile(held_out, 0.5) / percentile(&own, 0.5);
    if (1.0 / ALIKE..=ALIKE).contains(&ratio) { own } else { Vec::new() }
}

/// Draws are the same for every map.
const DRAWS_SEED: u64 = 1900;

/// Where a function of one positive number is greatest, by golden sections of its logarithm (Kiefer
/// 1953, doi:10.1090/S0002-9939-1953-0055639-3).
fn greatest(function: impl Fn(f64) -> f64, (low, high): (f64, f64)) -> Option<f64> {
    let share = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (libm::log(low), libm::log(high));
    let at = |log: f64| function(libm::exp(log));
    // Each section leaves 0.62 of the range: forty leave a millionth of a percent.
    for _ in 0..40 {
        let (left, right) = (high - share * (high - low), low + share * (high - low));
        if at(left) < at(right) { low = left } else { high = right }
    }
    Some(libm::exp(0.5 * (low + high))).filter(|found| function(*found).is_finite())
}

/// The raster that all pixels lie on, in pixels: the coarsest of those that detectors and files
/// round to; `None` for pixels on none.
fn raster(data: &Dataset) -> Option<f64> {
    // Finer ones are no noise to speak of beside any detector's.
    const STEPS: [f64; 9] = [2.0, 1.0, 0.5, 0.25, 0.2, 0.125, 0.1, 0.0625, 0.05];
    let values = || {
        let pixels = data.known().flat_map(|(_, row)| row.pixels.iter().flatten());
        pixels.flat_map(|pixel| [pixel.x, pixel.y])
    };
    let first = values().next()?;
    let on = |step: f64| {
        // Far above rounding of the numbers, far below a step.
        values().all(|value| {
            let steps = (value - first) / step;
            (steps - steps.round()).abs() < 1e-6
        })
    };
    STEPS.into_iter().find(|step| on(*step))
}

/// A map near one point: how its errors follow from those of the pixels, in units in which the
/// point's covariance is the identity.
struct Linear {
    /// By each pixel coordinate.
    slopes: Matrix3xX<f64>,
    /// Standard deviation of each pixel coordinate.
    sigmas: Vec<f64>,
    /// A root of what of the covariance is not the pixels'.
    rest: Matrix3<f64>,
}

impl Linear {
    fn at(reconstructor: &dyn Reconstructor, pixels: &[Option<Pixel>]) -> Option<Self> {
        let located = reconstructor.locate(pixels)?;
        let whitened = located.covariance.cholesky()?.l().try_inverse()?;
        let (mut columns, mut sigmas) = (Vec::new(), Vec::new());
        for (camera, seen) in pixels.iter().enumerate() {
            let Some(seen) = seen else { continue };
            let sigma = reconstructor.pixel_sigma(camera, *seen, located.point)?;
            if sigma <= 0.0 {
                return None;
            }
            for axis in 0..2 {
                let moved = |by: f64| -> Option<Point3> {
                    let mut pixels = pixels.to_vec();
                    pixels.get_mut(camera)?.as_mut()?[axis] += by;
                    Some(reconstructor.locate(&pixels)?.point)
                };
                // Half the noise to both sides: the map is all but straight over the noise itself.
                let step = 0.5 * sigma;
                columns.push(whitened * (moved(step)? - moved(-step)?) / (2.0 * step));
                sigmas.push(sigma);
            }
        }
        let slopes = Matrix3xX::from_columns(&columns);
        let mut of_pixels = Matrix3::zeros();
        for (column, sigma) in columns.iter().zip(&sigmas) {
            of_pixels += column * column.transpose() * (sigma * sigma);
        }
        let rest = (Matrix3::identity() - of_pixels).symmetric_eigen();
        let roots = rest.eigenvalues.map(|value| value.max(0.0).sqrt());
        let rest = rest.eigenvectors * Matrix3::from_diagonal(&roots);
        Some(Self { slopes, sigmas, rest })
    }

    /// Squared Mahalanobis distances of points whose pixels were rounded to a raster.
    fn distances(&self, step: f64, random: &mut Random) -> Vec<f64> {
        const DRAWS: usize = 2048;
        // Of a uniform error; what there is beyond it is taken for normal.
        let rounding = step * step / 12.0;
        let parts: Vec<(f64, f64)> = self
            .sigmas
            .iter()
            .map(|sigma| {
                let uniform = rounding.min(sigma * sigma);
                ((3.0 * uniform).sqrt(), (sigma * sigma - uniform).sqrt())
            })
            .collect();
        let mut draw = |_| {
            let mut error =
                self.rest * Vector3::new(random.normal(), random.normal(), random.normal());
            for (column, (half_width, normal)) in self.slopes.column_iter().zip(&parts) {
                let uniform = random.uniform(-half_width, *half_width);
                let more = if *normal > 0.0 { normal * random.normal() } else { 0.0 };
                error += column * (uniform + more);
            }
            error.norm_squared()
        };
        (0..DRAWS).map(&mut draw).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        chart::line_grid::LineGrid,
        method::{AnyMethod, AnyReconstructor},
        progress::Silent,
        synthetic::{
            Noise, Rig, Stage, chart_correspondences, random_correspondences as random_points,
        },
    };

    fn fitted(rig: &str, noise: Noise, seed: u64) -> (Dataset, AnyReconstructor, Dataset) {
        let rig = Rig::named(rig, 2).unwrap();
        let chart = LineGrid { pitch: rig.chart_pitch(), ..LineGrid::default() }.into();
        let views = Stage::default().views().unwrap();
        let train = chart_correspondences(&rig, &chart, &views, (noise, seed), Some(400));
        let method = AnyMethod::named("brown").unwrap();
        let map = method.fit_checked(&train, 0, &Silent).unwrap().reconstructor;
        let exam = random_points(&rig, &chart, (50.0, 140.0), (noise, seed + 1), 3000);
        (train, map, exam)
    }

    #[test]
    fn ellipsoids_of_rounded_pixels_hold_what_they_say() {
        let (train, map, exam) = fitted("paper", Noise::Quantised, 40);
        let law = Ellipsoids::estimate(&*map, &train, &[]);
        assert!(law.radius2_95 < 0.9 * Ellipsoids::NORMAL.radius2_95, "{law:?}");
        let held = coverage(&*map, &exam, &law).unwrap();
        assert!((0.65..0.71).contains(&held.p68) && (0.93..0.97).contains(&held.p95), "{held:?}");
        // The chi-square's ellipsoid would hold nearly all.
        assert!(coverage(&*map, &exam, &Ellipsoids::NORMAL).unwrap().p95 > 0.975);
        assert_eq!(raster(&train), Some(1.0));
    }

    #[test]
    fn normal_noise_keeps_the_radii_of_chi_square() {
        // Four fits: 800 pixels' coordinates tell the noise so that 68 % scatter by two.
        let (mut p68, mut p95) = (0.0, 0.0);
        for seed in [50, 60, 70, 80] {
            let (train, map, exam) = fitted("paper", Noise::Normal(0.1), seed);
            assert_eq!(raster(&train), None);
            let law = Ellipsoids::estimate(&*map, &train, &[]);
            assert_eq!(law, Ellipsoids::NORMAL);
            let held = coverage(&*map, &exam, &law).unwrap();
            p68 += 0.25 * held.p68;
            p95 += 0.25 * held.p95;
        }
        assert!((0.65..0.71).contains(&p68) && (0.93..0.97).contains(&p95), "{p68} {p95}");
    }

    #[test]
    fn a_raster_may_be_shifted_and_fine_noise_is_on_none() {
        let (mut train, ..) = fitted("paper", Noise::Quantised, 60);
        for row in &mut train.correspondences {
            for pixel in row.pixels.iter_mut().flatten() {
                *pixel = Pixel::new(0.25 * pixel.x + 0.3, 0.25 * pixel.y + 0.3);
            }
        }
        assert_eq!(raster(&train), Some(0.25));
    }

    #[test]
    fn points_held_out_are_heard_where_they_contradict() {
        let (train, map, _) = fitted("paper", Noise::Normal(0.1), 70);
        let mut random = Random::new(5);
        let mut sample = |scale: f64, power: f64| -> Vec<Distance> {
            let mut normal = || random.normal().powi(2);
            let distance2 = |_| scale * libm::pow(normal() + normal() + normal(), power);
            let of = |distance2| Distance { kind: FoldKind::Interpolation, distance2 };
            (0..2000).map(distance2).map(of).collect()
        };
        let right = Ellipsoids::estimate(&*map, &train, &sample(1.0, 1.0));
        let wrong = Ellipsoids::estimate(&*map, &train, &sample(0.6, 1.4));
        for (found, scale, power) in [(right, 1.0, 1.0), (wrong, 0.6, 1.4)] {
            let wanted = |normal: f64| scale * libm::pow(normal, power);
            let (small, large) =
                (found.radius2_68 / wanted(3.506), found.radius2_95 / wanted(7.815));
            assert!((small - 1.0).abs() < 0.08 && (large - 1.0).abs() < 0.08, "{found:?}");
        }
        let few: Vec<Distance> = sample(9.0, 1.0).into_iter().take(20).collect();
        assert_eq!(Ellipsoids::estimate(&*map, &train, &few), Ellipsoids::NORMAL);
    }
}
