//! Disparities to a fraction of a pixel: least-squares matching (Förstner 1982; Grün 1985) along the row.
//!
//! The pixels around one lie on a surface: their disparities follow from its own and from the surface's slopes and curvatures. That
//! disparity is sought which makes both pictures most alike, in the sense of least squares, where the differences are linear in it;
//! pixels that are not on the surface have no say. What neighbours say of the disparity is a prior, which decides where there
//! is no texture. The residuals tell how exact the result is.

use crate::{
    field::{Field, MARGIN},
    registers::{FLOATS, Floats, each, floats, lanes, plus, times},
    slopes::Slopes,
    window::{RADIUS, SIDE},
};
use rayon::prelude::*;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Pixels that are farther from the surface than this, in pixels of disparity, are not on it.
const MOST_DISTANCE: f32 = 1.0;
/// How far from the mean of its surroundings a disparity is expected, in pixels.
const PRIOR_SIGMA: f32 = 0.2;
/// The variance that residuals have at least, in squared grey levels: rounding of two pictures and interpolation.
const LEAST_VARIANCE: f32 = 0.5;
/// The farthest that one round may move a disparity, in pixels.
const MOST_MOVE: f32 = 0.5;

/// What one round is given.
pub(crate) struct Round<'a> {
    pub(crate) disparity: &'a Field,
    pub(crate) gradient: &'a Field,
    pub(crate) residual: &'a Field,
    /// Pixels from the centre of windows to their sides, at most [`RADIUS`].
    pub(crate) radius: usize,
}

impl Round<'_> {
    /// Better disparities, and their standard deviations as residuals tell them, in pixels. NaN stays.
    pub(crate) fn refine(&self) -> (Field, Vec<f32>) {
        let (width, height) = (self.disparity.width, self.disparity.height);
        let mut refined = self.disparity.like(f32::NAN);
        let mut sigma = vec![f32::NAN; width * height];
        let weights = window_weights();
        refined.par_pixels_mut().zip(sigma.par_chunks_mut(width)).enumerate().for_each_init(
            || Slopes::new(self.disparity.stride),
            |slopes, (y, (refined, sigma))| {
                let row = Row { round: self, weights: &weights, y, slopes, refined, sigma };
                on_widest(row);
            },
        );
        (refined, sigma)
    }
}

/// Weights that fall with the distance from the centre: exp(-(distance / RADIUS)^2).
fn window_weights() -> [[f32; SIDE]; SIDE] {
    let from_centre = |k: usize| k as f32 - RADIUS as f32;
    std::array::from_fn(|down| {
        std::array::from_fn(|right| {
            let squared = from_centre(down).powi(2) + from_centre(right).powi(2);
            libm::expf(-squared / (RADIUS * RADIUS) as f32)
        })
    })
}

/// The work of one row.
struct Row<'a> {
    round: &'a Round<'a>,
    weights: &'a [[f32; SIDE]; SIDE],
    y: usize,
    slopes: &'a mut Slopes,
    refined: &'a mut [f32],
    sigma: &'a mut [f32],
}

/// Sums over a window, of eight pixels each.
#[derive(Default)]
struct Normal {
    /// Of weights.
    weight: Floats,
    /// Of weighted distances from the surface.
    distance: Floats,
    /// Of weighted squares of gradients.
    gradients: Floats,
    /// Of weighted products of gradients and residuals.
    product: Floats,
    /// Of weighted squares of residuals.
    residuals: Floats,
    /// Of squares of weighted gradients.
    squared_weights: Floats,
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.slopes.compute(self.round.disparity, self.y);
        let width = self.round.disparity.width;
        let row = self.round.disparity.row(self.y);
        for x in (0..width).step_by(FLOATS) {
            let centre = floats(row, MARGIN + x);
            if centre.iter().all(|value| value.is_nan()) {
                continue;
            }
            let normal = self.accumulate(x, &centre);
            let [step, sigma] = normal.solve();
            let refined = lanes(centre, step, plus);
            let end = width.min(x + FLOATS);
            self.refined[x..end].copy_from_slice(&refined[..end - x]);
            self.sigma[x..end].copy_from_slice(&sigma[..end - x]);
        }
    }
}

impl Row<'_> {
    #[inline(always)]
    fn accumulate(&self, x: usize, centre: &Floats) -> Normal {
        let &Round { disparity, gradient, residual, radius } = self.round;
        let ([along, down], [bend, sag]) = (self.slopes.at(x), self.slopes.bends_at(x));
        let mut normal = Normal::default();
        let rows = self.y.saturating_sub(radius)..(self.y + radius + 1).min(disparity.height);
        for row in rows {
            let weights = &self.weights[row + RADIUS - self.y];
            let below = row as f32 - self.y as f32;
            let middle: Floats =
                std::array::from_fn(|lane| centre[lane] + (down[lane] + sag[lane] * below) * below);
            let columns = weights[RADIUS - radius..=RADIUS + radius].iter();
            for (column, &weight) in columns.enumerate() {
                let at = MARGIN + x + column - radius;
                let right = column as f32 - radius as f32;
                let found = floats(disparity.row(row), at);
                let gradient = floats(gradient.row(row), at);
                let residual = floats(residual.row(row), at);
                let distance = std::array::from_fn(|lane| {
                    found[lane] - (middle[lane] + (along[lane] + bend[lane] * right) * right)
                });
                normal.add(weight, distance, gradient, residual);
            }
        }
        normal
    }
}

impl Normal {
    #[inline(always)]
    fn add(&mut self, weight: f32, distance: Floats, gradient: Floats, residual: Floats) {
        // No comparison with NaN holds.
        let weight = each(distance, |d| if d.abs() < MOST_DISTANCE { weight } else { 0.0 });
        let distance = each(distance, |d| if d.abs() < MOST_DISTANCE { d } else { 0.0 });
        // What the residual would be, were the pixel's disparity the surface's.
        let residual = lanes(residual, lanes(gradient, distance, times), |r, moved| r - moved);
        let weighted = lanes(weight, gradient, times);
        self.weight = lanes(self.weight, weight, plus);
        self.distance = lanes(self.distance, lanes(weight, distance, times), plus);
        self.gradients = lanes(self.gradients, lanes(weighted, gradient, times), plus);
        self.product = lanes(self.product, lanes(weighted, residual, times), plus);
        let squares = lanes(lanes(weight, residual, times), residual, times);
        self.residuals = lanes(self.residuals, squares, plus);
        self.squared_weights = lanes(self.squared_weights, lanes(weighted, weighted, times), plus);
    }

    /// How far to move disparities, and the standard deviations of the results.
    #[inline(always)]
    fn solve(&self) -> [Floats; 2] {
        let variance = lanes(self.residuals, self.weight, |residuals, weight| {
            residuals / (weight - 1.0).max(1.0) + LEAST_VARIANCE
        });
        let prior = each(variance, |variance| variance / (PRIOR_SIGMA * PRIOR_SIGMA));
        let expected =
            lanes(self.distance, self.weight, |distance, weight| distance / weight.max(1.0));
        let information = lanes(self.gradients, prior, plus);
        let pull = lanes(lanes(prior, expected, times), self.product, |prior, own| prior - own);
        let step = lanes(pull, information, |pull, information| {
            (pull / information).clamp(-MOST_MOVE, MOST_MOVE)
        });
        let noise = lanes(variance, lanes(self.squared_weights, prior, plus), times);
        [step, lanes(noise, information, |noise, information| noise.sqrt() / information)]
    }
}
