//! How uncertain points are by charts whose places are uncertain, whatever map was fitted to them.

use super::{Point3, Vector3};
use nalgebra::{Matrix3, Matrix6, SMatrix};
use serde::{Deserialize, Serialize};

/// Numbers of an affine map: a shift, then by how much points move along each axis per unit of X, Y and Z.
pub(crate) const AFFINE: usize = 12;

/// The covariance that points inherit from the uncertain places of the charts that a map was fitted to.
///
/// It has two parts. Errors of the world frame as a whole, an affine map near the identity, are shared by all
/// points and cancel in distances between near ones: [`StageCovariance::frame`]. What is left between the
/// charts belongs to each view: [`StageCovariance::within_frame`]. Both are by the places of the charts alone
/// and add to what [`crate::method::Located::covariance`] says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageCovariance {
    /// The point that an error of the frame moves by its shift alone, in world units.
    pub(crate) centre: Point3,
    /// Covariance of the affine map's numbers, the shift in world units, the rest without unit.
    pub(crate) affine: SMatrix<f64, AFFINE, AFFINE>,
    /// Direction along which the views lie, of unit length.
    pub(crate) axis: Vector3,
    /// The views, in their order along the axis.
    pub(crate) views: Vec<ViewCovariance>,
}

/// What of a chart's place is uncertain within the frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ViewCovariance {
    /// The middle of the chart's points.
    pub(crate) centre: Point3,
    /// Covariance of its offset, in world units, and its rotation vector about the middle, in radians.
    pub(crate) motion: Matrix6<f64>,
}

impl StageCovariance {
    /// Covariance of a point by all that is uncertain of the charts' places, in squared world units.
    #[must_use]
    pub fn at(&self, point: Point3) -> Matrix3<f64> {
        self.frame(point) + self.within_frame(point)
    }

    /// The same without the errors of the frame: for points that are compared with each other alone.
    #[must_use]
    pub fn relative(&self) -> Self {
        Self { affine: SMatrix::zeros(), ..self.clone() }
    }

    /// Covariance of a point by the error of the frame, which all points share; in squared world units.
    #[must_use]
    pub fn frame(&self, point: Point3) -> Matrix3<f64> {
        let weights = affine_weights(point - self.centre);
        let mut sum = Matrix3::zeros();
        for (a, first) in weights.iter().enumerate() {
            for (b, second) in weights.iter().enumerate() {
                sum += self.affine.fixed_view::<3, 3>(3 * a, 3 * b) * (first * second);
            }
        }
        sum
    }

    /// Covariance of a point within the frame, between those of the views beside it; in squared world units.
    #[must_use]
    pub fn within_frame(&self, point: Point3) -> Matrix3<f64> {
        let along = |view: &ViewCovariance| self.axis.dot(&(view.centre - point));
        let next = self.views.partition_point(|view| along(view) < 0.0);
        let own = |index: usize| self.views[index].at(point);
        match next {
            0 => self.views.first().map_or_else(Matrix3::zeros, |view| view.at(point)),
            next if next == self.views.len() => own(next - 1),
            next => {
                let (before, behind) = (-along(&self.views[next - 1]), along(&self.views[next]));
                let share = before / (before + behind);
                own(next - 1) * (1.0 - share) + own(next) * share
            }
        }
    }

    /// Whether its numbers are those of covariances.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let sound = |diagonal: &[f64]| diagonal.iter().all(|v| v.is_finite() && *v >= 0.0);
        sound(self.affine.diagonal().as_slice())
            && self
                .affine
                .iter()
                .chain(&self.centre.coords)
                .chain(&self.axis)
                .all(|v| v.is_finite())
            && self.views.iter().all(|view| {
                sound(view.motion.diagonal().as_slice())
                    && view.motion.iter().chain(&view.centre.coords).all(|v| v.is_finite())
            })
    }
}

impl ViewCovariance {
    /// Of a point that moves with the chart.
    fn at(&self, point: Point3) -> Matrix3<f64> {
        let mut by = SMatrix::<f64, 3, 6>::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        by.fixed_view_mut::<3, 3>(0, 3).copy_from(&-(point - self.centre).cross_matrix());
        by * self.motion * by.transpose()
    }
}

/// What the shift and the columns of the map's matrix count for at a point so far from the centre.
pub(crate) fn affine_weights(arm: Vector3) -> [f64; 4] {
    [1.0, arm.x, arm.y, arm.z]
}
