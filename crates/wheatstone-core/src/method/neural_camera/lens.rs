//! The camera before its correction: a pose, a projective plane, and a symmetric lens.
//!
//! The plane is that of the direct linear transformation (eleven numbers, Abdel-Aziz & Karara 1971,
//! reprint doi:10.14358/PERS.81.2.103). On it, or on the plane of angles for a fisheye (Kannala &
//! Brandt 2006, doi:10.1109/TPAMI.2006.153), stand Brown's radial and tangential terms
//! (Brown 1971, Photogrammetric Engineering 37:855-866). The entrance pupil may move along the axis with the square of the
//! angle (Gennery 2006, doi:10.1007/s11263-006-5168-1), as that of fisheyes, ports and mirrors does: the first radial term then
//! changes with the nearness.

use super::layout::Layout;
use crate::{
    camera::pinhole::Pinhole,
    geometry::{Pixel, Point3, Pose, ProjectionMatrix, Ray, Vector3},
};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2};
use serde::{Deserialize, Serialize};

/// Numbers that a fit may change: rotation and translation, the five of the plane, the lens.
pub(super) const PARAMETERS: usize = 17;

/// The first of the numbers that are expected near 0: shape of a pixel (two), principal point (two),
/// radial terms (three), tangential terms (two), the pupil's movement. Of pose and focal length nothing is known.
pub(super) const FIRST_EXPECTED: usize = 7;
pub(super) const FIRST_OF_PRINCIPAL: usize = 9;
pub(super) const FIRST_RADIAL: usize = 11;
pub(super) const FIRST_TANGENTIAL: usize = 14;
pub(super) const OF_PUPIL: usize = 16;

/// World to pixel without correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Lens {
    pub(super) layout: Layout,
    /// World to camera.
    pub(super) camera_from_world: Pose,
    /// Focal lengths x and y, skew, principal point x and y; pixels. The first is negative where the
    /// world's axes are left-handed.
    #[serde(rename = "intrinsics", alias = "plane")]
    pub(super) plane: [f64; 5],
    /// Three radial and two tangential terms, as relative displacements at `reach`.
    #[serde(alias = "bend")]
    pub(super) distortion: [f64; 5],
    /// By how much the pupil's movement raises the first radial term where the nearness is twice that of the middle.
    #[serde(default)]
    pub(super) pupil: f64,
    /// The middle of the nearness among the fitted points.
    #[serde(default = "any_nearness")]
    pub(super) middle_nearness: f64,
    /// The middle of the pixels seen, near which the principal point is expected.
    pub(super) middle: Pixel,
    /// The camera's centre as first found: nearness counts from here, so that it stays what it is
    /// while the lens is moved.
    pub(super) viewpoint: Point3,
    /// Largest distance from the axis on the layout's plane among the fitted points.
    pub(super) reach: f64,
}

/// Of lenses whose pupil stays where it is.
fn any_nearness() -> f64 {
    1.0
}

impl Lens {
    /// The distortion-free camera that a projection matrix is, for points out to `reach`.
    pub(super) fn from_projection(matrix: &ProjectionMatrix) -> Option<Self> {
        let linear: Matrix3<f64> = matrix.0.fixed_view::<3, 3>(0, 0).into();
        // M = K R: the QR factors of M' with its columns reversed are those of K and R reversed.
        let reversal = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
        let qr = (linear.transpose() * reversal).qr();
        let mut upper = reversal * qr.r().transpose() * reversal;
        let mut rotation = reversal * qr.q().transpose();
        for axis in 1..3 {
            if upper[(axis, axis)] < 0.0 {
                upper.column_mut(axis).neg_mut();
                rotation.row_mut(axis).neg_mut();
            }
        }
        if rotation.determinant() < 0.0 {
            upper.column_mut(0).neg_mut();
            rotation.row_mut(0).neg_mut();
        }
        let upper = upper / upper[(2, 2)];
        let centre = matrix.centre()?;
        let translation = -(rotation * centre.coords);
        let plane = [upper[(0, 0)], upper[(1, 1)], upper[(0, 1)], upper[(0, 2)], upper[(1, 2)]];
        let finite = plane.iter().chain(rotation.iter()).all(|value| value.is_finite());
        (finite && plane[0] != 0.0 && plane[1] != 0.0).then_some(Self {
            layout: Layout::Perspective,
            camera_from_world: Pose { rotation, translation },
            plane,
            distortion: [0.0; 5],
            pupil: 0.0,
            middle_nearness: any_nearness(),
            middle: Pixel::new(upper[(0, 2)], upper[(1, 2)]),
            viewpoint: centre,
            reach: 1.0,
        })
    }

    /// The same camera laid out otherwise, its reach and middle those of `pairs`.
    pub(super) fn laid_out(mut self, layout: Layout, pairs: &[(Point3, Pixel)]) -> Self {
        self.layout = layout;
        (self.distortion, self.pupil) = ([0.0; 5], 0.0);
        let pose = self.camera_from_world;
        let distance = |world| Some(layout.place(pose.transform(world))?.0.norm());
        let reach = pairs.iter().filter_map(|(world, _)| distance(*world)).fold(0.0, f64::max);
        let middle = |values: &dyn Fn(&(Point3, Pixel)) -> f64| {
            let low = pairs.iter().map(values).fold(f64::INFINITY, f64::min);
            let high = pairs.iter().map(values).fold(f64::NEG_INFINITY, f64::max);
            0.5 * (low + high)
        };
        self.middle = Pixel::from([0, 1].map(|axis| middle(&|(_, pixel)| pixel[axis])));
        self.middle_nearness = middle(&|(world, _)| self.nearness(*world).0);
        self.reach = if reach > 0.0 { reach } else { 1.0 };
        self
    }

    /// The same lens with its present centre as viewpoint.
    pub(super) fn seen_from_its_centre(self) -> Self {
        Self { viewpoint: Point3::from(self.camera_from_world.inverse().translation), ..self }
    }

    /// One over the distance from the viewpoint, in inverse world units, with derivatives.
    pub(super) fn nearness(&self, world: Point3) -> (f64, Vector3) {
        let away = world - self.viewpoint;
        let nearness = 1.0 / away.norm();
        (nearness, away * -nearness.powi(3))
    }

    /// By how much larger than in the middle a nearness is, as a share of that.
    fn nearer(&self, nearness: f64) -> f64 {
        nearness / self.middle_nearness - 1.0
    }

    /// What the lens makes of a place on the layout's plane and a nearness, with derivatives by the place.
    pub(super) fn bent(&self, place: Vector2<f64>, nearness: f64) -> (Vector2<f64>, Matrix2<f64>) {
        let [k1, k2, k3, p1, p2] = self.distortion;
        let k1 = k1 + self.pupil * self.nearer(nearness);
        let unit = place / self.reach;
        let (x, y) = (unit.x, unit.y);
        let s = x * x + y * y;
        let factor = 1.0 + s * (k1 + s * (k2 + s * k3));
        let slope = k1 + s * (2.0 * k2 + 3.0 * s * k3);
        let sideways = Vector2::new(
            2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
            p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let mixed = 2.0 * (x * y * slope + p1 * x + p2 * y);
        let slopes = Matrix2::new(
            factor + 2.0 * (x * x * slope + p1 * y + 3.0 * p2 * x),
            mixed,
            mixed,
            factor + 2.0 * (y * y * slope + 3.0 * p1 * y + p2 * x),
        );
        ((unit * factor + sideways) * self.reach, slopes)
    }

    /// How a bent place changes with each of `distortion`, and with `pupil`.
    pub(super) fn second_derivatives(
        &self,
        place: Vector2<f64>,
        nearness: f64,
    ) -> [Vector2<f64>; 6] {
        let unit = place / self.reach;
        let (x, y) = (unit.x, unit.y);
        let s = x * x + y * y;
        let along = place * s;
        let sideways = |x: f64, y: f64| Vector2::new(x, y) * self.reach;
        [
            along,
            along * s,
            along * (s * s),
            sideways(2.0 * x * y, s + 2.0 * y * y),
            sideways(s + 2.0 * x * x, 2.0 * x * y),
            along * self.nearer(nearness),
        ]
    }

    pub(super) fn plane_matrix(&self) -> Matrix2<f64> {
        let [fx, fy, skew, _, _] = self.plane;
        Matrix2::new(fx, skew, 0.0, fy)
    }

    /// Where a world point falls, with derivatives by its coordinates; and its nearness,
    /// with derivatives.
    pub(super) fn project(&self, world: Point3) -> Option<ProjectedPoint> {
        let (place, by_point) = self.layout.place(self.camera_from_world.transform(world))?;
        let nearness = self.nearness(world);
        let (bent, by_place) = self.bent(place, nearness.0);
        self.seen((place, nearness), (bent, self.plane_matrix() * by_place * by_point))
    }

    /// A point of which it is known where it lies on the layout's plane, how near it is, and where it lies on the bent plane,
    /// with the pixel's derivatives by the point's place in the camera's frame.
    pub(super) fn seen(
        &self,
        (place, (nearness, nearness_slopes)): (Vector2<f64>, (f64, Vector3)),
        (bent, by_point): (Vector2<f64>, Matrix2x3<f64>),
    ) -> Option<ProjectedPoint> {
        let pixel = self.plane_matrix() * bent + Vector2::new(self.plane[3], self.plane[4]);
        let along =
            place * ((place / self.reach).norm_squared() * self.pupil / self.middle_nearness);
        let slopes = by_point * self.camera_from_world.rotation
            + self.plane_matrix() * along * nearness_slopes.transpose();
        let finite = pixel.iter().all(|value| value.is_finite()) && nearness.is_finite();
        finite.then_some(ProjectedPoint {
            pixel: Pixel::from(pixel),
            slopes,
            nearness,
            nearness_slopes,
        })
    }

    /// Where a pixel looks that shows something as near as this, by Newton's method on the layout's plane; `None` where no
    /// direction leads to it.
    pub(super) fn ray(&self, pixel: Pixel, nearness: f64) -> Option<Ray> {
        let target = self.plane_matrix().try_inverse()?
            * (pixel.coords - Vector2::new(self.plane[3], self.plane[4]));
        let mut place = target;
        for _ in 0..20 {
            let (reached, slopes) = self.bent(place, nearness);
            let step = slopes.try_inverse()? * (target - reached);
            // Half the reach a step keeps Newton on the branch that starts at the axis.
            let limit = 0.5 * self.reach;
            place += step * (limit / step.norm().max(limit));
            if step.norm() < 1e-12 * self.reach {
                break;
            }
        }
        let direction = self.layout.direction(place)?;
        let own = Ray { origin: Point3::origin(), direction };
        Some(own.transformed(&self.camera_from_world.inverse()))
    }

    /// The lens moved by a step of its numbers, in the units of [`Lens::units`].
    pub(super) fn moved(&self, step: &[f64; PARAMETERS]) -> Self {
        let units = self.units();
        let by = |index: usize| step[index] * units[index];
        let turn = Pose::from_rotation_vector(
            Vector3::new(by(3), by(4), by(5)),
            Vector3::new(by(0), by(1), by(2)),
        );
        let old = self.camera_from_world;
        let camera_from_world = Pose {
            rotation: turn.rotation * old.rotation,
            translation: turn.rotation * old.translation + turn.translation,
        };
        let [fx, fy, skew, cx, cy] = self.plane;
        let focal = 1.0 + by(6);
        let stretch = libm::exp(0.5 * by(7));
        let plane =
            [fx * focal * stretch, fy * focal / stretch, skew + by(8), cx + by(9), cy + by(10)];
        let mut distortion = self.distortion;
        distortion.iter_mut().enumerate().for_each(|(index, value)| *value += by(11 + index));
        let pupil = self.pupil + by(OF_PUPIL);
        Self { camera_from_world, plane, distortion, pupil, ..self.clone() }
    }

    /// Radians, the distance of the world's origin, shares and focal lengths: steps of like effect.
    pub(super) fn units(&self) -> [f64; PARAMETERS] {
        let (length, focal) = (self.camera_from_world.translation.norm(), self.plane[1].abs());
        let mut units = [1.0; PARAMETERS];
        units[3..6].fill(if length > 0.0 { length } else { 1.0 });
        units[8..11].fill(focal);
        units
    }

    /// The numbers that are expected near 0, in the units of a step; 0 for the others.
    pub(super) fn numbers(&self) -> [f64; PARAMETERS] {
        let [fx, fy, skew, cx, cy] = self.plane;
        let mut numbers = [0.0; PARAMETERS];
        let focal = fy.abs();
        let aspect = libm::log((fx / fy).abs());
        numbers[FIRST_EXPECTED..FIRST_RADIAL].copy_from_slice(&[
            aspect,
            skew / focal,
            (cx - self.middle.x) / focal,
            (cy - self.middle.y) / focal,
        ]);
        numbers[FIRST_RADIAL..OF_PUPIL].copy_from_slice(&self.distortion);
        numbers[OF_PUPIL] = self.pupil;
        numbers
    }

    /// What the numbers of [`Lens::opencv`] are called.
    pub(super) fn names(&self) -> [&'static str; 9] {
        match self.layout {
            Layout::Perspective => ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2"],
            Layout::Equidistant => [
                "fx",
                "fy",
                "cx",
                "cy",
                "k1 of angle",
                "k2 of angle",
                "k3 of angle",
                "p1 of angle",
                "p2 of angle",
            ],
        }
    }

    /// fx, fy, cx, cy, k1, k2, k3, p1, p2 on the layout's plane, and how each changes with the lens's
    /// numbers in the units of a step.
    pub(super) fn opencv(&self) -> ([f64; 9], SMatrix<f64, 9, PARAMETERS>) {
        let [fx, fy, _, cx, cy] = self.plane;
        let (focal, square) = (fy.abs(), self.reach * self.reach);
        let scales = [
            1.0 / square,
            1.0 / (square * square),
            1.0 / (square * square * square),
            1.0 / self.reach,
            1.0 / self.reach,
        ];
        let mut values = [fx.abs(), focal, cx, cy, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut slopes = SMatrix::zeros();
        slopes[(0, 6)] = fx.abs();
        slopes[(0, 7)] = 0.5 * fx.abs();
        slopes[(1, 6)] = focal;
        slopes[(1, 7)] = -0.5 * focal;
        slopes[(2, 9)] = focal;
        slopes[(3, 10)] = focal;
        for (index, scale) in scales.into_iter().enumerate() {
            values[4 + index] = scale * self.distortion[index];
            slopes[(4 + index, FIRST_RADIAL + index)] = scale;
        }
        (values, slopes)
    }

    /// Pose and pinhole, without skew and distortion.
    pub(super) fn pinhole(&self) -> Option<(Pose, Pinhole)> {
        let [fx, fy, _, cx, cy] = self.plane;
        let pinhole = Pinhole { focal: [fx, fy], principal: [cx, cy] };
        (fx > 0.0 && fy > 0.0).then_some((self.camera_from_world, pinhole))
    }

    pub(super) fn is_consistent(&self) -> bool {
        let pose = &self.camera_from_world;
        let gap = pose.rotation * pose.rotation.transpose() - Matrix3::identity();
        gap.norm() < 1e-6
            && self.reach > 0.0
            && self.pupil.is_finite()
            && self.middle_nearness.is_finite()
            && self.middle_nearness > 0.0
            && self.viewpoint.iter().chain(self.middle.iter()).all(|v| v.is_finite())
            && self.plane[0] != 0.0
            && self.plane[1] != 0.0
            && pose
                .translation
                .iter()
                .chain(&self.plane)
                .chain(&self.distortion)
                .all(|v| v.is_finite())
    }
}

/// A world point on the picture.
#[derive(Clone, Debug)]
pub(super) struct ProjectedPoint {
    pub(super) pixel: Pixel,
    /// Of the pixel by the world coordinates.
    pub(super) slopes: Matrix2x3<f64>,
    /// One over the distance from the viewpoint, in inverse world units.
    pub(super) nearness: f64,
    /// Of the nearness by the world coordinates.
    pub(super) nearness_slopes: Vector3,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::staged::staged;

    #[test]
    fn rays_of_both_layouts_pass_through_what_they_show() {
        let pairs = staged(0.0).seen_by_camera(0);
        let plain = Lens::from_projection(&ProjectionMatrix::fit(&pairs).unwrap()).unwrap();
        for layout in [Layout::Perspective, Layout::Equidistant] {
            let mut lens = plain.clone().laid_out(layout, &pairs);
            lens.distortion = [0.05, -0.01, 0.003, 0.001, -0.002];
            lens.pupil = 0.01;
            for (world, _) in &pairs {
                let seen = lens.project(*world).unwrap();
                let ray = lens.ray(seen.pixel, seen.nearness).unwrap();
                let away = world - ray.origin;
                assert!(
                    away.cross(&ray.direction).norm() < 1e-9 * away.norm(),
                    "{layout:?} {world}"
                );
            }
        }
    }
}
