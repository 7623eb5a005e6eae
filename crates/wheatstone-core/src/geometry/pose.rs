//! Rigid motions.

use super::{Point3, Vector3};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// A rotation, then a translation: as `a_from_b` it maps coordinates in frame b to frame a.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Orthonormal, determinant 1.
    pub rotation: Matrix3<f64>,
    /// Where b's origin lies in a.
    pub translation: Vector3,
}

impl Default for Pose {
    fn default() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }
}

impl Pose {
    /// From a translation and a rotation vector (axis times angle in radians), by Rodrigues'
    /// formula.
    #[must_use]
    pub fn from_rotation_vector(translation: Vector3, rotation: Vector3) -> Self {
        let angle = rotation.norm();
        let cross = rotation.cross_matrix();
        // sin(a)/a and (1 - cos(a))/a^2, by their series near 0, where the quotients lose digits.
        let (first, second) = if angle < 1e-4 {
            (1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0)
        } else {
            (libm::sin(angle) / angle, (1.0 - libm::cos(angle)) / (angle * angle))
        };
        Self { rotation: Matrix3::identity() + cross * first + cross * cross * second, translation }
    }

    /// Of a camera at `centre` that looks at `aim`, upright where y points down, but for the error of its
    /// mount: a rotation vector in the camera's own frame (x right, y down, z forward), in radians. Maps
    /// the frame of both places to the camera's.
    #[must_use]
    pub fn looking(centre: Vector3, aim: Vector3, error: Vector3) -> Self {
        let forward = (aim - centre).normalize();
        let right = Vector3::y().cross(&forward).normalize();
        let down = forward.cross(&right);
        let aimed = Matrix3::from_rows(&[right.transpose(), down.transpose(), forward.transpose()]);
        let rotation = Self::from_rotation_vector(Vector3::zeros(), error).rotation * aimed;
        Self { rotation, translation: -(rotation * centre) }
    }

    /// The rotation as axis times angle, in radians, angle in 0..pi.
    #[must_use]
    pub fn rotation_vector(&self) -> Vector3 {
        let r = &self.rotation;
        let twice_sine =
            Vector3::new(r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]);
        let angle = libm::atan2(twice_sine.norm() / 2.0, (r.trace() - 1.0) / 2.0);
        if angle < 1e-6 {
            return twice_sine / 2.0;
        }
        if std::f64::consts::PI - angle > 1e-6 {
            return twice_sine * (angle / twice_sine.norm());
        }
        // Near half a turn R = 2 a a' - I: the axis is the longest column of R + I.
        let sum = r + Matrix3::identity();
        let longest = (0..3).max_by(|a, b| sum.column(*a).norm().total_cmp(&sum.column(*b).norm()));
        sum.column(longest.unwrap_or(0)).normalize() * angle
    }

    /// `point`, given in frame b, in frame a.
    #[must_use]
    pub fn transform(&self, point: Point3) -> Point3 {
        Point3::from(self.rotation * point.coords + self.translation)
    }

    /// `a_from_c` of this, `a_from_b`, and of `b_from_c`.
    #[must_use]
    pub fn after(&self, b_from_c: &Self) -> Self {
        Self {
            rotation: self.rotation * b_from_c.rotation,
            translation: self.rotation * b_from_c.translation + self.translation,
        }
    }

    /// The motion that brings the first of each pair nearest to the second, in the least-squares
    /// sense; `None` for fewer than three pairs, or pairs on a line.
    ///
    /// Source: Arun, Huang & Blostein 1987 (doi:10.1109/TPAMI.1987.4767965), with the reflection
    /// excluded as by Umeyama 1991 (doi:10.1109/34.88573).
    #[must_use]
    pub fn aligning(pairs: &[(Point3, Point3)]) -> Option<Self> {
        let count = pairs.len() as f64;
        let middle = |points: &mut dyn Iterator<Item = Vector3>| points.sum::<Vector3>() / count;
        let from = middle(&mut pairs.iter().map(|pair| pair.0.coords));
        let to = middle(&mut pairs.iter().map(|pair| pair.1.coords));
        let scatter: Matrix3<f64> =
            pairs.iter().map(|(a, b)| (b.coords - to) * (a.coords - from).transpose()).sum();
        let svd = scatter.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let mut values: Vec<f64> = svd.singular_values.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        if pairs.len() < 3 || values[1] <= 1e-12 * values[2] {
            return None;
        }
        let mut flip = Matrix3::identity();
        if (u * v_t).determinant() < 0.0 {
            let least = svd.singular_values.imin();
            flip[(least, least)] = -1.0;
        }
        let rotation = u * flip * v_t;
        Some(Self { rotation, translation: to - rotation * from })
    }

    /// `b_from_a`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }
}
