//! How directions are laid out on a plane before the lens bends them.

use crate::geometry::{Point3, Vector3};
use nalgebra::{Matrix2x3, Vector2};
use serde::{Deserialize, Serialize};

/// How directions are laid out on a plane before the lens bends them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Layout {
    /// By the tangent of the angle from the axis, as a pinhole does.
    Perspective,
    /// By the angle itself, as most fisheye lenses nearly do.
    Equidistant,
}

impl Layout {
    /// A point in the camera's frame on the plane, with derivatives.
    pub(super) fn place(self, point: Point3) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let (x, y, z) = (point.x, point.y, point.z);
        if self == Self::Perspective {
            let (u, v) = (x / z, y / z);
            let slopes = Matrix2x3::new(1.0, 0.0, -u, 0.0, 1.0, -v) / z;
            return (z > 0.0).then_some((Vector2::new(u, v), slopes));
        }
        let radius2 = x * x + y * y;
        let distance2 = radius2 + z * z;
        let radius = radius2.sqrt();
        // On the axis the angle over the radius is 1 / z, and flat.
        if radius2 <= 1e-16 * distance2 {
            let slopes = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0) / z;
            return (z > 0.0).then_some((Vector2::new(x / z, y / z), slopes));
        }
        let scale = libm::atan2(radius, z) / radius;
        let along = (z / distance2 - scale) / radius2;
        let slopes = Matrix2x3::new(
            scale + along * x * x,
            along * x * y,
            -x / distance2,
            along * x * y,
            scale + along * y * y,
            -y / distance2,
        );
        Some((Vector2::new(x * scale, y * scale), slopes))
    }

    /// The direction that is laid out at a place, in the camera's frame: a unit vector.
    pub(super) fn direction(self, place: Vector2<f64>) -> Option<Vector3> {
        let direction = match self {
            Self::Perspective => Vector3::new(place.x, place.y, 1.0),
            Self::Equidistant => {
                let angle = place.norm().max(f64::MIN_POSITIVE);
                let sine = libm::sin(angle) / angle;
                Vector3::new(place.x * sine, place.y * sine, libm::cos(angle))
            }
        };
        direction.try_normalize(0.0).filter(|d| d.iter().all(|v| v.is_finite()))
    }
}
