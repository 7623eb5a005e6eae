//! Pixel noise that differs from point to point: that of markers that move, are blurred or half hidden.
//!
//! Taken together, such errors have heavier tails than normal ones: they are Student's t, normal ones whose
//! variance is drawn anew for each point from an inverse gamma distribution (Lange, Little & Taylor 1989,
//! doi:10.2307/2290063). A point's own reprojection error says where in that distribution it stands, the more
//! surely the more cameras saw it (Smyth 2004, doi:10.2202/1544-6115.1027, does so for genes).

use super::{Located, Reconstructor};
use crate::dataset::{Correspondence, Dataset};
use serde::{Deserialize, Serialize};

/// How much the variance of the pixel noise differs from point to point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PointNoise {
    /// Degrees of freedom of the t distribution: 2 and little more for wild tails.
    freedom: f64,
}

/// Degrees of freedom that are tried: how far above 2 they begin, by what factor that grows, and the most, beyond
/// which t is as good as normal.
const LEAST_ABOVE: f64 = 0.5;
const FACTOR: f64 = 1.25;
const MOST: f64 = 60.0;

/// So many points tell it well enough.
const MOST_POINTS: usize = 2000;

/// Points for each that the fit's numbers take up, at least: of fewer it takes up more of some misfits than of others,
/// which looks like noise that differs.
const LEAST_POINTS: f64 = 12.0;

/// Logarithm of the likelihood ratio beyond Schwarz's criterion, which lets one in twenty through.
const CLEARLY: f64 = 1.5;

impl PointNoise {
    /// From the reprojection errors of the points of `data`; `None` where the variance is as good as the same for
    /// all points, by Schwarz's criterion, where they are few, and for maps without reprojection errors.
    #[must_use]
    pub fn fit(map: &dyn Reconstructor, data: &Dataset) -> Option<Self> {
        let rows = &data.correspondences;
        let taken_up = map.effective_parameters().unwrap_or(0.0);
        if (data.known().count() as f64) < LEAST_POINTS * taken_up {
            return None;
        }
        let misfit = |row: &Correspondence| {
            let (square, freedom) = map.locate(&row.pixels)?.misfit(row.seen_by())?;
            (square > 0.0).then_some((square, freedom as f64))
        };
        let step = rows.len().div_ceil(MOST_POINTS).max(1);
        let misfits: Vec<(f64, f64)> = rows.iter().step_by(step).filter_map(misfit).collect();
        let even =
            misfits.iter().map(|(square, freedom)| chi_square(*square, *freedom)).sum::<f64>();
        let criterion = 0.5 * libm::log(misfits.len().max(1) as f64) + CLEARLY;
        let above = std::iter::successors(Some(LEAST_ABOVE), |above| Some(above * FACTOR));
        let tried = above.map(|above| Self { freedom: 2.0 + above });
        tried
            .take_while(|noise| noise.freedom < MOST)
            .map(|noise| {
                let terms =
                    misfits.iter().map(|(square, freedom)| noise.likelihood(*square, *freedom));
                (noise, terms.sum::<f64>() - criterion)
            })
            .filter(|(_, likelihood)| *likelihood > even)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(noise, _)| noise)
    }

    /// Degrees of freedom of the t distribution of pixel errors; more than 2.
    #[must_use]
    pub fn freedom(self) -> f64 {
        self.freedom
    }

    /// Logarithm of the density of a squared misfit with so many degrees of freedom.
    fn likelihood(self, square: f64, freedom: f64) -> f64 {
        let (own, half, scale) = (0.5 * self.freedom, 0.5 * freedom, self.freedom - 2.0);
        libm::lgamma(own + half) - libm::lgamma(own) - libm::lgamma(half) - half * libm::log(scale)
            + (half - 1.0) * libm::log(square)
            - (own + half) * libm::log1p(square / scale)
    }

    /// The variance of one point's pixel noise over that of all: what its misfit, a chi-square with so many
    /// degrees of freedom, lets expect.
    #[must_use]
    pub fn scale(self, (square, freedom): (f64, usize)) -> f64 {
        (self.freedom - 2.0 + square) / (self.freedom - 2.0 + freedom as f64)
    }

    /// A point with the covariance that its own misfit lets expect, seen by so many cameras.
    #[must_use]
    pub fn scaled(self, mut located: Located, cameras: usize) -> Located {
        if let Some(misfit) = located.misfit(cameras) {
            located.covariance *= self.scale(misfit);
        }
        located
    }

    pub(crate) fn is_consistent(&self) -> bool {
        self.freedom > 2.0 && self.freedom.is_finite()
    }
}

/// Logarithm of the density of a chi-square.
fn chi_square(square: f64, freedom: f64) -> f64 {
    let half = 0.5 * freedom;
    (half - 1.0) * libm::log(square)
        - 0.5 * square
        - half * std::f64::consts::LN_2
        - libm::lgamma(half)
}
