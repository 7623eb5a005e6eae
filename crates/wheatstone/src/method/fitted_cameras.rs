//! Cameras with a parametric lens, placed in the world: what the methods that fit such cameras leave.
//!
//! A point is located where it explains all pixels best (Hartley & Sturm 1997,
//! doi:10.1006/cviu.1997.0547), from the point nearest to all rays.

use super::{Located, Reconstructor};
use crate::{
    camera::CameraModel,
    geometry::{Pixel, Point3, Pose, Ray, triangulation},
};
use nalgebra::{Matrix2x3, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// A camera somewhere in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedCamera<L> {
    /// Camera frame to picture.
    pub model: L,
    /// World to camera frame.
    pub camera_from_world: Pose,
    /// Whether the camera sees the world in a mirror, or the world's axes are left-handed: then the
    /// x of its frame changes sign between the pose and the lens.
    pub mirrored: bool,
}

impl<L: CameraModel> FittedCamera<L> {
    /// From a lens and a placement whose `rotation` has determinant 1, or -1 for a mirrored camera.
    pub(super) fn new(model: L, rotation: Matrix3<f64>, translation: Vector3<f64>) -> Self {
        let mirrored = rotation.determinant() < 0.0;
        let mut camera_from_world = Pose { rotation, translation };
        if mirrored {
            camera_from_world.rotation.row_mut(0).neg_mut();
            camera_from_world.translation.x = -translation.x;
        }
        Self { model, camera_from_world, mirrored }
    }

    fn side(&self) -> f64 {
        if self.mirrored { -1.0 } else { 1.0 }
    }

    /// A world point as the lens sees it, in the camera's frame behind the mirror if there is one.
    fn before_lens(&self, world: Point3) -> Point3 {
        let mut point = self.camera_from_world.transform(world);
        point.x *= self.side();
        point
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

/// Cameras fitted to the same points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedCameras<L> {
    /// The cameras, in the order of the data.
    pub cameras: Vec<FittedCamera<L>>,
    /// Standard deviation of one pixel coordinate about its prediction, over all cameras.
    pub pixel_sigma: f64,
}

/// The point nearest to all rays, by least squares; `None` for fewer than two, or parallel ones.
fn nearest_to(rays: impl Iterator<Item = Ray>) -> Option<Point3> {
    let (mut matrix, mut vector, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
    for ray in rays {
        let across = Matrix3::identity() - ray.direction * ray.direction.transpose();
        matrix += across;
        vector += across * ray.origin.coords;
        count += 1;
    }
    if count < 2 {
        return None;
    }
    Some(Point3::from(matrix.cholesky()?.solve(&vector)))
}

impl<L: CameraModel + Clone> Reconstructor for FittedCameras<L> {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let mut cameras = Vec::with_capacity(self.cameras.len());
        let mut seen = Vec::with_capacity(self.cameras.len());
        let mut rays = Vec::with_capacity(self.cameras.len());
        for (camera, pixel) in self.cameras.iter().zip(pixels) {
            // A pixel that no light can reach says nothing.
            let Some((pixel, ray)) = pixel.and_then(|p| Some((p, camera.ray(p)?))) else {
                continue;
            };
            cameras.push(camera);
            seen.push(pixel);
            rays.push(ray);
        }
        let start = nearest_to(rays.into_iter())?;
        let found = triangulation::refine(start, &seen, |index, point| {
            cameras[index].project_with_jacobian(point)
        })?;
        Some(Located {
            point: found.point,
            covariance: found.cofactor * (self.pixel_sigma * self.pixel_sigma),
            residual: found.residual,
        })
    }

    fn is_consistent(&self) -> bool {
        // Far above rounding, far below anything a file could mean.
        const CROOKED: f64 = 1e-6;
        let camera_holds = |camera: &FittedCamera<L>| {
            let Pose { rotation, translation } = &camera.camera_from_world;
            let square = rotation * rotation.transpose() - Matrix3::identity();
            let mut model = camera.model.clone();
            square.norm() < CROOKED
                && rotation.determinant() > 0.0
                && translation.iter().all(|value| value.is_finite())
                && model.parameters_mut().iter().all(|value| value.is_finite())
        };
        self.cameras.len() >= 2
            && self.pixel_sigma >= 0.0
            && self.pixel_sigma.is_finite()
            && self.cameras.iter().all(camera_holds)
    }
}
