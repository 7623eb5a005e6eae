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
    match reconstructor.effective_parameters() {
        Some(unknowns) if unknowns < count => {
            let lost = count / (count - unknowns);
            own.into_iter().map(|distance2| distance2 * lost).collect()
        }
        _ => Vec::new(),
    }
}
