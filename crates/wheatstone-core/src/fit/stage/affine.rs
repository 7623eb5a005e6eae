//! What no pixel shows of where charts stood: affine maps of the world that leave every chart rigid.
//!
//! Cameras that may be of any optics see a world that was moved, turned, stretched or sheared as well as
//! the one that it was made of. Of all affine maps those are left that do not deform the charts, whose
//! shapes are known: a stage's shift, its scale, its skew, turns of everything. Where charts stood is then
//! known up to such a map, of which the pixels say nothing and the prior alone says something. Adjusted
//! charts have some of it all the same, where a lens model does not quite fit: it is taken out of them, in
//! the measure of the prior.

use super::charts::ChartPosition;
use crate::{
    geometry::{
        Point3, StageCovariance, Vector3, principal_axes,
        stage_covariance::{AFFINE, ViewCovariance, affine_weights},
    },
    method::neural_camera::chart_poses::{MOTION, UncertainPose},
};
use nalgebra::{DMatrix, Matrix3, Matrix6, SMatrix};
use wheatstone_numeric::matrix_product::product;

/// A map that deforms charts by less than this share of what it moves them by, root mean square, cannot be seen:
/// of a shift by a millimetre, a micrometre.
const RIGID: f64 = 1e-3;

/// Affine maps of the world that leave charts rigid.
pub(super) struct AffineMaps {
    centre: Point3,
    /// Independent ones, a column each, by the numbers of an affine map.
    maps: DMatrix<f64>,
    /// By how much the charts move with each of them, in units of their priors' standard deviations.
    motions: DMatrix<f64>,
}

impl AffineMaps {
    pub(super) fn of(placements: &[ChartPosition], charts: &[UncertainPose]) -> Self {
        let sum: Vector3 = placements.iter().map(|placement| placement.centre.coords).sum();
        let centre = Point3::from(sum / placements.len() as f64);
        let mut motions = DMatrix::zeros(MOTION * charts.len(), AFFINE);
        let (mut moved, mut seen) = (Square::zeros(), Square::zeros());
        for (view, (placement, chart)) in placements.iter().zip(charts).enumerate() {
            let Followed { own, shifted, turned, deformed } = Followed::of(placement, centre);
            moved += shifted + turned + deformed;
            seen += deformed;
            // A chart that is held shows every map that would move or turn it.
            for (held, part) in [(chart.sigma[0], shifted), (chart.sigma[3], turned)] {
                if held <= 0.0 {
                    seen += part;
                }
            }
            for (number, row) in own.row_iter().enumerate() {
                let sigma = chart.sigma[number];
                if sigma > 0.0 {
                    motions.row_mut(MOTION * view + number).copy_from(&(row / sigma));
                }
            }
        }
        let maps = unseen(&moved, &seen);
        Self { centre, motions: product(&motions, &maps), maps }
    }

    /// Takes the maps out of motions: each column is left as near to none as a map brings it.
    pub(super) fn taken_out(&self, motions: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let maps = self.prior().cholesky()?.solve(&product(&self.motions.transpose(), motions));
        Some(motions - product(&self.motions, &maps))
    }

    /// Covariance of all motions by the maps alone, which are as sure as the prior makes them.
    pub(super) fn shared(&self) -> Option<DMatrix<f64>> {
        Some(spread(&self.motions, &self.prior().cholesky()?.inverse()))
    }

    /// How uncertain the charts leave points, by the covariance of their motions within the frame.
    pub(super) fn covariance(
        &self,
        charts: &[UncertainPose],
        within: &DMatrix<f64>,
    ) -> Option<StageCovariance> {
        let affine = spread(&self.maps, &self.prior().cholesky()?.inverse());
        let affine = affine.fixed_view::<AFFINE, AFFINE>(0, 0).into_owned();
        let centres: Vec<Point3> = charts.iter().map(|chart| chart.centre).collect();
        let (_, [axis, ..], _) = principal_axes(&centres);
        let view = |(index, chart): (usize, &UncertainPose)| {
            let first = MOTION * index;
            let own = within.fixed_view::<MOTION, MOTION>(first, first).into_owned();
            let scale = Matrix6::from_diagonal(&chart.sigma.into());
            ViewCovariance { centre: chart.centre, motion: scale * own * scale }
        };
        let mut views: Vec<ViewCovariance> = charts.iter().enumerate().map(view).collect();
        views.sort_by(|a, b| axis.dot(&a.centre.coords).total_cmp(&axis.dot(&b.centre.coords)));
        Some(StageCovariance { centre: self.centre, affine, axis, views })
    }

    /// Precision of the maps by what is known of the charts' places.
    fn prior(&self) -> DMatrix<f64> {
        product(&self.motions.transpose(), &self.motions)
    }
}

/// A covariance carried on.
fn spread(by: &DMatrix<f64>, own: &DMatrix<f64>) -> DMatrix<f64> {
    product(&product(by, own), &by.transpose())
}

type Square = SMatrix<f64, AFFINE, AFFINE>;

/// How a chart follows an affine map, by the map's numbers.
struct Followed {
    /// Its offset, then its rotation vector.
    own: SMatrix<f64, MOTION, AFFINE>,
    /// Mean squares by which its points move with the offset and with the rotation, and by which they miss that
    /// motion: quadratic forms.
    shifted: Square,
    turned: Square,
    deformed: Square,
}

impl Followed {
    fn of(placement: &ChartPosition, centre: Point3) -> Self {
        let spread = placement.spread;
        let weights = affine_weights(placement.centre - centre);
        let inertia = Matrix3::from_diagonal_element(spread.trace()) - spread;
        // Points on a line do not show turns about it.
        let inverse = inertia.pseudo_inverse(1e-9 * inertia.trace()).unwrap_or_default();
        let mut own = SMatrix::<f64, MOTION, AFFINE>::zeros();
        for number in 0..AFFINE {
            let (along, by) = (number % 3, number / 3);
            own[(along, number)] = weights[by];
            if by > 0 {
                let turn = inverse * spread.column(by - 1).cross(&Vector3::ith(along, 1.0));
                own.fixed_view_mut::<3, 1>(3, number).copy_from(&turn);
            }
        }
        let mut about = Square::zeros();
        for (a, b) in (3..AFFINE).flat_map(|a| (3..AFFINE).map(move |b| (a, b))) {
            if a % 3 == b % 3 {
                about[(a, b)] = spread[(a / 3 - 1, b / 3 - 1)];
            }
        }
        let offsets = own.fixed_rows::<3>(0);
        let turns = own.fixed_rows::<3>(3);
        let shifted = offsets.transpose() * offsets;
        let turned = turns.transpose() * inertia * turns;
        Self { own, shifted, turned, deformed: about - turned }
    }
}

/// Independent maps of which less than a share of what they move is seen, a column each: eigenvectors of one
/// quadratic form in the measure of the other.
fn unseen(moved: &Square, seen: &Square) -> DMatrix<f64> {
    /// Less than this of the numbers' own size is rounding.
    const ROUNDING: f64 = 1e-12;
    let scale = Square::from_diagonal(
        &moved.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 }),
    );
    let measure = (scale * moved * scale).symmetric_eigen();
    let root =
        measure.eigenvalues.map(|value| if value > ROUNDING { 1.0 / value.sqrt() } else { 0.0 });
    let basis = scale * measure.eigenvectors * Square::from_diagonal(&root);
    let shares = (basis.transpose() * seen * basis).symmetric_eigen();
    let maps = basis * shares.eigenvectors;
    let kept: Vec<usize> = (0..AFFINE)
        .filter(|index| {
            maps.column(*index).norm() > 0.0 && shares.eigenvalues[*index] < RIGID.powi(2)
        })
        .collect();
    DMatrix::from_fn(AFFINE, kept.len(), |row, column| maps[(row, kept[column])])
}
