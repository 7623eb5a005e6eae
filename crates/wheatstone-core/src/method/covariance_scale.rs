//! By how much covariances are scaled, and along which directions, where a camera model does not hold.
//!
//! Fitted cameras take what is left of their pixels for noise, independent from camera to camera. What a lens does that its
//! model lacks is no such noise: it displaces a point's pixels alike in all cameras, so that points err more across the rays
//! than their covariances say, and less along them. The errors of the fitted points, each in units of its own covariance,
//! show by how much. Their scatter is that of a multivariate t distribution (Lange, Little & Taylor 1989,
//! doi:10.2307/2290063), for which single points count little.

use super::Reconstructor;
use crate::{
    dataset::Dataset,
    geometry::{Vector3, axes_of},
};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A scale of covariances. Those of a model that holds are left as they are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CovarianceScale {
    /// Orthonormal columns: the frame of the scale, whose first axis is that along which points are known worst, on average.
    axes: Matrix3<f64>,
    /// Scatter of errors in units of their covariances' Cholesky factors in that frame: the identity where these hold.
    scatter: Matrix3<f64>,
    /// Whether it is for the noise that few points leave uncertain, and of no use where the noise is given.
    #[serde(default)]
    is_of_few: bool,
}

/// With fewer points their scatter is too uncertain.
const LEAST_POINTS: usize = 60;

/// So many points tell it well enough.
const MOST_POINTS: usize = 2000;

/// Scales of variance along every direction that pass for none: where a model holds, points leave the scatter uncertain by
/// less, and scaling would only add to its noise.
const NONE: [f64; 2] = [1.0 / 1.5, 1.5];

/// A factor of variance that is worth it.
const WORTH: f64 = 1.02;

/// Degrees of freedom of the t distribution: few, for errors that no noise makes have no tails that are known.
const FREEDOM: f64 = 4.0;

/// The median of chi-square with three degrees of freedom.
const MEDIAN: f64 = 2.366;

impl CovarianceScale {
    /// From the errors of `map` on the points that it was fitted to, and from how few they are; `None` where its
    /// covariances hold.
    #[must_use]
    pub fn fit(map: &dyn Reconstructor, train: &Dataset) -> Option<Self> {
        // Charts whose places were found have taken the errors into themselves.
        if train.has_estimated_poses() {
            return None;
        }
        let count = train.known().count();
        let taken_up = map.effective_parameters()?;
        let by_number = Self::of_few((count as f64 - taken_up) * (2 * train.cameras) as f64);
        if taken_up >= 0.5 * count as f64 || count < LEAST_POINTS {
            return by_number;
        }
        // The fit took a part of the errors into itself.
        let lost = count as f64 / (count as f64 - taken_up);
        let step = count.div_ceil(MOST_POINTS).max(1);
        let points = train.known().step_by(step).filter_map(|(world, row)| {
            let found = map.locate(&row.pixels)?;
            Some((found.point - world, found.covariance))
        });
        let points: Vec<(Vector3, Matrix3<f64>)> = points.collect();
        let sum: Matrix3<f64> = points.iter().map(|(_, covariance)| covariance).sum();
        let axes = Matrix3::from_columns(&axes_of(sum).0);
        let whitened = points.iter().filter_map(|(error, covariance)| {
            let root = (axes.transpose() * covariance * axes).cholesky()?;
            let whitened = root.l_dirty().solve_lower_triangular(&(axes.transpose() * error))?;
            whitened.iter().all(|value| value.is_finite()).then_some(whitened)
        });
        let whitened: Vec<Vector3> = whitened.collect();
        if whitened.len() < LEAST_POINTS {
            return by_number;
        }
        let scatter = scatter(&whitened)? * lost;
        let (_, scales) = axes_of(scatter);
        let holds = scales.iter().all(|scale| (NONE[0]..=NONE[1]).contains(scale));
        if holds { by_number } else { Some(Self { axes, scatter, is_of_few: false }) }
    }

    /// Of noise that was estimated from so many degrees of freedom: errors in units of it are Student's t, of which this
    /// is the covariance.
    fn of_few(freedom: f64) -> Option<Self> {
        /// Below so many it has no covariance.
        const LEAST: f64 = 3.0;
        let freedom = freedom.max(LEAST);
        let factor = freedom / (freedom - 2.0);
        let (axes, scatter) = (Matrix3::identity(), Matrix3::identity() * factor);
        (factor > WORTH).then_some(Self { axes, scatter, is_of_few: true })
    }

    /// Whether it is for the noise that few points leave uncertain, and of no use where the noise is given.
    #[must_use]
    pub fn is_of_few(&self) -> bool {
        self.is_of_few
    }

    /// A point's covariance, scaled; as it is where it is not positive definite.
    #[must_use]
    pub fn of(&self, covariance: Matrix3<f64>) -> Matrix3<f64> {
        let Some(root) = (self.axes.transpose() * covariance * self.axes).cholesky() else {
            return covariance;
        };
        let root = self.axes * root.unpack();
        let scaled = root * self.scatter * root.transpose();
        (scaled + scaled.transpose()) * 0.5
    }

    /// By how much standard deviations are scaled along the directions in which that is least and most.
    #[must_use]
    pub fn range(&self) -> [f64; 2] {
        let (_, [most, _, least]) = axes_of(self.scatter);
        [least, most].map(|variance| variance.max(0.0).sqrt())
    }

    pub(crate) fn is_consistent(&self) -> bool {
        /// Far above rounding, far below anything a file could mean.
        const CROOKED: f64 = 1e-6;
        let square = self.axes * self.axes.transpose() - Matrix3::identity();
        square.norm() < CROOKED
            && (self.scatter - self.scatter.transpose()).norm() <= CROOKED * self.scatter.norm()
            && self.scatter.iter().all(|value| value.is_finite())
            && self.scatter.cholesky().is_some()
    }
}

/// The scatter of points about zero by maximum likelihood for t, of such a size that half of the points lie where half of
/// normal ones would.
fn scatter(points: &[Vector3]) -> Option<Matrix3<f64>> {
    /// Each step divides what is missing by about three.
    const STEPS: usize = 30;
    let mut found = Matrix3::identity();
    for _ in 0..STEPS {
        let inverse = found.try_inverse()?;
        let weighed = points.iter().map(|point| {
            let weight = (FREEDOM + 3.0) / (FREEDOM + point.dot(&(inverse * point)));
            point * point.transpose() * weight
        });
        found = weighed.sum::<Matrix3<f64>>() / points.len() as f64;
    }
    let inverse = found.try_inverse()?;
    let mut squares: Vec<f64> = points.iter().map(|point| point.dot(&(inverse * point))).collect();
    let (_, median, _) = squares.select_nth_unstable_by(points.len() / 2, f64::total_cmp);
    Some(found * (*median / MEDIAN))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    #[test]
    fn scatter_is_that_of_the_draws_whatever_a_few_of_them_are() {
        let mut random = Random::new(5);
        let root = Matrix3::new(2.0, 0.0, 0.0, 0.5, 1.0, 0.0, -0.2, 0.3, 0.4);
        let mut draw = || root * Vector3::from_fn(|_, _| random.normal());
        let mut points: Vec<Vector3> = (0..4000).map(|_| draw()).collect();
        let truth = root * root.transpose();
        let off = |found: Matrix3<f64>| (found - truth).norm() / truth.norm();
        assert!(off(scatter(&points).unwrap()) < 0.05);
        // One in a hundred a hundred times as far off.
        points.iter_mut().step_by(100).for_each(|point| *point *= 100.0);
        assert!(off(scatter(&points).unwrap()) < 0.1);
    }

    #[test]
    fn a_scale_is_the_same_in_whatever_signs_and_order_a_covariance_comes() {
        let scale = CovarianceScale {
            axes: Matrix3::identity(),
            scatter: Matrix3::from_diagonal(&Vector3::new(4.0, 9.0, 1.0)),
            is_of_few: false,
        };
        let covariance = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, 3.0));
        let expected = Matrix3::from_diagonal(&Vector3::new(8.0, 9.0, 3.0));
        assert!((scale.of(covariance) - expected).norm() < 1e-12);
        let flipped = CovarianceScale { axes: -Matrix3::identity(), ..scale };
        assert!((flipped.of(covariance) - expected).norm() < 1e-12);
        assert_eq!(scale.range(), [1.0, 3.0]);
        // Of exact data nothing is uncertain.
        assert_eq!(scale.of(Matrix3::zeros()), Matrix3::zeros());
    }
}
