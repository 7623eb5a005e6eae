//! What the direct linear transformation leaves open about a projection matrix, and what that means
//! for its pixels.
//!
//! The transformation minimises not pixel errors but those times each point's depth; to first order
//! in the errors that is weighted least squares, whose covariance is known (as for any estimate by
//! linear equations, Foerstner & Wrobel 2016, doi:10.1007/978-3-319-11550-4, chapter 4).

use super::{lens_numbers::LensNumbers, pixel_noise::PixelNoise};
use crate::geometry::{
    Pixel, Point3, ProjectionMatrix, Vector3,
    batch_triangulation::{PRODUCTS, UncertainMatrix},
};
use nalgebra::{Matrix2, Matrix3, Matrix3x4, Matrix4, Vector4};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::covariance::{Covariance, LeastSquaresCovariance};

/// Numbers of a projection matrix.
const NUMBERS: usize = 12;

/// How far pixels lie from where a matrix expects them, and how sure its numbers are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MatrixUncertainty {
    /// About its predictions.
    pub(super) noise: PixelNoise,
    /// Middle and root mean square size of the points fitted, then of their pixels: in units of
    /// these the matrix's numbers are of one size.
    world: (Point3, f64),
    picture: (Pixel, f64),
    /// Of the matrix's numbers in those units, row by row.
    covariance: Covariance,
}

impl MatrixUncertainty {
    /// Of the matrix that fits `pairs` best in the algebraic sense.
    pub(super) fn new(matrix: &ProjectionMatrix, pairs: &[(Point3, Pixel)]) -> Option<Self> {
        let count = pairs.len() as f64;
        let middle = pairs.iter().map(|(world, _)| world.coords).sum::<Vector3>() / count;
        let spread = pairs.iter().map(|(world, _)| (world.coords - middle).norm_squared());
        let world = (Point3::from(middle), (spread.sum::<f64>() / count).sqrt());
        let centre = pairs.iter().map(|(_, p)| p.coords).sum::<nalgebra::Vector2<f64>>() / count;
        let spread = pairs.iter().map(|(_, pixel)| (pixel.coords - centre).norm_squared());
        let picture = (Pixel::from(centre), (spread.sum::<f64>() / count).sqrt());
        let seen = pairs.iter().filter_map(|(world, pixel)| {
            Some((*pixel, (matrix.project(*world)? - pixel).norm_squared()))
        });
        let noise = PixelNoise::fit(&seen.collect::<Vec<_>>(), (NUMBERS - 1) as f64);
        let mut found = Self { noise, world, picture, covariance: Covariance::default() };
        let mut equations = LeastSquaresCovariance::new(NUMBERS);
        for (point, pixel) in pairs {
            let (slopes, depth) = found.slopes(matrix, *point)?;
            for axis in 0..2 {
                let row: Vec<f64> = slopes.iter().map(|slope| slope[axis] * depth).collect();
                equations.add(&row, depth * depth * found.noise.variance(*pixel));
            }
        }
        // Its length says nothing of where points fall.
        equations.hold(found.scaled(matrix).normalize().transpose().as_slice());
        found.covariance = equations.covariance()?;
        Some(found)
    }

    /// Of a matrix whose numbers are taken for exact, with even noise of its pixels.
    pub(super) fn known(pixel_sigma: f64) -> Self {
        Self {
            noise: PixelNoise::even(pixel_sigma * pixel_sigma),
            world: (Point3::origin(), 1.0),
            picture: (Pixel::origin(), 1.0),
            covariance: Covariance::zero(NUMBERS),
        }
    }

    /// The camera that a matrix is, with the covariance of fx, fy, cx, cy and skew.
    pub(super) fn lens(&self, matrix: &ProjectionMatrix) -> Option<LensNumbers<5>> {
        let numbers = |matrix: &Matrix3x4<f64>| {
            let (k, _, _) = ProjectionMatrix(*matrix).decompose()?;
            Some([k[(0, 0)], k[(1, 1)], k[(0, 2)], k[(1, 2)], k[(0, 1)]])
        };
        let (to_picture, to_world) = self.units();
        let (back, from_world) = (to_picture.try_inverse()?, to_world.try_inverse()?);
        let scaled = self.scaled(matrix);
        // Small beside the matrix, large beside what rounding does to it.
        let step = 1e-6 * scaled.norm();
        let mut slopes = [[0.0; 5]; NUMBERS];
        for (number, slopes) in slopes.iter_mut().enumerate() {
            let place = (number / 4, number % 4);
            let moved = |by: f64| {
                let mut moved = scaled;
                moved[place] += by;
                numbers(&(back * moved * from_world))
            };
            let (above, below) = (moved(step)?, moved(-step)?);
            *slopes = std::array::from_fn(|index| (above[index] - below[index]) / (2.0 * step));
        }
        let mut covariance = [[0.0; 5]; 5];
        for (i, left) in slopes.iter().enumerate() {
            for (j, right) in slopes.iter().enumerate() {
                let of_two = self.covariance.between(i.max(j), i.min(j))?;
                for (row, own) in covariance.iter_mut().zip(left) {
                    row.iter_mut().zip(right).for_each(|(sum, other)| *sum += own * of_two * other);
                }
            }
        }
        let (_, rotation, _) = matrix.decompose()?;
        Some(LensNumbers {
            names: ["fx", "fy", "cx", "cy", "skew"],
            values: numbers(&matrix.0)?,
            covariance,
            centre: matrix.centre()?,
            axis: rotation.row(2).transpose(),
        })
    }

    /// From pixels to the covariance's units, and from those to the world.
    fn units(&self) -> (Matrix3<f64>, Matrix4<f64>) {
        let ((middle, size), (centre, extent)) = (self.world, self.picture);
        let mut to_world = Matrix4::from_diagonal(&Vector4::new(size, size, size, 1.0));
        to_world.fixed_view_mut::<3, 1>(0, 3).copy_from(&middle.coords);
        (Matrix3::new(1.0, 0.0, -centre.x, 0.0, 1.0, -centre.y, 0.0, 0.0, extent), to_world)
    }

    /// The matrix in the units of the covariance.
    fn scaled(&self, matrix: &ProjectionMatrix) -> Matrix3x4<f64> {
        let (to_picture, to_world) = self.units();
        to_picture * matrix.0 * to_world
    }

    /// Derivatives of a world point's pixel by the matrix's numbers in the units of the covariance,
    /// and the point's depth.
    fn slopes(
        &self,
        matrix: &ProjectionMatrix,
        point: Point3,
    ) -> Option<([[f64; 2]; NUMBERS], f64)> {
        let pixel = matrix.project(point)?;
        let depth = (matrix.0 * point.to_homogeneous()).z;
        let ((middle, size), (centre, extent)) = (self.world, self.picture);
        let place = ((point - middle) / size).push(1.0);
        let at = (pixel - centre) / extent;
        let mut slopes = [[0.0; 2]; NUMBERS];
        for (column, value) in place.iter().enumerate() {
            slopes[column][0] = value / depth;
            slopes[4 + column][1] = value / depth;
            slopes[8 + column] = [-at.x * value / depth, -at.y * value / depth];
        }
        Some((slopes, depth))
    }

    /// Covariance of a pixel of this point about its prediction.
    pub(super) fn pixel_covariance(
        &self,
        matrix: &ProjectionMatrix,
        point: Point3,
        pixel: Pixel,
    ) -> Option<Matrix2<f64>> {
        let (slopes, _) = self.slopes(matrix, point)?;
        let noise = Matrix2::from_diagonal_element(self.noise.variance(pixel));
        Some(noise + self.covariance.of_two(&slopes))
    }

    /// The matrix with what is known of it, for many points at once: [`MatrixUncertainty::pixel_covariance`] as forms of the
    /// place.
    pub(super) fn matrix(&self, matrix: &ProjectionMatrix) -> Option<UncertainMatrix> {
        let mut forms = [[0.0; PRODUCTS]; 6];
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        for (form, (first, second)) in forms.iter_mut().zip(pairs) {
            // The place is X, Y, Z, 1; the products begin with 1, X, Y, Z.
            let products = [(3, 3), (0, 3), (1, 3), (2, 3)].into_iter();
            let products = products.chain([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]);
            for (factor, (i, j)) in form.iter_mut().zip(products) {
                let of =
                    |i: usize, j: usize| self.covariance.between(4 * first + i, 4 * second + j);
                *factor = if i == j { of(i, i)? } else { of(i, j)? + of(j, i)? };
            }
        }
        Some(UncertainMatrix {
            rows: [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| matrix.0[(row, column)])),
            world: (self.world.0.into(), self.world.1),
            picture: (self.picture.0.into(), self.picture.1),
            forms,
        })
    }

    pub(super) fn is_consistent(&self) -> bool {
        let (world, picture) = (self.world, self.picture);
        self.noise.is_consistent()
            && [world.1, picture.1].iter().all(|size| *size > 0.0 && size.is_finite())
            && world.0.iter().chain(picture.0.iter()).all(|value| value.is_finite())
            && self.covariance.is_sound(NUMBERS)
    }
}
