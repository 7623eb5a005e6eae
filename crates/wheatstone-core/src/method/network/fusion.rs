//! What the networks of several sets of cameras say of one point, in one.
//!
//! Networks of two pairs that share a camera share the noise of its pixels, and all follow the same charts: their
//! errors are correlated, and an average that is weighted by their own covariances alone would be too sure of itself.
//! Each says how it depends on every pixel, so that generalised least squares knows (Aitken 1935,
//! doi:10.1017/S0370164600014346).

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use wheatstone_numeric::matrix_product::product;

/// What one network says of a point.
pub(super) struct Estimate {
    pub(super) targets: [f64; 3],
    /// Derivatives of the targets by both coordinates of each camera's pixel, three rows; 0 for cameras that are not
    /// of its set.
    pub(super) by_pixels: DMatrix<f64>,
    /// Standard deviation of a pixel coordinate, with what networks miss of the optics alike.
    pub(super) sigma: f64,
    /// By how much the targets err with each of the charts' motions, three rows.
    pub(super) by_places: DMatrix<f64>,
    /// Covariance of the targets: what these two make, and what is the network's own.
    pub(super) covariance: Matrix3<f64>,
}

/// Networks know their slopes to a tenth or two, and what differs by less than that between two of them would make
/// points seem surer than they are: each has this share of its covariance once more as its own. Without it the 70 %
/// ellipsoids of points that three pairs located held 60 %.
const SLOPES: f64 = 0.2;

/// The product of a matrix with itself, turned: what unit errors make.
fn square(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    product(matrix, &matrix.transpose())
}

/// The most likely targets, and their covariance; `None` where there is nothing to go by.
pub(super) fn fused(estimates: &[Estimate]) -> Option<([f64; 3], Matrix3<f64>)> {
    let first = estimates.first()?;
    if estimates.len() == 1 {
        return Some((first.targets, first.covariance));
    }
    let count = 3 * estimates.len();
    let mut by_pixels = DMatrix::zeros(count, first.by_pixels.ncols());
    let mut by_places = DMatrix::zeros(count, first.by_places.ncols());
    let mut targets = DVector::zeros(count);
    for (index, estimate) in estimates.iter().enumerate() {
        by_pixels.rows_mut(3 * index, 3).copy_from(&(&estimate.by_pixels * estimate.sigma));
        by_places.rows_mut(3 * index, 3).copy_from(&estimate.by_places);
        targets.rows_mut(3 * index, 3).copy_from_slice(&estimate.targets);
    }
    let mut covariance = square(&by_pixels) + square(&by_places);
    for (index, estimate) in estimates.iter().enumerate() {
        let mut block = covariance.fixed_view_mut::<3, 3>(3 * index, 3 * index);
        block.copy_from(&(estimate.covariance * (1.0 + SLOPES)));
    }
    let each = DMatrix::from_fn(count, 3, |row, target| f64::from(u8::from(row % 3 == target)));
    let weights = covariance.cholesky()?.solve(&each);
    let precision = product(&each.transpose(), &weights).fixed_view::<3, 3>(0, 0).into_owned();
    let found = precision.try_inverse()?;
    let pull = weights.tr_mul(&targets);
    let targets = found * Vector3::new(pull[0], pull[1], pull[2]);
    Some((targets.into(), (found + found.transpose()) / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    const OWN: f64 = 1e-4;

    /// Three pairs of three cameras, each pair with the noise of four of six pixel coordinates.
    fn pairs(random: &mut Random) -> Vec<Estimate> {
        let pair =
            |unseen: usize| {
                let by_pixels = DMatrix::from_fn(3, 6, |_, column| {
                    if column / 2 == unseen { 0.0 } else { random.normal() }
                });
                let noise = square(&by_pixels).fixed_view::<3, 3>(0, 0) * 0.01;
                let covariance = noise + Matrix3::identity() * OWN;
                let by_places = DMatrix::zeros(3, 0);
                Estimate { targets: [0.0; 3], by_pixels, sigma: 0.1, by_places, covariance }
            };
        (0..3).map(pair).collect()
    }

    #[test]
    fn noise_that_pairs_share_counts_once() {
        let mut random = Random::new(4);
        let (mut squares, trials) = (0.0, 2000);
        for _ in 0..trials {
            let mut estimates = pairs(&mut random);
            let noise: Vec<f64> = (0..6).map(|_| 0.1 * random.normal()).collect();
            let noise = DMatrix::from_column_slice(6, 1, &noise);
            for estimate in &mut estimates {
                let errors = product(&estimate.by_pixels, &noise);
                let unsure =
                    (SLOPES * estimate.covariance + Matrix3::identity() * OWN).cholesky().unwrap();
                let own = Vector3::from_fn(|_, _| random.normal());
                let own = unsure.l() * own;
                estimate.targets = [0, 1, 2].map(|k| errors[k] + own[k]);
            }
            let (found, covariance) = fused(&estimates).unwrap();
            let found = Vector3::from(found);
            squares += found.dot(&(covariance.try_inverse().unwrap() * found)) / 3.0;
        }
        let mean = squares / f64::from(trials);
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }

    #[test]
    fn one_network_is_taken_at_its_word() {
        let one = pairs(&mut Random::new(5)).remove(0);
        let (_, covariance) = fused(std::slice::from_ref(&one)).unwrap();
        assert_eq!(covariance, one.covariance);
    }
}
