//! What a map has to say of itself to be made ready for many points.

use crate::{
    geometry::{
        Pixel, PixelColumns, Point3, ProjectionMatrix, Vector3,
        batch_triangulation::{Polynomials, UncertainMatrix},
    },
    method::PixelNoise,
};
use nalgebra::{Matrix2x3, Matrix3};

/// How a map locates many points.
pub enum Plan<'a> {
    /// One after the other.
    PointByPoint,
    /// Where they explain all cameras' pixels best.
    Cameras(Vec<PlacedCamera<'a>>),
    /// The same, of cameras that are formulas and say how sure points are.
    Formulas(FormulaCameras<'a>),
    /// From their pixels, straight away.
    Learned(Learned<'a>),
}

/// Where a camera observes a world point, in pixels, with derivatives by the world's coordinates.
type Projecting<'a> = dyn Fn(Point3) -> Option<(Pixel, Matrix2x3<f64>)> + Send + Sync + 'a;

/// About where a pixel looks: a point that falls near it.
type Looking<'a> = dyn Fn(Pixel) -> Option<Point3> + Send + Sync + 'a;

/// A camera as it departs from a projective one.
pub struct PlacedCamera<'a> {
    /// The projective camera: about its centre, and the directions that it observes.
    pub projection: ProjectionMatrix,
    /// Middle and half the range of what 1 / depth is among the fitted points, the depth by the
    /// projective camera.
    pub nearness: [f64; 2],
    /// Pixels that a radian takes, about.
    pub focal: f64,
    /// What a squared pixel of error counts.
    pub weight: f64,
    /// Where it observes a point truly; `None` for a camera that is a projective one.
    pub projection_fns: Option<(Box<Projecting<'a>>, Box<Looking<'a>>)>,
    /// Whether its rays meet in the projective camera's centre.
    pub is_central: bool,
}

/// Cameras that are formulas.
pub struct FormulaCameras<'a> {
    /// They themselves, where they are projective; else the projective ones beside them, from whose point a search
    /// starts.
    pub placed: Vec<PlacedCamera<'a>>,
    /// What they are.
    pub(in crate::method) formulas: Formulas,
    /// How pixels scatter about them, a camera each.
    pub(in crate::method) noise: Vec<&'a PixelNoise>,
}

/// What cameras are.
pub(in crate::method) enum Formulas {
    /// Projection matrices.
    Matrices(Vec<UncertainMatrix>),
    /// Polynomials of the world.
    Polynomials(Polynomials),
}

/// Points from columns of pixels: reads where the base would have them, and puts the map's instead.
type Correcting<'a> = dyn Fn(&PixelColumns, &mut [&mut [f64]; 3]) + Send + Sync + 'a;

/// A map that is a formula.
pub struct Learned<'a> {
    /// The cameras whose point it starts from; none where it starts from nothing.
    pub base: Vec<PlacedCamera<'a>>,
    /// The formula.
    pub correct: Box<Correcting<'a>>,
    /// Those who say whether pixels belong together.
    pub epipolar_check: Vec<PlacedCamera<'a>>,
    /// The covariance of its points, where that is the same everywhere.
    pub covariance: Option<Matrix3<f64>>,
}

impl<'a> PlacedCamera<'a> {
    /// A projective camera without a lens; `None` for a matrix that is none.
    pub(in crate::method) fn plain(projection: &ProjectionMatrix) -> Option<Self> {
        let (inner, _, _) = projection.decompose()?;
        // Depths in world units, so that cameras count alike.
        let scale = projection.0.fixed_view::<1, 3>(2, 0).norm();
        Some(Self {
            projection: ProjectionMatrix(projection.0 / scale),
            nearness: [1.0, 0.0],
            focal: inner[(0, 0)].abs(),
            weight: 1.0,
            projection_fns: None,
            is_central: true,
        })
    }

    /// A camera of which the directions that it observes are those of `projection`, whose plane is as far off as
    /// it is from the centre; `None` where it cannot see along that one's axis.
    pub(in crate::method) fn new(
        projection: ProjectionMatrix,
        (nearness, is_central): ([f64; 2], bool),
        weight: f64,
        project: Box<Projecting<'a>>,
        unproject: Box<Looking<'a>>,
    ) -> Option<Self> {
        let mut camera =
            Self { projection, nearness, focal: 1.0, weight, projection_fns: None, is_central };
        let (axis, [right, _]) = camera.place([0.0; 2], nearness[0])?;
        camera.focal = (project(axis)?.1 * right).norm();
        camera.projection_fns = Some((project, unproject));
        (camera.focal.is_finite() && camera.focal > 0.0).then_some(camera)
    }

    /// The world point that lies at `plane` on the projective camera's plane, with this nearness; and how it
    /// moves with the two coordinates there.
    pub(in crate::method) fn place(
        &self,
        plane: [f64; 2],
        nearness: f64,
    ) -> Option<(Point3, [Vector3; 2])> {
        let linear: Matrix3<f64> = self.projection.0.fixed_view::<3, 3>(0, 0).into_owned();
        let inverse = linear.try_inverse()?;
        let far = Vector3::new(plane[0], plane[1], 1.0) / nearness;
        let point = inverse * (far - self.projection.0.column(3));
        let along = [0, 1].map(|axis| inverse.column(axis) / nearness);
        Some((Point3::from(point), along))
    }

    /// The point of this nearness that the camera observes at `pixel`, as a place on the projective camera's
    /// plane.
    pub(super) fn plane_of(&self, pixel: Pixel, nearness: f64) -> Option<[f64; 2]> {
        /// Newton's steps double the digits; from a ray two or three are the rule.
        const MOST_STEPS: usize = 12;
        /// Far below what any table is to hold.
        const EXACT: f64 = 1e-9;
        let Some((project, unproject)) = &self.projection_fns else {
            return Some([pixel.x, pixel.y]);
        };
        let begin = self.projection.project(unproject(pixel)?)?;
        let mut plane = [begin.x, begin.y];
        for _ in 0..MOST_STEPS {
            let (point, [right, down]) = self.place(plane, nearness)?;
            let (seen, slopes) = project(point)?;
            let (a, b, missed) = (slopes * right, slopes * down, pixel - seen);
            if missed.norm() < EXACT {
                return Some(plane);
            }
            let determinant = a.x * b.y - a.y * b.x;
            plane[0] += (missed.x * b.y - missed.y * b.x) / determinant;
            plane[1] += (a.x * missed.y - a.y * missed.x) / determinant;
        }
        None
    }

    /// Where it observes a world point.
    pub(super) fn project(&self, point: Point3) -> Option<Pixel> {
        match &self.projection_fns {
            Some((project, _)) => Some(project(point)?.0),
            None => self.projection.project(point),
        }
    }
}
