//! A camera with a parametric lens, placed in the world.

use super::PlacedCamera;
use crate::{
    camera::{CameraModel, posed_lens::PosedLens},
    geometry::{Pixel, Point3, Pose, ProjectionMatrix, Ray},
};
use nalgebra::{Matrix2x3, Matrix3, Matrix3x4};
use serde::{Deserialize, Serialize};

/// A camera somewhere in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedCamera<L> {
    /// Camera frame to picture.
    pub model: L,
    /// World to camera frame.
    pub camera_from_world: Pose,
    /// Whether the camera observes the world in a mirror, or the world's axes are left-handed: then the
    /// x of its frame changes sign between the pose and the lens.
    pub mirrored: bool,
}

impl<L> From<PosedLens<L>> for FittedCamera<L> {
    fn from(PosedLens { lens, mut camera_from_world }: PosedLens<L>) -> Self {
        let mirrored = camera_from_world.rotation.determinant() < 0.0;
        if mirrored {
            camera_from_world.rotation.row_mut(0).neg_mut();
            camera_from_world.translation.x *= -1.0;
        }
        Self { model: lens, camera_from_world, mirrored }
    }
}

impl<L: CameraModel> FittedCamera<L> {
    fn side(&self) -> f64 {
        if self.mirrored { -1.0 } else { 1.0 }
    }

    /// Directions in the world as the lens observes them, behind the mirror if there is one.
    pub(super) fn lens_from_world(&self) -> Matrix3<f64> {
        let mut rotation = self.camera_from_world.rotation;
        rotation.row_mut(0).scale_mut(self.side());
        rotation
    }

    /// A world point as the lens observes it, in the camera's frame behind the mirror if there is one.
    pub(super) fn before_lens(&self, world: Point3) -> Point3 {
        let mut point = self.camera_from_world.transform(world);
        point.x *= self.side();
        point
    }

    /// The camera without its lens, with a plane at unit distance.
    fn straight(&self) -> ProjectionMatrix {
        let mut translation = self.camera_from_world.translation;
        translation.x *= self.side();
        let mut rows = Matrix3x4::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.lens_from_world());
        rows.set_column(3, &translation);
        ProjectionMatrix(rows)
    }

    /// Made ready for many points about `middle`; `None` for a lens that does not see along its axis.
    pub(super) fn placed(&self, middle: Point3, weight: f64) -> Option<PlacedCamera<'_>> {
        let projection = self.straight();
        let depth = (projection.0 * middle.to_homogeneous()).z;
        let nearness = if depth > 0.0 { 1.0 / depth } else { 1.0 };
        PlacedCamera::new(
            projection,
            ([nearness, 0.0], true),
            weight,
            Box::new(|world| self.project_with_jacobian(world)),
            Box::new(move |pixel| Some(self.ray(pixel)?.at(1.0 / nearness))),
        )
    }

    /// Where a world point falls.
    #[must_use]
    pub fn project(&self, world: Point3) -> Option<Pixel> {
        self.model.project(self.before_lens(world))
    }

    /// [`FittedCamera::project`] with its derivatives by the world coordinates.
    #[must_use]
    pub fn project_with_jacobian(&self, world: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let (pixel, mut jacobian) = self.model.project_with_jacobian(self.before_lens(world))?;
        jacobian.column_mut(0).scale_mut(self.side());
        Some((pixel, jacobian * self.camera_from_world.rotation))
    }

    /// Where a pixel looks, in the world.
    #[must_use]
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let mut ray = self.model.ray(pixel)?;
        ray.origin.x *= self.side();
        ray.direction.x *= self.side();
        Some(ray.transformed(&self.camera_from_world.inverse()))
    }
}
