//! Of cameras that are projection matrices.

use super::{Observation, UncertainCameras};
use wheatstone_numeric::number::Number;

/// Products of two of X, Y, Z and 1.
pub(crate) const PRODUCTS: usize = 10;

/// A projection matrix and how sure its numbers are.
#[derive(Clone, Debug)]
pub(crate) struct UncertainMatrix {
    /// Its rows.
    pub(crate) rows: [[f64; 4]; 3],
    /// Where the world's coordinates are 0 for the forms, and where they are 1 farther on.
    pub(crate) world: ([f64; 3], f64),
    /// The same of pixels.
    pub(crate) picture: ([f64; 2], f64),
    /// The covariances of what the rows tell of a place, in pixels times the depth: of the first row with itself, with
    /// the second and the third, of the second with itself and the third, and of the third with itself. Factors of 1, X, Y,
    /// Z, XX, XY, XZ, YY, YZ, ZZ.
    pub(crate) forms: [[f64; PRODUCTS]; 6],
}

/// The sum of products with two numbers and more.
#[inline(always)]
fn sum<N: Number, const D: usize>(factors: &[f64], values: &[N; D], start: N) -> N {
    let mut sum = start;
    for (factor, value) in factors.iter().zip(values) {
        sum = sum.add_product(start.all(*factor), *value);
    }
    sum
}

impl UncertainCameras for Vec<UncertainMatrix> {
    fn count(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn observation<N: Number>(&self, camera: usize, point: [N; 3], noise: N) -> Observation<N> {
        let UncertainMatrix { rows: matrix, world, picture, forms } = &self[camera];
        let zero = noise.all(0.0);
        let mut seen = [zero; 3];
        for (seen, row) in seen.iter_mut().zip(matrix) {
            *seen = sum(row, &point, zero.all(row[3]));
        }
        let nearness = zero.all(1.0) / seen[2];
        let (mut rows, mut at) = ([[zero; 3]; 2], [zero; 2]);
        for axis in 0..2 {
            let pixel = seen[axis] * nearness;
            for (value, (own, depth)) in
                rows[axis].iter_mut().zip(matrix[axis].iter().zip(&matrix[2]))
            {
                *value = zero.all(*own).add_product(pixel, zero.all(-depth)) * nearness;
            }
            at[axis] = (pixel - zero.all(picture.0[axis])) * zero.all(1.0 / picture.1);
        }
        let mut place = point;
        for (value, middle) in place.iter_mut().zip(world.0) {
            *value = (*value - zero.all(middle)) * zero.all(1.0 / world.1);
        }
        let [x, y, z] = place;
        let products = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
        let mut told = [zero; 6];
        for (told, form) in told.iter_mut().zip(forms) {
            *told = sum(&form[1..], &products, zero.all(form[0]));
        }
        // A pixel is the first two of what the rows tell over the third.
        let [xx, xy, xw, yy, yw, ww] = told;
        let (a, b) = (zero - at[0], zero - at[1]);
        let [xw_to_a, yw_to_b] = [xw.add_product(a, ww), yw.add_product(b, ww)];
        let square = nearness * nearness;
        let xx = xx.add_product(a, xw + xw_to_a);
        let yy = yy.add_product(b, yw + yw_to_b);
        let xy = xy.add_product(b, xw).add_product(a, yw_to_b);
        let covariance =
            [noise.add_product(xx, square), xy * square, noise.add_product(yy, square)];
        Observation { rows, covariance }
    }
}
