//! The law of errors of points whose pixels were rounded to a raster: bounded, and so smaller than
//! normal ones far out.

use super::Ellipsoids;
use crate::{
    dataset::Dataset,
    geometry::{Pixel, Point3, Vector3},
    method::Reconstructor,
};
use nalgebra::{Matrix3, Matrix3xX};
use rayon::prelude::*;
use wheatstone_numeric::{random::Random, statistics::percentile};

/// Draws are the same for every map.
const DRAWS_SEED: u64 = 1900;

impl Ellipsoids {
    /// Radii by the law of the pixels' noise: that of rounding where all pixels lie on a raster, and
    /// normal as far as there is more of it.
    pub(super) fn of_noise(reconstructor: &dyn Reconstructor, data: &Dataset) -> Self {
        /// A quarter of a million draws leave a squared radius uncertain by a third of a percent.
        const POINTS: usize = 256;
        let Some(step) = raster(data) else { return Self::NORMAL };
        let stride = data.correspondences.len().div_ceil(POINTS).max(1);
        let rows: Vec<&[Option<Pixel>]> =
            data.known().step_by(stride).map(|(_, row)| row.pixels.as_slice()).collect();
        let distances: Vec<f64> = rows
            .into_par_iter()
            .enumerate()
            .filter_map(|(index, pixels)| {
                Linear::at(reconstructor, pixels, step)
                    .map(|map| map.distances(&mut Random::stream(DRAWS_SEED, index as u64)))
            })
            .flatten_iter()
            .collect();
        if distances.is_empty() {
            return Self::NORMAL;
        }
        Self { radius2_68: percentile(&distances, 0.68), radius2_95: percentile(&distances, 0.95) }
    }
}

/// The raster that all pixels lie on, in pixels: the coarsest of those that detectors and files
/// round to; `None` for pixels on none.
pub(super) fn raster(data: &Dataset) -> Option<f64> {
    // Finer ones are no noise to speak of beside any detector's.
    const STEPS: [f64; 9] = [2.0, 1.0, 0.5, 0.25, 0.2, 0.125, 0.1, 0.0625, 0.05];
    let values = || {
        let pixels = data.known().flat_map(|(_, row)| row.pixels.iter().flatten());
        pixels.flat_map(|pixel| [pixel.x, pixel.y])
    };
    let first = values().next()?;
    let on = |step: f64| {
        // Far above rounding of the numbers, far below a step.
        values().all(|value| {
            let steps = (value - first) / step;
            (steps - steps.round()).abs() < 1e-6
        })
    };
    STEPS.into_iter().find(|step| on(*step))
}

/// A map near one point: how its errors follow from those of the pixels, in units in which the
/// point's covariance is the identity.
struct Linear {
    /// By each pixel coordinate's rounding, which is uniform from -1 to 1.
    rounding: Matrix3xX<f64>,
    /// A root of what of the covariance is not the rounding's, and is taken for normal.
    rest: Matrix3<f64>,
}

impl Linear {
    /// With pixels that were rounded to a raster of this `step`.
    fn at(reconstructor: &dyn Reconstructor, pixels: &[Option<Pixel>], step: f64) -> Option<Self> {
        let located = reconstructor.locate(pixels)?;
        let whitened = located.covariance.cholesky()?.l().try_inverse()?;
        let mut columns = Vec::new();
        for (camera, seen) in pixels.iter().enumerate() {
            let Some(seen) = seen else { continue };
            let sigma = reconstructor.pixel_sigma(camera, *seen, located.point)?;
            if sigma <= 0.0 {
                return None;
            }
            // Of a uniform error; three times its variance is the square of its half width.
            let half_width = (3.0 * f64::min(step * step / 12.0, sigma * sigma)).sqrt();
            for axis in 0..2 {
                let moved = |by: f64| -> Option<Point3> {
                    let mut pixels = pixels.to_vec();
                    pixels.get_mut(camera)?.as_mut()?[axis] += by;
                    reconstructor.locate_point(&pixels)
                };
                // Half the noise to both sides: the map is all but straight over the noise itself.
                let step = 0.5 * sigma;
                let slope = whitened * (moved(step)? - moved(-step)?) / (2.0 * step);
                columns.push(slope * half_width);
            }
        }
        let rounding = Matrix3xX::from_columns(&columns);
        let of_rounding = &rounding * rounding.transpose() / 3.0;
        let rest = (Matrix3::identity() - of_rounding).symmetric_eigen();
        let roots = rest.eigenvalues.map(|value| value.max(0.0).sqrt());
        let rest = rest.eigenvectors * Matrix3::from_diagonal(&roots);
        Some(Self { rounding, rest })
    }

    /// Squared Mahalanobis distances of points whose pixels were rounded.
    fn distances(&self, random: &mut Random) -> Vec<f64> {
        const DRAWS: usize = 1024;
        let mut draw = |_| {
            let rest = self.rest * Vector3::new(random.normal(), random.normal(), random.normal());
            let mut error = Vector3::zeros();
            for column in self.rounding.column_iter() {
                error += column * random.uniform(-1.0, 1.0);
            }
            // What is drawn serves twice: its parts are as likely with the one's sign changed.
            [(error + rest).norm_squared(), (error - rest).norm_squared()]
        };
        (0..DRAWS / 2).flat_map(&mut draw).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Correspondence;

    /// Points whose pixels are anywhere in a picture, then what `put` makes of them.
    fn pixels(put: impl Fn(f64) -> f64) -> Dataset {
        let mut random = Random::new(60);
        let mut pixel = || {
            let place = [random.uniform(0.0, 639.0), random.uniform(0.0, 479.0)].map(&put);
            Some(Pixel::new(place[0], place[1]))
        };
        let row = |_| Correspondence {
            view: 0,
            id: None,
            pixels: vec![pixel(), pixel()],
            world: Some(Point3::origin()),
            board: None,
        };
        let correspondences = (0..400).map(row).collect();
        Dataset { unit: "cm".into(), cameras: 2, views: Vec::new(), correspondences }
    }

    #[test]
    fn a_raster_may_be_shifted_and_fine_noise_is_on_none() {
        assert_eq!(raster(&pixels(f64::round)), Some(1.0));
        assert_eq!(raster(&pixels(|value| 0.25 * value.round() + 0.3)), Some(0.25));
        assert_eq!(raster(&pixels(|value| value)), None);
    }
}
