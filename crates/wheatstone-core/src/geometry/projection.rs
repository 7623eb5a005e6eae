//! The 3x4 projection matrix of a distortion-free camera, found from known points in closed form.
//!
//! Source: Abdel-Aziz & Karara 1971, direct linear transformation (reprint
//! doi:10.14358/PERS.81.2.103); points and pixels are first centred and scaled as in Hartley 1997
//! (doi:10.1109/34.601246), without which the solution is worthless far from the origin.

use super::{Pixel, Point3};
use nalgebra::{DVector, Matrix2x3, Matrix3, Matrix3x4, Matrix4, Vector3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::least_squares::{null_direction, null_vector};

/// World point to pixel: `(u, v, w) = P (X, Y, Z, 1)`, pixel `(u / w, v / w)`. Its sign is such
/// that `w` is positive in front of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ProjectionMatrix(pub Matrix3x4<f64>);

impl ProjectionMatrix {
    /// Points that determine the eleven unknowns.
    pub const POINTS_NEEDED: usize = 6;

    /// The matrix that fits the pairs best in the algebraic sense; `None` where they do not
    /// determine it (fewer than six, all on one plane or on a twisted cubic with the camera).
    #[must_use]
    pub fn fit(pairs: &[(Point3, Pixel)]) -> Option<Self> {
        let frames = Frames::of(pairs)?;
        let solution = null_vector(&frames.equations(pairs), 12)?;
        // Two directions equally good: the points do not determine a camera.
        if !solution.is_determined() {
            return None;
        }
        frames.matrix(&solution.vector, pairs)
    }

    /// [`ProjectionMatrix::fit`] for who tries many samples of seven pairs or more: quicker, nearly as good
    /// where the pairs fit, and whether they determine a matrix it does not tell.
    #[must_use]
    pub fn sketch(pairs: &[(Point3, Pixel)]) -> Option<Self> {
        let frames = Frames::of(pairs)?;
        frames.matrix(&null_direction(&frames.equations(pairs), 12)?, pairs)
    }

    /// Where `point` falls; `None` in the plane of the camera's centre or behind it.
    #[must_use]
    pub fn project(&self, point: Point3) -> Option<Pixel> {
        let h = self.0 * point.to_homogeneous();
        (h.z > 0.0).then(|| Pixel::new(h.x / h.z, h.y / h.z))
    }

    /// [`ProjectionMatrix::project`] with its derivatives by the world coordinates.
    #[must_use]
    pub fn project_with_jacobian(&self, point: Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let pixel = self.project(point)?;
        let depth = (self.0 * point.to_homogeneous()).z;
        let linear = self.0.fixed_view::<3, 3>(0, 0);
        let by = |row: usize, value: f64| (linear.row(row) - linear.row(2) * value) / depth;
        Some((pixel, Matrix2x3::from_rows(&[by(0, pixel.x), by(1, pixel.y)])))
    }

    /// The matrix as `K (R | t)`: K upper triangular with a positive diagonal and 1 in its last place,
    /// R orthonormal. Its determinant is -1 where the world is left-handed, or seen in a mirror.
    /// `None` for a camera at infinity.
    #[must_use]
    pub fn decompose(&self) -> Option<(Matrix3<f64>, Matrix3<f64>, Vector3<f64>)> {
        let row =
            |index: usize| -> Vector3<f64> { self.0.fixed_view::<1, 3>(index, 0).transpose() };
        // Gram and Schmidt from the last row up.
        let (scale, third) = (row(2).norm(), row(2).normalize());
        let (first, second) = (row(0) / scale, row(1) / scale);
        let cy = second.dot(&third);
        let beside = second - third * cy;
        let fy = beside.norm();
        let second = beside / fy;
        let (cx, skew) = (first.dot(&third), first.dot(&second));
        let beside = first - third * cx - second * skew;
        let fx = beside.norm();
        let intrinsics = Matrix3::new(fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0);
        let rotation =
            Matrix3::from_rows(&[(beside / fx).transpose(), second.transpose(), third.transpose()]);
        let translation = intrinsics.try_inverse()? * self.0.column(3) / scale;
        let finite = rotation.iter().chain(translation.iter()).all(|value| value.is_finite());
        (finite && fx > 0.0 && fy > 0.0).then_some((intrinsics, rotation, translation))
    }

    /// The camera's centre in the world; `None` for a camera at infinity.
    #[must_use]
    pub fn centre(&self) -> Option<Point3> {
        let linear: Matrix3<f64> = self.0.fixed_view::<3, 3>(0, 0).into();
        let last: Vector3<f64> = self.0.column(3).into();
        let centre = -(linear.try_inverse()? * last);
        centre.iter().all(|c| c.is_finite()).then(|| Point3::from(centre))
    }
}

/// Coordinates of world and picture in which points are centred and of size one.
struct Frames {
    world: (f64, [f64; 3]),
    image: (f64, [f64; 2]),
}

impl Frames {
    /// `None` for fewer pairs than are needed, or all of one point.
    fn of(pairs: &[(Point3, Pixel)]) -> Option<Self> {
        if pairs.len() < ProjectionMatrix::POINTS_NEEDED {
            return None;
        }
        Some(Self {
            world: normaliser(pairs.iter().map(|(world, _)| world.coords.into()))?,
            image: normaliser(pairs.iter().map(|(_, pixel)| pixel.coords.into()))?,
        })
    }

    /// The pairs' equations, row by row, in the twelve entries of a matrix between these frames.
    fn equations(&self, pairs: &[(Point3, Pixel)]) -> Vec<f64> {
        let ((world_scale, world_centre), (image_scale, image_centre)) = (self.world, self.image);
        let mut rows = Vec::with_capacity(pairs.len() * 24);
        for (point, pixel) in pairs {
            let p = (point.coords - Vector3::from(world_centre)) * world_scale;
            let u = (pixel.x - image_centre[0]) * image_scale;
            let v = (pixel.y - image_centre[1]) * image_scale;
            let h = [p.x, p.y, p.z, 1.0];
            rows.extend(h.iter().copied().chain([0.0; 4]).chain(h.map(|c| -u * c)));
            rows.extend([0.0; 4].into_iter().chain(h).chain(h.map(|c| -v * c)));
        }
        rows
    }

    /// The matrix of these entries, between world and picture.
    fn matrix(
        &self,
        entries: &DVector<f64>,
        pairs: &[(Point3, Pixel)],
    ) -> Option<ProjectionMatrix> {
        let ((world_scale, world_centre), (image_scale, image_centre)) = (self.world, self.image);
        let normalised = Matrix3x4::from_row_slice(entries.as_slice());
        let from_image = Matrix3::new(
            1.0 / image_scale,
            0.0,
            image_centre[0],
            0.0,
            1.0 / image_scale,
            image_centre[1],
            0.0,
            0.0,
            1.0,
        );
        let mut to_world = Matrix4::identity() * world_scale;
        to_world[(3, 3)] = 1.0;
        for axis in 0..3 {
            to_world[(axis, 3)] = -world_scale * world_centre[axis];
        }
        let matrix = from_image * normalised * to_world;
        // Unit length of the third row's direction makes w the depth; then most points in front.
        let depth = matrix.fixed_view::<1, 3>(2, 0).norm();
        if depth == 0.0 || !depth.is_finite() {
            return None;
        }
        let in_front = pairs.iter().filter(|(p, _)| (matrix * p.to_homogeneous()).z > 0.0).count();
        let sign = if 2 * in_front >= pairs.len() { 1.0 } else { -1.0 };
        Some(ProjectionMatrix(matrix * (sign / depth)))
    }
}

/// Scale and centre that bring points to mean 0 and mean distance 1; `None` where all are equal.
fn normaliser<const N: usize>(
    points: impl Iterator<Item = [f64; N]> + Clone,
) -> Option<(f64, [f64; N])> {
    let count = points.clone().count() as f64;
    let mut centre = [0.0; N];
    for point in points.clone() {
        for axis in 0..N {
            centre[axis] += point[axis] / count;
        }
    }
    let distance = |p: [f64; N]| (0..N).map(|a| (p[a] - centre[a]).powi(2)).sum::<f64>().sqrt();
    let mean = points.map(distance).sum::<f64>() / count;
    (mean > 0.0 && mean.is_finite()).then_some((1.0 / mean, centre))
}
