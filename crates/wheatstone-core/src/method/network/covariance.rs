//! How sure the network's points are: noise of the pixels, carried through the whole map, and what
//! is not known about the weights.

use super::{
    NetworkReconstructor, Query,
    noise::{Noise, direction},
};
use crate::{
    geometry::{Pixel, Point3},
    method::PixelNoise,
};
use nalgebra::{DMatrix, Matrix3, Point2, Vector3};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

impl NetworkReconstructor {
    /// Derivatives of the targets by the pixels' coordinates, three rows; that of the base neglects
    /// how its rays' misses bend it.
    fn slopes(&self, query: &Query<'_>) -> Option<DMatrix<f64>> {
        let width = query.unit.len();
        let mut rows = vec![0.0; 3 * width];
        self.perceptron.input_jacobian(&query.unit, &mut rows);
        let mut slopes = DMatrix::from_row_slice(3, width, &rows);
        for (axis, scale) in self.outputs.iter().enumerate() {
            slopes.row_mut(axis).scale_mut(scale.high - scale.low);
        }
        for (column, scale) in self.inputs.iter().enumerate() {
            slopes.column_mut(column).unscale_mut(scale.high - scale.low);
        }
        if let Some(base) = self.base.as_ref().zip(query.base) {
            slopes += self.sloped_base(base, query.pixels)?.slopes;
        }
        Some(slopes)
    }

    /// What is not known about the weights, as covariance of the targets.
    fn covariance_of_weights(&self, unit: &[f64]) -> Matrix3<f64> {
        if self.weight_covariance.is_empty() {
            return Matrix3::zeros();
        }
        let count = self.perceptron.weights().len();
        let mut rows = vec![0.0; 3 * count];
        self.perceptron.jacobian(unit, &mut rows);
        let slopes: [&[f64]; 3] = [0, 1, 2].map(|output| &rows[output * count..][..count]);
        let quadratic = Quadratic { triangle: &self.weight_covariance, slopes };
        let sums = Matrix3::from(on_widest(quadratic));
        let scale = self.scale();
        scale * ((sums + sums.transpose()) / 2.0) * scale
    }

    /// From scaled outputs to targets.
    fn scale(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.outputs.map(|scale| scale.high - scale.low).into())
    }

    /// Covariance of the `targets` of a point.
    pub(super) fn target_covariance(
        &self,
        query: &Query<'_>,
        targets: [f64; 3],
    ) -> Option<Matrix3<f64>> {
        let noise = match &self.noise {
            Noise::Targets { variance } => {
                let scale = self.scale();
                scale * Matrix3::from_diagonal(&(*variance).into()) * scale
            }
            Noise::Pixels { noise } => {
                carried(&self.slopes(query)?) * noise.variance(direction(targets))
            }
        };
        let places = self.covariance_of_places(query)?;
        Some(noise + self.covariance_of_weights(&query.unit) + places)
    }

    /// Takes for the pixels' noise what explains the errors at known points best, in the sense of
    /// maximum likelihood; `determined` weights have made those smaller. `base`: where the base locates each
    /// point.
    pub(super) fn learn_noise(
        &mut self,
        (inputs, base): (&[Vec<f64>], &[Option<Point3>]),
        points: &[Point3],
        determined: f64,
    ) {
        let square = |((row, base), point): ((&Vec<f64>, &Option<Point3>), &Point3)| {
            let pixels: Vec<Option<Pixel>> =
                row.chunks_exact(2).map(|xy| Some(Pixel::new(xy[0], xy[1]))).collect();
            let query = Query { pixels: &pixels, unit: self.scaled_inputs(row), base: *base };
            let (found, wanted) = (self.predict(&query), self.targets.of(*point));
            let error = Vector3::from(found) - Vector3::from(wanted);
            let inverse = carried(&self.slopes(&query)?).try_inverse()?;
            // Of three coordinates, where the noise counts two.
            Some((direction(wanted), error.dot(&(inverse * error)) * (2.0 / 3.0)))
        };
        let squares: Vec<(Point2<f64>, f64)> =
            inputs.iter().zip(base).zip(points).filter_map(square).collect();
        self.noise = Noise::Pixels { noise: PixelNoise::fit(&squares, determined * (2.0 / 3.0)) };
    }
}

/// Twice the symmetric part of `slopes' C slopes` adds up in this, of a matrix that is kept as the rows of its
/// lower triangle: it is read once for the three of them.
struct Quadratic<'a> {
    triangle: &'a [f64],
    slopes: [&'a [f64]; 3],
}

impl WithSimd for Quadratic<'_> {
    type Output = [[f64; 3]; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [[f64; 3]; 3] {
        let mut sums = [[0.0; 3]; 3];
        let mut start = 0;
        for first in 0..self.slopes[0].len() {
            let row = &self.triangle[start..=start + first];
            start += first + 1;
            let [a, b, c] = self.slopes;
            let below = dots(row, [&a[..=first], &b[..=first], &c[..=first]]);
            for (output, below) in below.into_iter().enumerate() {
                // The diagonal counts once, what lies beside it twice.
                let product = 2.0 * below - row[first] * self.slopes[output][first];
                for (sums, slopes) in sums.iter_mut().zip(self.slopes) {
                    sums[output] += product * slopes[first];
                }
            }
        }
        sums
    }
}

/// Sums of the products of a row with three others, eight sums beside each other, whatever the width of
/// registers.
#[inline(always)]
fn dots(row: &[f64], others: [&[f64]; 3]) -> [f64; 3] {
    let (row, row_rest) = row.as_chunks::<8>();
    let [a, b, c] = others;
    let ([a, b, c], rests) = {
        let ((a, x), (b, y), (c, z)) = (a.as_chunks::<8>(), b.as_chunks::<8>(), c.as_chunks::<8>());
        ([a, b, c], [x, y, z])
    };
    let mut sums = [[0.0; 8]; 3];
    for (((row, a), b), c) in row.iter().zip(a).zip(b).zip(c) {
        for lane in 0..8 {
            sums[0][lane] += row[lane] * a[lane];
            sums[1][lane] += row[lane] * b[lane];
            sums[2][lane] += row[lane] * c[lane];
        }
    }
    let mut found = [0.0; 3];
    for ((found, sums), rest) in found.iter_mut().zip(sums).zip(rests) {
        *found = sums.iter().sum::<f64>();
        *found += row_rest.iter().zip(rest).map(|(a, b)| a * b).sum::<f64>();
    }
    found
}

/// J J': the covariance that unit noise of the pixels makes.
fn carried(slopes: &DMatrix<f64>) -> Matrix3<f64> {
    let product = slopes * slopes.transpose();
    product.fixed_view::<3, 3>(0, 0).into_owned()
}

#[cfg(test)]
mod tests {
    use crate::{
        geometry::Pixel,
        method::{AnyMethod, AnyReconstructor, network::Training, staged::staged},
    };
    use nalgebra::Vector3;
    use wheatstone_numeric::progress::Silent;

    #[test]
    fn the_maps_slopes_are_its_differences_and_its_residual_is_in_pixels() {
        let data = staged(0.1);
        let mut method = AnyMethod::named("network").unwrap();
        if let AnyMethod::Network(network) = &mut method
            && let Training::Evidence(training) = &mut network.training
        {
            (training.starts, training.steps) = (1, 60);
        }
        let fit = method.fit_checked(&data, 0, &Silent).unwrap();
        let AnyReconstructor::Network(fitted) = fit.reconstructor else { unreachable!() };
        let targets = |pixels: &[Option<Pixel>]| {
            Vector3::from(fitted.predict(&fitted.query(pixels).unwrap()))
        };
        for row in data.correspondences.iter().step_by(37) {
            let slopes = fitted.slopes(&fitted.query(&row.pixels).unwrap()).unwrap();
            for column in 0..4 {
                let at = |by: f64| {
                    let mut moved = row.pixels.clone();
                    moved[column / 2].as_mut().unwrap()[column % 2] += by;
                    targets(&moved)
                };
                let difference = (at(1e-3) - at(-1e-3)) / 2e-3;
                let gap = (difference - slopes.column(column)).norm();
                assert!(gap < 0.02 * difference.norm(), "{gap} of {difference}");
            }
        }
    }
}
