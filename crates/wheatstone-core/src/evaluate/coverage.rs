//! Error ellipsoids that hold as many points as they say.
//!
//! For normal errors the squared Mahalanobis distance of a point from its place is chi-square with
//! three degrees of freedom. Two things make it otherwise: pixels rounded to a raster, whose errors
//! are bounded, so that so are the points'; and a model that is wrong, whose errors are no noise at
//! all. The first is known from the pixels, and its law is sampled; the second shows on points held
//! out of the fit.

mod rounding;
mod sample;

use crate::{
    dataset::{Dataset, split::FoldKind},
    method::Reconstructor,
};
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

impl Ellipsoids {
    /// Of normal errors: quantiles of chi-square with three degrees of freedom.
    pub const NORMAL: Self = Self { radius2_68: 3.506, radius2_95: 7.815 };

    /// Radii for a map fitted to `data`: between the law of its pixels' noise and what its errors
    /// show, at the fit's own points and at points held out of fits, the nearer to these the more they
    /// contradict the law.
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
        distances.extend(own_distances(reconstructor, data));
        let Some(shown) = sample::radii(&distances) else { return by_law };
        // Chi-square of two degrees of freedom is one too many by chance in its most likely case: what
        // of it is more belongs to the law (James & Stein 1961, as empirical Bayes).
        let trust = (1.0 - 1.0 / by_law.contradiction(&distances)).max(0.0);
        let between = |law: f64, shown: f64| law * libm::pow(shown / law, trust);
        Self {
            radius2_68: between(by_law.radius2_68, shown.radius2_68),
            radius2_95: between(by_law.radius2_95, shown.radius2_95),
        }
    }

    /// Pearson's chi-square of the numbers inside, between and outside of the two ellipsoids.
    fn contradiction(&self, distances: &[f64]) -> f64 {
        let count = distances.len() as f64;
        let below = |radius2: f64| distances.iter().filter(|d| **d <= radius2).count() as f64;
        let (inner, both) = (below(self.radius2_68), below(self.radius2_95));
        let cells = [(inner, 0.68), (both - inner, 0.27), (count - both, 0.05)];
        let square = |(seen, share): (f64, f64)| (seen - share * count).powi(2) / (share * count);
        cells.into_iter().map(square).sum()
    }
}

/// The distances of the fit's own points as they would be of others: the fit took a part of the noise
/// into itself, and its errors there lack it, as the squares of any fit do.
fn own_distances(reconstructor: &dyn Reconstructor, data: &Dataset) -> Vec<f64> {
    let own = mahalanobis2(reconstructor, data);
    let count = own.len() as f64;
    match reconstructor.unknowns() {
        Some(unknowns) if unknowns < count => {
            let lost = count / (count - unknowns);
            own.into_iter().map(|distance2| distance2 * lost).collect()
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::{rounding::raster, *};
    use crate::{
        geometry::Pixel,
        method::{AnyMethod, AnyReconstructor},
    };
    use wheatstone_charts::chart::line_grid::LineGrid;
    use wheatstone_numeric::{progress::Silent, random::Random};
    use wheatstone_synthetic::{
        Noise, Rig, Stage, chart_correspondences, random_correspondences as random_points,
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
