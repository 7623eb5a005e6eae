//! A camera's rotation and sideways place whatever its lens does along the radius, in closed form.
//!
//! Source: Tsai 1987 (doi:10.1109/JRA.1987.1087109), stage 1 for points that are not coplanar: a
//! pixel and the principal point lie on a line that the point's place in the camera's frame gives
//! too. Solved as a homogeneous system, so that nothing is divided by the unknown T_y. The centre of
//! distortion is found as in Hartley & Kang 2007 (doi:10.1109/TPAMI.2007.1147), whose argument holds
//! for known points in space as it does for those of a plane.

use crate::geometry::{Pixel, Point3, ProjectionMatrix, Vector3};
use nalgebra::{Matrix3, Vector2};
use wheatstone_numeric::least_squares::null_vector;

/// World points and pixels, each brought to mean 0 and mean distance 1.
pub(super) struct Scaled {
    pub(super) pairs: Vec<(Vector3, Vector2<f64>)>,
    world_centre: Vector3,
    world_scale: f64,
    image_centre: Vector2<f64>,
    image_scale: f64,
}

impl Scaled {
    /// `None` where all points or all pixels are equal.
    pub(super) fn new(pairs: &[(Point3, Pixel)]) -> Option<Self> {
        let count = pairs.len() as f64;
        let world_centre = pairs.iter().map(|p| p.0.coords).sum::<Vector3>() / count;
        let image_centre = pairs.iter().map(|p| p.1.coords).sum::<Vector2<f64>>() / count;
        let world_scale =
            count / pairs.iter().map(|p| (p.0.coords - world_centre).norm()).sum::<f64>();
        let image_scale =
            count / pairs.iter().map(|p| (p.1.coords - image_centre).norm()).sum::<f64>();
        let scaled = pairs.iter().map(|(world, pixel)| {
            let world = (world.coords - world_centre) * world_scale;
            (world, (pixel.coords - image_centre) * image_scale)
        });
        (world_scale.is_finite() && image_scale.is_finite()).then(|| Self {
            pairs: scaled.collect(),
            world_centre,
            world_scale,
            image_centre,
            image_scale,
        })
    }

    /// The places on the picture that may be its centre of distortion: the principal point of the
    /// linear camera, the point that all lines through pixels and their ideal places meet in, and
    /// the middle of the seen part of the picture. In pixels.
    pub(super) fn centres(&self, linear: &ProjectionMatrix) -> Vec<Pixel> {
        let principal = linear.decompose().map(|(k, ..)| Pixel::new(k[(0, 2)], k[(1, 2)]));
        let extent = |axis: usize| {
            let values = || self.pairs.iter().map(|p| p.1[axis]);
            let low = values().fold(f64::INFINITY, f64::min);
            (low, values().fold(f64::NEG_INFINITY, f64::max))
        };
        let (across, down) = (extent(0), extent(1));
        let middle = Vector2::new(across.0 + across.1, down.0 + down.1) / 2.0;
        let intersection = self.meeting_point().filter(|place| {
            // Without distortion every point is such a centre, and the one found is any.
            let inside = |value: f64, (low, high): (f64, f64)| value > low && value < high;
            inside(place.x, across) && inside(place.y, down)
        });
        let back = |place| Pixel::from(place / self.image_scale + self.image_centre);
        principal.into_iter().chain(intersection.map(back)).chain([back(middle)]).collect()
    }

    /// Hartley & Kang's centre: u' F X = 0 for every pixel u and point X, and e' F = 0 for the
    /// centre e. In scaled coordinates.
    fn meeting_point(&self) -> Option<Vector2<f64>> {
        let row = |(world, pixel): &(Vector3, Vector2<f64>)| {
            let h = [world.x, world.y, world.z, 1.0];
            [h.map(|c| pixel.x * c), h.map(|c| pixel.y * c), h].concat()
        };
        let rows: Vec<f64> = self.pairs.iter().flat_map(row).collect();
        let found = null_vector(&rows, 12)?;
        let f = nalgebra::Matrix3x4::from_row_slice(found.vector.as_slice());
        let left: Vec<f64> =
            f.transpose().row_iter().flat_map(|row| [row[0], row[1], row[2]]).collect();
        let centre = null_vector(&left, 3)?.vector;
        let place = Vector2::new(centre[0], centre[1]) / centre[2];
        place.iter().all(|value| value.is_finite()).then_some(place)
    }

    /// The world-to-camera placement in the world's own unit, from one in scaled coordinates.
    pub(super) fn unscaled(&self, rotation: Matrix3<f64>, translation: Vector3) -> Vector3 {
        translation / self.world_scale - rotation * self.world_centre
    }

    /// The radial alignment constraint with the principal point at `centre` (in pixels); `None`
    /// where the points do not determine it.
    pub(super) fn align(&self, centre: Pixel) -> Option<Aligned> {
        let centre = (centre.coords - self.image_centre) * self.image_scale;
        let row = |(world, pixel): &(Vector3, Vector2<f64>)| {
            let h = [world.x, world.y, world.z, 1.0];
            let place = pixel - centre;
            [h.map(|c| -place.y * c), h.map(|c| place.x * c)].concat()
        };
        let rows: Vec<f64> = self.pairs.iter().flat_map(row).collect();
        let found = null_vector(&rows, 8)?;
        if !found.is_determined() {
            return None;
        }
        let v = found.vector;
        let (along_x, along_y) = (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[4], v[5], v[6]));
        let scale = along_y.norm();
        let aspect = along_x.norm() / scale;
        // The nearest orthonormal pair: each takes half of what is missing to a right angle.
        let (a, b) = (along_x / along_x.norm(), along_y / scale);
        let (sum, difference) = ((a + b).normalize(), (a - b).normalize());
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (mut first, mut second) = ((sum + difference) * half, (sum - difference) * half);
        let mut sideways = Vector2::new(v[3] / (scale * aspect), v[7] / scale);
        let agrees = |(world, pixel): &&(Vector3, Vector2<f64>)| {
            let ideal = Vector2::new(first.dot(world), second.dot(world)) + sideways;
            ideal.dot(&(pixel - centre)) > 0.0
        };
        if 2 * self.pairs.iter().filter(agrees).count() < self.pairs.len() {
            (first, second, sideways) = (-first, -second, -sideways);
        }
        let radii = |(world, pixel): &(Vector3, Vector2<f64>)| {
            let ideal = Vector2::new(first.dot(world), second.dot(world)) + sideways;
            let place = pixel - centre;
            let place = Vector2::new(place.x / aspect, place.y) / self.image_scale;
            [place.norm(), ideal.norm()]
        };
        let finite = aspect.is_finite() && sideways.iter().all(|value| value.is_finite());
        finite.then(|| Aligned {
            first,
            second,
            sideways,
            aspect,
            radii: self.pairs.iter().map(radii).collect(),
        })
    }
}

/// What radial alignment tells of a camera, in [`Scaled`] world coordinates.
pub(super) struct Aligned {
    /// The first two rows of the rotation.
    first: Vector3,
    second: Vector3,
    /// T_x and T_y.
    sideways: Vector2<f64>,
    /// Focal length over pixel width, as a share of that over pixel height.
    pub(super) aspect: f64,
    /// Of each point: the radius of its pixel about the centre, in pixel heights, and its distance
    /// from the optical axis, in scaled world units.
    pub(super) radii: Vec<[f64; 2]>,
}

impl Aligned {
    /// The rotation, proper or mirrored: radial alignment cannot tell.
    pub(super) fn rotation(&self, mirrored: bool) -> Matrix3<f64> {
        let side = if mirrored { -1.0 } else { 1.0 };
        let third = self.first.cross(&self.second) * side;
        Matrix3::from_rows(&[self.first.transpose(), self.second.transpose(), third.transpose()])
    }

    /// The translation with T_z = `depth`.
    pub(super) fn translation(&self, depth: f64) -> Vector3 {
        Vector3::new(self.sideways.x, self.sideways.y, depth)
    }
}
