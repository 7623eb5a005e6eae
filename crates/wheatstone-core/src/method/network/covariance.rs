//! How sure the network's points are: noise of the pixels, carried through the whole map, and what
//! is not known about the weights.

use super::{
    Samples,
    fusion::Estimate,
    noise::{DISTANCE, Noise, direction, place},
    set_network::{Query, SetNetwork},
};
use crate::{
    geometry::{Pixel, Point3},
    method::PixelNoise,
};
use nalgebra::{DMatrix, Matrix3, Point2, Vector3};
use wheatstone_numeric::{
    evidence::Trained,
    matrix_product::product,
    simd::{Simd, WithSimd, on_widest},
};

impl SetNetwork {
    /// What it says of a point seen at `pixels`, one entry a camera of the rig.
    pub(super) fn estimate(&self, pixels: &[Option<Pixel>]) -> Option<Estimate> {
        let query = self.query(pixels)?;
        let targets = self.predict(&query);
        let by_places = self.motions_of_places(&query)?;
        let weights = self.covariance_of_weights(&query.unit);
        let mut by_pixels = DMatrix::zeros(3, 2 * pixels.len());
        let placed = product(&by_places, &by_places.transpose());
        let placed = placed.fixed_view::<3, 3>(0, 0).into_owned();
        if let Noise::Targets { variance } = &self.noise {
            let noise = self.scale() * Matrix3::from_diagonal(&(*variance).into()) * self.scale();
            let covariance = noise + weights + placed;
            return Some(Estimate { targets, by_pixels, sigma: 0.0, by_places, covariance });
        }
        let slopes = self.slopes(&query)?;
        for (index, camera) in self.cameras.iter().enumerate() {
            by_pixels.columns_mut(2 * camera, 2).copy_from(&slopes.columns(2 * index, 2));
        }
        let sigmas = self.pixel_sigmas(targets);
        let sigma = sigmas[DISTANCE];
        let unit = product(&slopes, &slopes.transpose()).fixed_view::<3, 3>(0, 0).into_owned();
        let missed = sigmas.map(|of_target| (of_target.powi(2) - sigma.powi(2)).max(0.0));
        let missed = Matrix3::from_diagonal(&missed.into()).component_mul(&unit);
        let noise = unit * sigma.powi(2) + missed;
        let local = self.local_noise(&noise);
        let covariance = noise + local * weights * local + placed;
        Some(Estimate { targets, by_pixels, sigma, by_places, covariance })
    }

    /// The variance of a pixel coordinate that explains the errors at these points, of the target of which that is most,
    /// over what cameras leave; `None` where no cameras told.
    pub(super) fn misfit(&self, points: &[Point3]) -> Option<f64> {
        let Noise::PixelsByTarget { by_target, pixel: Some(pixel), .. } = &self.noise else {
            return None;
        };
        let at = |noise: &PixelNoise| {
            let each = points.iter().map(|point| noise.variance(place(self.targets.of(*point))));
            each.sum::<f64>() / points.len() as f64
        };
        Some(by_target.iter().map(at).fold(0.0, f64::max) / pixel)
    }

    /// Standard deviations of a pixel coordinate that explain the errors of each target.
    fn pixel_sigmas(&self, targets: [f64; 3]) -> [f64; 3] {
        let variances = match &self.noise {
            Noise::Targets { .. } => [0.0; 3],
            Noise::Pixels { noise } => [noise.variance(direction(targets)); 3],
            Noise::PixelsByTarget { by_target, .. } => {
                by_target.each_ref().map(|noise| noise.variance(place(targets)))
            }
        };
        variances.map(f64::sqrt)
    }

    /// Standard deviations of a point's targets, by the covariance that `noise` makes, over those that the
    /// covariance of the weights goes by: what the weights say of a place they have learned from points near it.
    fn local_noise(&self, noise: &Matrix3<f64>) -> Matrix3<f64> {
        let Noise::PixelsByTarget { trained, .. } = &self.noise else { return Matrix3::identity() };
        let ratio = |target: usize| {
            let scale = self.outputs[target].high - self.outputs[target].low;
            let here = noise[(target, target)];
            let everywhere = trained[target] * scale * scale;
            if everywhere > 0.0 { (here / everywhere).sqrt() } else { 1.0 }
        };
        Matrix3::from_diagonal(&[0, 1, 2].map(ratio).into())
    }

    /// Derivatives of the targets by the pixels' coordinates, three rows; that of the base neglects
    /// how its rays' misses bend it.
    fn slopes(&self, query: &Query) -> Option<DMatrix<f64>> {
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
            slopes += self.sloped_base(base, &query.pixels)?.slopes;
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

    /// Takes for the noise of the pixels what explains the errors of each target at known points best, in the sense
    /// of maximum likelihood; the weights that the data determine have made those smaller. `pixel` is the variance of
    /// a pixel coordinate, where cameras tell it.
    pub(super) fn learn_noise(
        &mut self,
        (samples, queries): (&Samples, &[Query]),
        trained: &Trained,
        pixel: Option<f64>,
    ) {
        let mut squares: [Vec<(Point2<f64>, f64)>; 3] = Default::default();
        for (query, point) in queries.iter().zip(&samples.points) {
            let wanted = self.targets.of(*point);
            let error = Vector3::from(self.predict(query)) - Vector3::from(wanted);
            let Some(slopes) = self.slopes(query) else { continue };
            for (target, squares) in squares.iter_mut().enumerate() {
                let unit = slopes.row(target).norm_squared();
                // Of one coordinate, where the noise counts two.
                squares.push((place(wanted), 2.0 * error[target] * error[target] / unit));
            }
        }
        let determined = trained.effective_parameters * (2.0 / 3.0);
        let by_target = if is_even(&squares) {
            let noise = PixelNoise::fit(&squares.concat(), 3.0 * determined);
            [noise.clone(), noise.clone(), noise]
        } else {
            squares.map(|squares| PixelNoise::fit(&squares, determined))
        };
        self.noise = Noise::PixelsByTarget {
            by_target,
            trained: [0, 1, 2].map(|target| trained.noise[target]),
            pixel,
        };
    }
}

/// Whether the same noise explains the squared errors of all targets, by Schwarz's criterion (1978,
/// doi:10.1214/aos/1176344136).
fn is_even(squares: &[Vec<(Point2<f64>, f64)>; 3]) -> bool {
    let count = squares[0].len() as f64;
    let means = squares.each_ref().map(|of| of.iter().map(|(_, s)| s).sum::<f64>() / count);
    let pooled = means.iter().sum::<f64>() / 3.0;
    let gain = count * means.iter().map(|mean| libm::log(pooled / mean)).sum::<f64>();
    gain < 2.0 * libm::log(3.0 * count)
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
        let fitted = &fitted.sets[0];
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
