//! What a fit leaves open about a parametric camera, and what that means for its pixels.

use super::{fitted_camera::FittedCamera, pixel_noise::PixelNoise};
use crate::{
    camera::{
        AdjustableCamera,
        posed_lens::{MOST_UNKNOWNS, POSE},
    },
    geometry::{Pixel, Point3, Vector3},
};
use nalgebra::{DMatrix, Matrix2, Matrix3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::covariance::{Covariance, LeastSquaresCovariance};

/// How far pixels lie from where a camera expects them, and how sure its adjusted numbers are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraUncertainty {
    /// About its predictions.
    pub noise: PixelNoise,
    /// What a squared pixel of its error counts beside those of other cameras.
    #[serde(default = "one")]
    pub weight: f64,
    /// The numbers that were adjusted: 0 to 2 a turn of the world about `about`, 3 to 5 a move, in
    /// the lens's frame; then the model's own.
    adjusted: Vec<usize>,
    /// The middle of the points fitted: about it turns and moves hardly depend on each other.
    about: Point3,
    /// Of the adjusted numbers.
    covariance: Covariance,
    /// With the numbers of all cameras before it, row by row, where charts whose places were found link
    /// them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    shared: Vec<f64>,
}

/// Of cameras fitted before they were weighed.
fn one() -> f64 {
    1.0
}

/// What a squared pixel of error counts, a camera: one over its noise's variance where the cameras clearly differ, else
/// all alike. Of each camera the sum of its squared errors and their degrees of freedom.
pub(super) fn weights(cameras: &[(f64, f64)]) -> Vec<f64> {
    /// Ratio of variances. What weights gain below it is less than a percent.
    const WORTH: f64 = 1.3;
    /// Standard deviations of the logarithm of the ratio of two variances that are the same.
    const CHANCE: f64 = 3.0;
    /// Squared pixels. Errors of rounding say nothing of a camera.
    const LEAST: f64 = 1e-8;
    let variances: Vec<f64> =
        cameras.iter().map(|(squares, freedom)| (squares / freedom.max(1.0)).max(LEAST)).collect();
    let least = variances.iter().copied().fold(f64::INFINITY, f64::min);
    let most = variances.iter().copied().fold(0.0, f64::max);
    let fewest = cameras.iter().map(|(_, freedom)| freedom.max(1.0)).fold(f64::INFINITY, f64::min);
    let by_chance = libm::exp(CHANCE * (4.0 / fewest).sqrt());
    let differ = most > least * WORTH.max(by_chance);
    variances.iter().map(|variance| if differ { 1.0 / variance } else { 1.0 }).collect()
}

impl CameraUncertainty {
    /// Of a camera adjusted to `pairs`, the best fit for its `adjusted` numbers; `beside` them so many
    /// others were fitted to its pixels.
    pub(super) fn new<L: AdjustableCamera>(
        camera: &FittedCamera<L>,
        (adjusted, beside): (&[usize], f64),
        pairs: &[(Point3, Pixel)],
    ) -> Option<Self> {
        let middle = pairs.iter().map(|(world, _)| world.coords).sum::<Vector3>();
        let seen = pairs.iter().filter_map(|(world, pixel)| {
            Some((*pixel, (camera.project(*world)? - pixel).norm_squared()))
        });
        let mut rising = adjusted.to_vec();
        rising.sort_unstable();
        let mut found = Self {
            noise: PixelNoise::fit(&seen.collect::<Vec<_>>(), adjusted.len() as f64 + beside),
            weight: 1.0,
            adjusted: rising,
            about: Point3::from(middle / pairs.len() as f64),
            covariance: Covariance::default(),
            shared: Vec::new(),
        };
        let mut spread = LeastSquaresCovariance::new(adjusted.len());
        for (world, pixel) in pairs {
            let slopes = found.slopes(camera, *world)?;
            let variance = found.noise.variance(*pixel);
            for axis in 0..2 {
                let row: Vec<f64> =
                    slopes[..adjusted.len()].iter().map(|slope| slope[axis]).collect();
                spread.add(&row, variance);
            }
        }
        found.covariance = spread.covariance()?;
        Some(found)
    }

    /// Of a camera whose numbers are taken for exact, with even noise of its pixels.
    #[must_use]
    pub fn known(pixel_sigma: f64) -> Self {
        Self {
            noise: PixelNoise::even(pixel_sigma * pixel_sigma),
            weight: 1.0,
            adjusted: Vec::new(),
            about: Point3::origin(),
            covariance: Covariance::default(),
            shared: Vec::new(),
        }
    }

    /// The middle of the points fitted.
    pub(super) fn middle(&self) -> Point3 {
        self.about
    }

    /// Covariance of two of the model's own numbers; `None` where one was not adjusted.
    pub(super) fn of_model(&self, first: usize, second: usize) -> Option<f64> {
        let place = |number: usize| self.adjusted.iter().position(|own| *own == POSE + number);
        self.covariance.between(place(first)?, place(second)?)
    }

    /// How many numbers were adjusted.
    pub(super) fn numbers(&self) -> usize {
        self.adjusted.len()
    }

    /// Takes its part of the covariance of all cameras' numbers, which begins at `first`.
    pub(super) fn take(&mut self, all: &DMatrix<f64>, first: usize) {
        let count = self.numbers();
        self.covariance = Covariance::of(&all.view((first, first), (count, count)).into_owned());
        let row = |row: usize| (0..first).map(move |column| all[(row, column)]);
        self.shared = (first..first + count).flat_map(row).collect();
    }

    /// What it has in common with cameras before it, for right sides of a point's equations: of each
    /// camera the derivatives of the point's right side by its numbers.
    pub(super) fn shared_with(&self, own: &[Vector3], earlier: &[Vector3]) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        if self.shared.is_empty() {
            return sum;
        }
        for (own, row) in own.iter().zip(self.shared.chunks_exact(earlier.len().max(1))) {
            let other: Vector3 = earlier.iter().zip(row).map(|(other, value)| other * *value).sum();
            sum += own * other.transpose();
        }
        sum + sum.transpose()
    }

    /// Whether it is linked with other cameras.
    pub(super) fn is_linked(&self) -> bool {
        !self.shared.is_empty()
    }

    /// Derivatives of a world point's pixel by the adjusted numbers.
    pub(super) fn slopes<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        world: Point3,
    ) -> Option<[[f64; 2]; MOST_UNKNOWNS]> {
        let point = camera.before_lens(world);
        let turned = point - camera.before_lens(self.about);
        let count = self.adjusted.last().map_or(0, |last| (last + 1).saturating_sub(POSE));
        let mut own = [[0.0; 2]; MOST_UNKNOWNS];
        let (_, by_point) = camera.model.project_with_slopes(point, own.get_mut(..count)?)?;
        let by_turn = -(by_point * turned.cross_matrix());
        let mut slopes = [[0.0; 2]; MOST_UNKNOWNS];
        for (slope, index) in slopes.iter_mut().zip(&self.adjusted) {
            *slope = match index {
                0..3 => by_turn.column(*index).into_owned().into(),
                3..POSE => by_point.column(index - 3).into_owned().into(),
                _ => *own.get(index - POSE)?,
            };
        }
        Some(slopes)
    }

    /// Covariance of a pixel of this point about its prediction.
    pub(super) fn pixel_covariance<L: AdjustableCamera>(
        &self,
        camera: &FittedCamera<L>,
        world: Point3,
        pixel: Pixel,
    ) -> Option<Matrix2<f64>> {
        let slopes = self.slopes(camera, world)?;
        let noise = Matrix2::from_diagonal_element(self.noise.variance(pixel));
        Some(noise + self.covariance.of_two(&slopes[..self.adjusted.len()]))
    }

    /// Whether it can be that of a camera whose model has so many numbers, after cameras with so many
    /// adjusted ones.
    pub(super) fn is_consistent(&self, numbers: usize, earlier: usize) -> bool {
        self.noise.is_consistent()
            && self.weight > 0.0
            && self.weight.is_finite()
            && self.adjusted.len() <= MOST_UNKNOWNS
            && self.adjusted.windows(2).all(|pair| pair[0] < pair[1])
            && self.adjusted.iter().all(|index| *index < POSE + numbers)
            && self.about.iter().all(|value| value.is_finite())
            && self.covariance.is_sound(self.adjusted.len())
            && (self.shared.is_empty() || self.shared.len() == self.numbers() * earlier)
            && self.shared.iter().all(|value| value.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_are_weighed_where_their_noises_differ_by_more_than_chance() {
        assert_eq!(weights(&[(8.0, 800.0), (32.0, 800.0)]), [100.0, 25.0]);
        // A fifth more is not worth it, and twice as much of twenty is chance.
        assert_eq!(weights(&[(8.0, 800.0), (9.6, 800.0)]), [1.0, 1.0]);
        assert_eq!(weights(&[(0.2, 20.0), (0.4, 20.0)]), [1.0, 1.0]);
        // Errors of rounding.
        assert_eq!(weights(&[(1e-20, 800.0), (1e-24, 800.0)]), [1.0, 1.0]);
    }
}
