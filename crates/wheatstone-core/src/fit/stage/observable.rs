//! What of the charts' motions the pixels show, and whether it is more than chance.

use super::{Significance, ViewOffset, charts::Placement, joint::Joint};
use crate::method::neural_camera::{
    chart_poses::{MOTION, UncertainPose},
    uncertain_poses::Information,
};
use nalgebra::{DMatrix, DVector};

/// Placements that spread less than this share of their longest spread along a direction have no
/// extent there.
const NO_SPREAD: f64 = 0.05;

/// Projection that takes away the best affine function of the placements' middles, `(views, views)`.
fn beside_affine(placements: &[Placement]) -> DMatrix<f64> {
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
    placements: &[Placement],
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
        let seen = &beside * &covariance * &beside;
        let sigma = |matrix: &DMatrix<f64>| matrix.diagonal().map(|value| value.max(0.0).sqrt());
        (sigma(&covariance), &beside * whole, sigma(&seen))
    };
    let axes = [along(0), along(1), along(2)];
    let offset = |(view, placement): (usize, &Placement)| {
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

/// Whether the charts stood elsewhere, by directions of which the pixels say more than the prior;
/// `sigma` is that of the prior.
pub(super) fn significance(joint: &Joint<'_>, sigma: f64) -> Significance {
    let mut directions = directions(&joint.information, Part::Offset);
    directions.retain(|(information, _)| *information > 1.0);
    Significance {
        chi_square: directions.iter().map(|direction| direction.1).sum::<f64>()
            / joint.disagreement.max(1.0),
        degrees: directions.len(),
        estimated_sigma: sigma * most_likely_scale(&directions),
    }
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
