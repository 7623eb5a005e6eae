//! From what each camera says of a located point to the point's covariance, and to how badly the
//! rays may miss each other.

use super::{Located, Residual};
use crate::geometry::{Pixel, Point3};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// What one camera says of a located point.
pub(super) struct Observation {
    /// Seen.
    pub(super) pixel: Pixel,
    /// Where the point falls.
    pub(super) predicted: Pixel,
    /// Derivatives of that by the world coordinates.
    pub(super) slopes: Matrix2x3<f64>,
    /// Covariance of a seen pixel about a predicted one, detector's and fit's, in squared pixels.
    pub(super) covariance: Matrix2<f64>,
    /// What its squared error counts in the search for the point.
    pub(super) weight: f64,
}

impl Located {
    /// The point with the least sum of weighted squared pixel errors. First order in the errors;
    /// nothing is assumed of the weights, so that cameras known unequally well may count alike.
    /// `None` where the rays do not determine a point.
    pub(super) fn by_least_squares(point: Point3, observations: &[Observation]) -> Option<Self> {
        Self::by_linked_cameras(point, observations, Matrix3::zeros())
    }

    /// [`Located::by_least_squares`] where cameras err in common: `shared` is what that adds to the
    /// covariance of the equations' right side.
    pub(super) fn by_linked_cameras(
        point: Point3,
        observations: &[Observation],
        shared: Matrix3<f64>,
    ) -> Option<Self> {
        let (mut normal, mut errors) = (Matrix3::zeros(), shared);
        let (mut plain, mut crossed) = (Matrix3::zeros(), Matrix3::zeros());
        let (mut squares, mut expected) = (0.0, 0.0);
        for Observation { pixel, predicted, slopes, covariance: own, weight } in observations {
            let (turned, square) = (slopes.transpose(), slopes.transpose() * slopes);
            let carried = turned * own * slopes;
            normal += square * *weight;
            plain += square;
            crossed += carried * *weight;
            errors += carried * (weight * weight);
            squares += (pixel - predicted).norm_squared();
            expected += own.trace();
        }
        let inverse = normal.try_inverse()?;
        let covariance = inverse * errors * inverse;
        let covariance = (covariance + covariance.transpose()) * 0.5;
        // What is left of errors e after the point has followed them is (I - J K) e with
        // K = (J'WJ)^-1 J'W; the mean of its square, from the traces.
        expected += (covariance * plain).trace() - 2.0 * (inverse * crossed).trace();
        let freedom = 2 * observations.len() - 3;
        let finite = point.iter().chain(covariance.iter()).all(|value| value.is_finite());
        finite.then_some(Self {
            point,
            covariance,
            residual: Some(Residual {
                rms: (squares / (2 * observations.len()) as f64).sqrt(),
                sigma: (expected.max(0.0) / freedom as f64).sqrt(),
            }),
        })
    }

    /// The same where cameras are besides displaced by independent causes that they have in common:
    /// `displaced` has, one observation each, by how much each cause displaces the point's pixel. They leave
    /// the residual as it is: cameras that follow the same charts go on to agree with each other.
    pub(super) fn with_displaced_cameras(
        mut self,
        observations: &[Observation],
        displaced: &[Vec<Vector2<f64>>],
    ) -> Option<Self> {
        let causes = displaced.first().map_or(0, Vec::len);
        if causes == 0 {
            return Some(self);
        }
        let weighed =
            |observation: &Observation| observation.slopes.transpose() * observation.weight;
        let normal: Matrix3<f64> =
            observations.iter().map(|observation| weighed(observation) * observation.slopes).sum();
        let inverse = normal.try_inverse()?;
        for cause in 0..causes {
            let pixels = observations.iter().zip(displaced);
            let right: Vector3<f64> = pixels
                .filter_map(|(observation, by)| Some(weighed(observation) * by.get(cause)?))
                .sum();
            let by = inverse * right;
            self.covariance += by * by.transpose();
        }
        self.covariance.iter().all(|value| value.is_finite()).then_some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    #[test]
    fn covariance_and_residual_are_those_of_repeated_measurement() {
        let mut random = Random::new(11);
        let slopes: Vec<Matrix2x3<f64>> =
            (0..3).map(|_| Matrix2x3::from_fn(|_, _| random.normal())).collect();
        let roots: Vec<Matrix2<f64>> =
            (0..3).map(|_| Matrix2::from_fn(|_, _| random.normal())).collect();
        let weights = [1.0, 0.3, 2.0];
        let located = |errors: &[Vector2<f64>]| {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for ((slopes, error), weight) in slopes.iter().zip(errors).zip(weights) {
                normal += slopes.transpose() * slopes * weight;
                right += slopes.transpose() * error * weight;
            }
            let point = Point3::from(normal.try_inverse().unwrap() * right);
            let observation = |index: usize| Observation {
                pixel: Pixel::from(errors[index]),
                predicted: Pixel::from(slopes[index] * point.coords),
                slopes: slopes[index],
                covariance: roots[index] * roots[index].transpose(),
                weight: weights[index],
            };
            Located::by_least_squares(point, &[0, 1, 2].map(observation)).unwrap()
        };
        const DRAWS: usize = 40_000;
        let (mut scatter, mut squares) = (Matrix3::zeros(), 0.0);
        let mut told = None;
        for _ in 0..DRAWS {
            let errors: Vec<Vector2<f64>> = roots
                .iter()
                .map(|root| root * Vector2::new(random.normal(), random.normal()))
                .collect();
            let found = located(&errors);
            scatter += found.point.coords * found.point.coords.transpose() / DRAWS as f64;
            squares += found.residual.unwrap().rms.powi(2) * 6.0 / 3.0 / DRAWS as f64;
            told = Some(found);
        }
        let told = told.unwrap();
        assert!((told.covariance - scatter).norm() < 0.03 * scatter.norm());
        assert!((told.residual.unwrap().sigma.powi(2) / squares - 1.0).abs() < 0.03);
    }
}
