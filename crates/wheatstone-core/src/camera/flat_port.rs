//! Any camera behind a flat plate of glass, with air, water or anything else beyond it.
//!
//! Exact refraction by Snell's law at both faces; rays do not meet in one point, so no pinhole model
//! describes it. Source: Agrawal, Ramalingam, Taguchi & Chari 2012, "A theory of multi-layer flat
//! refractive geometry" (doi:10.1109/CVPR.2012.6248071).

use super::{AnyCamera, CameraModel, pinhole::Pinhole};
use crate::geometry::{Pixel, Point3, Ray, Vector3};
use serde::{Deserialize, Serialize};

/// A camera in air that looks through a plate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlatPort {
    /// The camera behind the plate.
    pub camera: Box<AnyCamera>,
    /// Unit normal of the plate in the camera's frame, away from the camera.
    pub normal: Vector3,
    /// From the camera's centre to the near face along the normal, in the user's unit.
    pub distance: f64,
    /// Thickness of the plate, in the user's unit.
    pub thickness: f64,
    /// Refractive index of the plate.
    pub plate_index: f64,
    /// Refractive index of what lies beyond.
    pub medium_index: f64,
}

impl Default for FlatPort {
    /// Water behind two centimetres of acrylic, lengths in centimetres.
    fn default() -> Self {
        Self {
            camera: Box::new(Pinhole::default().into()),
            normal: Vector3::new(0.1, -0.05, 1.0).normalize(),
            distance: 8.0,
            thickness: 2.0,
            plate_index: 1.49,
            medium_index: 1.333,
        }
    }
}

impl FlatPort {
    /// The direction in which light from `point` reaches the camera: that of the ray in air.
    fn apparent_direction(&self, point: Point3) -> Option<Vector3> {
        let depth = point.coords.dot(&self.normal);
        let beyond = depth - self.distance - self.thickness;
        if beyond <= 0.0 {
            return None;
        }
        let sideways = point.coords - self.normal * depth;
        let radius = sideways.norm();
        if radius == 0.0 {
            return Some(self.normal);
        }
        let tangent = self.solve_tangent(radius, beyond);
        Some((self.normal + sideways * (tangent / radius)).normalize())
    }

    /// The tangent of the angle from the normal, in air, of the ray that gets `radius` sideways
    /// on its way to `beyond` behind the far face.
    fn solve_tangent(&self, radius: f64, beyond: f64) -> f64 {
        // How far sideways a ray gets, and the derivative, by the tangent in air. In a layer of index
        // n its tangent is t / sqrt(n^2 (1 + t^2) - t^2), which rises with t.
        let sideways = |t: f64| {
            let layer = |length: f64, index: f64| {
                let n2 = index * index;
                let root = (n2 + (n2 - 1.0) * t * t).sqrt();
                (length * t / root, length * n2 / (root * root * root))
            };
            let parts = [
                layer(self.distance, 1.0),
                layer(self.thickness, self.plate_index),
                layer(beyond, self.medium_index),
            ];
            (parts.iter().map(|p| p.0).sum::<f64>(), parts.iter().map(|p| p.1).sum::<f64>())
        };
        let (mut low, mut high) = (0.0, radius / self.distance.max(1e-9));
        let mut tangent = radius / (self.distance + self.thickness + beyond);
        for _ in 0..100 {
            let (reached, slope) = sideways(tangent);
            if reached > radius {
                high = tangent
            } else {
                low = tangent
            }
            let newton = tangent + (radius - reached) / slope;
            let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
            if (next - tangent).abs() <= 1e-15 * tangent {
                break;
            }
            tangent = next;
        }
        tangent
    }
}

impl CameraModel for FlatPort {
    fn parameters_mut(&mut self) -> Vec<&mut f64> {
        self.camera.parameters_mut()
    }

    fn project(&self, point: Point3) -> Option<Pixel> {
        self.camera.project(Point3::from(self.apparent_direction(point)?))
    }

    fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let in_air = self.camera.ray(pixel)?;
        let in_plate = refract(in_air.direction, self.normal, 1.0 / self.plate_index)?;
        let in_medium = refract(in_plate, self.normal, self.plate_index / self.medium_index)?;
        let near = in_air.direction * (self.distance / in_air.direction.dot(&self.normal));
        let far = near + in_plate * (self.thickness / in_plate.dot(&self.normal));
        Some(Ray { origin: in_air.origin + far, direction: in_medium })
    }
}

/// Snell's law for unit vectors; `ratio` is the index before over the index after. `None` for rays
/// that run away from the plate or are reflected totally.
pub(super) fn refract(direction: Vector3, normal: Vector3, ratio: f64) -> Option<Vector3> {
    let cosine = direction.dot(&normal);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    (cosine > 0.0 && square > 0.0)
        .then(|| direction * ratio + normal * (square.sqrt() - ratio * cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_pass_through_what_they_show() {
        let port = FlatPort::default();
        for pixel in [Pixel::new(10.0, 20.0), Pixel::new(600.0, 400.0), Pixel::new(320.0, 240.0)] {
            let ray = port.ray(pixel).unwrap();
            for distance in [1.0, 50.0, 500.0] {
                let back = port.project(ray.at(distance)).unwrap();
                assert!((back - pixel).norm() < 1e-9, "{pixel} at {distance}: {back}");
            }
        }
    }

    #[test]
    fn a_plate_of_air_changes_nothing_and_water_magnifies_by_its_index() {
        let air = FlatPort { plate_index: 1.0, medium_index: 1.0, ..FlatPort::default() };
        let point = Point3::new(10.0, 5.0, 90.0);
        let straight = Pinhole::default().project(point).unwrap();
        assert!((air.project(point).unwrap() - straight).norm() < 1e-10);
        // Near the axis of a port at the lens, water multiplies angles by 4/3.
        let water = FlatPort {
            normal: Vector3::z(),
            distance: 1e-6,
            thickness: 1e-6,
            medium_index: 4.0 / 3.0,
            ..FlatPort::default()
        };
        let near_axis = water.project(Point3::new(0.1, 0.0, 100.0)).unwrap();
        assert!(((near_axis.x - 319.5) / (700.0 * 0.001) - 4.0 / 3.0).abs() < 1e-4);
    }
}
