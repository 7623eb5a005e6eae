//! Any camera that looks into a convex mirror.
//!
//! Reflection at a sphere: the lines of sight do not meet in one point, and the picture is mirrored. A mirror is flat
//! where its radius is large.

use super::{AnyCamera, CameraModel, pinhole::Pinhole, traced};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use serde::{Deserialize, Serialize};

/// A camera before a mirror that is a part of a sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConvexMirror {
    /// The camera.
    pub camera: Box<AnyCamera>,
    /// The sphere's centre in the camera's frame, in the user's unit: behind the mirror.
    pub centre: Point3,
    /// Its radius, in the user's unit.
    pub radius: f64,
}

impl Default for ConvexMirror {
    /// Fifteen centimetres before the camera, lengths in centimetres.
    fn default() -> Self {
        let camera = Box::new(Pinhole::default().into());
        Self { camera, centre: Point3::new(5.0, -3.0, 215.0), radius: 200.0 }
    }
}

impl ConvexMirror {
    /// The ray beyond the mirror that reaches the camera from a direction.
    fn trace(&self, ray: Ray) -> Option<Ray> {
        let from = ray.origin - self.centre;
        let nearest = -from.dot(&ray.direction);
        let square = self.radius * self.radius - (from + ray.direction * nearest).norm_squared();
        let distance = nearest - square.sqrt();
        // No number where the ray passes by.
        (distance > 0.0).then(|| {
            let origin = ray.at(distance);
            let normal = (origin - self.centre) / self.radius;
            let direction = ray.direction - normal * (2.0 * ray.direction.dot(&normal));
            Ray { origin, direction }
        })
    }

    /// Where the point would be seen in the flat mirror that touches the sphere before the camera.
    fn in_flat_mirror(&self, point: Point3) -> Vector3 {
        let distance = self.centre.coords.norm();
        let normal = self.centre.coords / distance;
        let depth = distance - self.radius - point.coords.dot(&normal);
        point.coords + normal * (2.0 * depth)
    }
}

impl CameraModel for ConvexMirror {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.camera.parameters_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        let trace = |direction| self.trace(Ray { origin: Point3::origin(), direction });
        let direction = traced::direction_towards(trace, (point, self.in_flat_mirror(point)))?;
        self.camera.project(Point3::from(direction))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        self.trace(self.camera.ray(pixel)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_pass_through_what_they_show() {
        let mirror = ConvexMirror::default();
        // As far aside as mirrored rays are at right angles to where the search begins.
        for [x, y] in [[10.0, 20.0], [600.0, 400.0], [320.0, 240.0], [-250.0, -250.0]] {
            let pixel = Pixel::new(x, y);
            let ray = mirror.ray(pixel).unwrap();
            for distance in [10.0, 50.0, 500.0] {
                let back = mirror.project(ray.at(distance)).unwrap();
                assert!((back - pixel).norm() < 1e-8, "{pixel} at {distance}: {back}");
            }
        }
    }

    #[test]
    fn a_mirror_of_large_radius_is_flat() {
        let radius = 1e7;
        let centre = Point3::new(0.0, 0.0, radius + 15.0);
        let mirror = ConvexMirror { centre, radius, ..ConvexMirror::default() };
        let point = Point3::new(10.0, 5.0, -60.0);
        let virtual_point = Point3::new(10.0, 5.0, 90.0);
        let off =
            mirror.project(point).unwrap() - Pinhole::default().project(virtual_point).unwrap();
        assert!(off.norm() < 1e-3, "{off}");
    }
}
