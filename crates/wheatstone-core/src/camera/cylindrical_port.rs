//! Any camera that looks into a glass tube: a pipe, a round tank.
//!
//! Exact refraction by Snell's law at both faces of the wall. Rays bend by as much as they cross the tube's axis, and not
//! at all along it, so that no lens model describes the picture.

use super::{AnyCamera, CameraModel, flat_port::refract, pinhole::Pinhole, traced};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use serde::{Deserialize, Serialize};

/// A camera in air before a tube, which is filled with something else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CylindricalPort {
    /// The camera outside of the tube.
    pub camera: Box<AnyCamera>,
    /// A point of the tube's axis in the camera's frame, in the user's unit.
    pub centre: Point3,
    /// Unit vector along the axis.
    pub axis: Vector3,
    /// Outer radius, in the user's unit.
    pub radius: f64,
    /// Thickness of the wall, in the user's unit.
    pub thickness: f64,
    /// Refractive index of the wall.
    pub wall_index: f64,
    /// Refractive index of what is inside.
    pub medium_index: f64,
}

impl Default for CylindricalPort {
    /// A round tank of water, of two centimetres of acrylic, lengths in centimetres.
    fn default() -> Self {
        Self {
            camera: Box::new(Pinhole::default().into()),
            centre: Point3::new(1.0, 0.0, 75.0),
            axis: Vector3::new(0.02, 1.0, 0.05).normalize(),
            radius: 65.0,
            thickness: 2.0,
            wall_index: 1.49,
            medium_index: 1.333,
        }
    }
}

impl CylindricalPort {
    /// Where a ray first meets a cylinder about the axis, and the normal there, away from where the ray comes from.
    fn enter(&self, ray: &Ray, radius: f64) -> Option<(Point3, Vector3)> {
        let across = |vector: Vector3| vector - self.axis * vector.dot(&self.axis);
        let (from, along) = (across(ray.origin - self.centre), across(ray.direction));
        let square = along.norm_squared();
        let nearest = -from.dot(&along) / square;
        let half = ((radius * radius - (from + along * nearest).norm_squared()) / square).sqrt();
        // No number where the ray passes by.
        let distance = nearest - half;
        (distance > 0.0).then(|| (ray.at(distance), -(from + along * distance) / radius))
    }

    /// The ray inside of the tube that reaches the camera from a direction.
    fn trace(&self, in_air: Ray) -> Option<Ray> {
        let (outer, normal) = self.enter(&in_air, self.radius)?;
        let direction = refract(in_air.direction, normal, 1.0 / self.wall_index)?;
        let in_wall = Ray { origin: outer, direction };
        let (inner, normal) = self.enter(&in_wall, self.radius - self.thickness)?;
        let direction = refract(direction, normal, self.wall_index / self.medium_index)?;
        Some(Ray { origin: inner, direction })
    }
}

impl CameraModel for CylindricalPort {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.camera.parameters_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        let trace = |direction| self.trace(Ray { origin: Point3::origin(), direction });
        let direction = traced::direction_towards(trace, (point, point.coords))?;
        self.camera.project(Point3::from(direction))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        self.trace(self.camera.ray(pixel)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::flat_port::FlatPort;

    #[test]
    fn rays_pass_through_what_they_show() {
        let port = CylindricalPort::default();
        for pixel in [Pixel::new(10.0, 20.0), Pixel::new(600.0, 400.0), Pixel::new(320.0, 240.0)] {
            let ray = port.ray(pixel).unwrap();
            for distance in [10.0, 50.0, 100.0] {
                let back = port.project(ray.at(distance)).unwrap();
                assert!((back - pixel).norm() < 1e-8, "{pixel} at {distance}: {back}");
            }
        }
    }

    #[test]
    fn a_wide_tube_is_a_flat_port() {
        let radius = 1e7;
        let wide = CylindricalPort {
            centre: Point3::new(0.0, 0.0, radius + 8.0),
            axis: Vector3::y(),
            radius,
            ..CylindricalPort::default()
        };
        let flat = FlatPort { normal: Vector3::z(), ..FlatPort::default() };
        for point in [Point3::new(10.0, 5.0, 90.0), Point3::new(-20.0, 12.0, 50.0)] {
            let off = wide.project(point).unwrap() - flat.project(point).unwrap();
            assert!(off.norm() < 1e-3, "{point}: {off}");
        }
    }
}
