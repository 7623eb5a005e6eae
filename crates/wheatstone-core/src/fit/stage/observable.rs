//! What of the charts' motions the pixels show, and whether it is more than chance.

use super::charts::ChartPosition;
use crate::method::neural_camera::{
    chart_poses::{MOTION, UncertainPose},
    uncertain_poses::Information,
};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::matrix_product::product;

/// Where one chart stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewOffset {
    /// The view's name, or the layer's.
    pub view: String,
    /// Where the middle of its points stood less where it was said to stand, in world units.
    pub offset: [f64; 3],
    /// By how much the chart was turned about that middle: a rotation vector along the world's axes,
    /// in radians.
    pub rotation: [f64; 3],
    /// Standard deviation of `offset`, with what cannot be seen.
    pub sigma: [f64; 3],
    /// The part of `offset` that the pixels show: what is left when the best affine function of the
    /// place over all views is taken away.
    pub observable: [f64; 3],
    /// Standard deviation of `observable`.
    pub observable_sigma: [f64; 3],
}

/// Whether the charts stood elsewhere at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Significance {
    /// Sum of squares of what the pixels say against the places as given, in standard deviations:
    /// about `degrees` if the charts stood where they were said to. Less by as much as the cameras
    /// contradict each other.
    pub chi_square: f64,
    /// In how many directions the pixels say more than the prior did.
    pub degrees: usize,
    /// The standard deviation of the places (world units, each axis) that explains this best; 0 where
    /// the pixels' noise does.
    pub estimated_sigma: f64,
}

impl Significance {
    /// Whether chance is out of the question: five standard deviations of the chi-square beyond its
    /// mean, which leaves room for noise that is not quite normal.
    #[must_use]
    pub fn is_clear(&self) -> bool {
        let degrees = self.degrees as f64;
        self.degrees > 0 && self.chi_square > degrees + 5.0 * (2.0 * degrees).sqrt()
    }
}

/// Placements that spread less than this share of their longest spread along a direction have no
/// extent there.
const NO_SPREAD: f64 = 0.05;

/// Projection that takes away the best affine function of the placements' middles, `(views, views)`.
fn beside_affine(placements: &[ChartPosition]) -> DMatrix<f64> {
    let count = placements.len();
    let mut projection = DMatrix::identity(count, count);
    let mut places = DMatrix::from_fn(count, 3, |view, axis| placements[view].centre[axis]);
    for mut column in places.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    let svd = places.svd(true, false);
    let most = svd.singular_values.amax();
    let mut basis = vec![DVector::from_element(count, 1.0 / (count as f64).sqrt())];
    if let Some(left) = svd.u {
        let spread = |index: &usize| svd.singular_values[*index] > NO_SPREAD * most;
        let directions = (0..svd.singular_values.len()).filter(spread);
        basis.extend(directions.map(|index| left.column(index).into_owned()));
    }
    for vector in basis {
        projection -= &vector * vector.transpose();
    }
    projection
}

/// The charts' offsets, whole and as far as they can be seen; `motions` is the covariance of all
/// motions in units of their priors.
pub(super) fn offsets(
    placements: &[ChartPosition],
    charts: &[UncertainPose],
    motions: &DMatrix<f64>,
) -> Vec<ViewOffset> {
    let count = placements.len();
    let beside = beside_affine(placements);
    let along = |axis: usize| {
        let whole = DVector::from_fn(count, |view, _| charts[view].moved_by().0[axis]);
        let covariance = DMatrix::from_fn(count, count, |a, b| {
            let scale = charts[a].sigma[axis] * charts[b].sigma[axis];
            scale * motions[(MOTION * a + axis, MOTION * b + axis)]
        });
        let seen = product(&product(&beside, &covariance), &beside);
        let sigma = |matrix: &DMatrix<f64>| matrix.diagonal().map(|value| value.max(0.0).sqrt());
        (sigma(&covariance), &beside * whole, sigma(&seen))
    };
    let axes = [along(0), along(1), along(2)];
    let offset = |(view, placement): (usize, &ChartPosition)| {
        let (offset, rotation) = charts[view].moved_by();
        ViewOffset {
            view: placement.name.clone(),
            offset: offset.into(),
            rotation: rotation.into(),
            sigma: [0, 1, 2].map(|axis: usize| axes[axis].0[view]),
            observable: [0, 1, 2].map(|axis: usize| axes[axis].1[view]),
            observable_sigma: [0, 1, 2].map(|axis: usize| axes[axis].2[view]),
        }
    };
    placements.iter().enumerate().map(offset).collect()
}

/// Half of the numbers of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Offsets.
    Offset,
    /// Rotations.
    Rotation,
}

impl Part {
    /// Whether a number of all motions is one of this part.
    pub(super) fn holds(self, index: usize) -> bool {
        (index % MOTION < 3) == (self == Self::Offset)
    }
}

/// What the pixels say of one part of the motions, whatever the other is, along independent
/// directions: information in units of the prior's, and the square of the score in units of its own
/// standard deviation (1 in the mean if nothing moved).
pub(super) fn directions(said: &Information, part: Part) -> Vec<(f64, f64)> {
    let (own, other): (Vec<usize>, Vec<usize>) =
        (0..said.vector.len()).partition(|index| part.holds(*index));
    let block = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |a, b| said.matrix[(rows[a], columns[b])])
    };
    let entries = |rows: &[usize]| DVector::from_fn(rows.len(), |a, _| said.vector[rows[a]]);
    let others = block(&other, &other) + DMatrix::identity(other.len(), other.len());
    let Some(factors) = others.cholesky() else { return Vec::new() };
    let mixed = block(&other, &own);
    let matrix = block(&own, &own) - mixed.tr_mul(&factors.solve(&mixed));
    let vector = entries(&own) - mixed.tr_mul(&factors.solve(&entries(&other)));
    let eigen = ((&matrix + matrix.transpose()) * 0.5).symmetric_eigen();
    let information = eigen.eigenvalues.iter().enumerate();
    information
        // Less than this is rounding.
        .filter(|(_, information)| **information > 1e-9 * eigen.eigenvalues.amax())
        .map(|(index, information)| {
            let score = eigen.eigenvectors.column(index).dot(&vector);
            (*information, score * score / information)
        })
        .collect()
}

/// The scale `s` of the prior that makes the scores most likely: each square is chi-square of one
/// degree times `1 + information s^2`.
pub(super) fn most_likely_scale(directions: &[(f64, f64)]) -> f64 {
    let slope = |variance: f64| {
        let one = |(information, square): &(f64, f64)| {
            let spread = 1.0 + information * variance;
            information * (square / spread - 1.0) / spread
        };
        directions.iter().map(one).sum::<f64>()
    };
    if directions.is_empty() || slope(0.0) <= 0.0 {
        return 0.0;
    }
    // Where the likelihood stops rising, by bisection over twenty powers of ten.
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(libm::exp10(middle)) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    libm::exp10(0.25 * (low + high))
}
