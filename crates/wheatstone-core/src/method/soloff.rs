//! Each camera a polynomial from the world to its picture, cubic across and quadratic in depth, as
//! particle image velocimetry uses it; each located point the one with the least pixel errors.
//!
//! Source: Soloff, Adrian & Liu 1997 (doi:10.1088/0957-0233/8/12/008), equation 26: 19 terms in X, Y
//! and Z, here on coordinates scaled to -1..1. Terms that the points do not determine are left out:
//! two planes make it linear in Z.

use super::{
    AnyMethod, Fit, FormulaCameras, Formulas, Located, Method, PixelNoise, PlacedCamera, Plan,
    Reconstructor,
    checks::{enough, linear_camera, on_one_plane},
    only_default,
    point_covariance::Observation,
};
use crate::{
    Result,
    dataset::Dataset,
    geometry::{
        Pixel, Point3, ProjectionMatrix,
        batch_triangulation::{POWERS, Polynomials, SoloffPolynomial, TERMS},
        triangulation,
    },
};
use nalgebra::{Matrix2, Matrix2x3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::{
    covariance::{Covariance, LeastSquaresCovariance},
    least_squares::solve,
    progress::Progress,
};

/// There is nothing to set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Soloff {}

/// The fitted cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoloffReconstructor {
    cameras: Vec<PolynomialCamera>,
    /// Middle of the fitted points, in world units.
    centre: [f64; 3],
    /// Half their extent, in world units.
    half: [f64; 3],
    /// Standard deviation of one pixel coordinate about its prediction, over all cameras.
    pixel_sigma: f64,
}

/// One camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PolynomialCamera {
    /// Powers of scaled X, Y and Z, a term each.
    powers: Vec<[u8; 3]>,
    /// Pixel x and y that each term adds.
    terms: Vec<[f64; 2]>,
    /// The distortion-free camera from which a search starts.
    start: ProjectionMatrix,
    /// Of pixels about their predictions.
    noise: PixelNoise,
    /// Of the terms along x, as of those along y.
    covariance: Covariance,
}

/// Soloff's terms, those of low degree first, so that the data choose among the high ones.
fn all_powers() -> Vec<[u8; 3]> {
    let mut powers: Vec<[u8; 3]> = (0..4 * 4 * 3_u8)
        .map(|index| [index / 12, index / 3 % 4, index % 3])
        .filter(|[x, y, z]| x + y + z <= 3)
        .collect();
    powers.sort_by_key(|[x, y, z]| (x + y + z, *z, *y));
    powers
}

/// A term whose values over the points are, but for this share, a sum of earlier terms' is not
/// determined by them: points of one level of a stage differ by rounding or by a hundredth of its
/// extent, and such a term would grow by the inverse beyond them.
const LEAST_SHARE: f64 = 0.02;

/// The terms that the points determine: each is kept if something is left of it when those before it
/// are taken out (Gram & Schmidt, twice for accuracy).
fn determined(points: &[[f64; 3]]) -> Vec<[u8; 3]> {
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mut kept: Vec<[u8; 3]> = Vec::new();
    let mut directions: Vec<Vec<f64>> = Vec::new();
    for powers in all_powers() {
        // Two coordinates share the terms, and the noise must show: one point more than terms.
        if kept.len() + 1 >= points.len() {
            break;
        }
        let mut values: Vec<f64> = points.iter().map(|point| monomial(*point, powers)).collect();
        let whole = norm(&values);
        for _ in 0..2 {
            for direction in &directions {
                let share: f64 = direction.iter().zip(&values).map(|(d, v)| d * v).sum();
                values.iter_mut().zip(direction).for_each(|(v, d)| *v -= share * d);
            }
        }
        let left = norm(&values);
        if left > LEAST_SHARE * whole {
            values.iter_mut().for_each(|v| *v /= left);
            directions.push(values);
            kept.push(powers);
        }
    }
    kept
}

fn power(value: f64, exponent: u8) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * value)
}

fn monomial(point: [f64; 3], powers: [u8; 3]) -> f64 {
    (0..3).map(|axis| power(point[axis], powers[axis])).product()
}

impl PolynomialCamera {
    /// Of points on scaled coordinates.
    fn fit(
        pairs: &[(Point3, Pixel)],
        scaled: &[[f64; 3]],
        camera: usize,
        progress: &dyn Progress,
    ) -> Result<Self> {
        progress.check()?;
        enough("soloff", Some(camera), ProjectionMatrix::POINTS_NEEDED, pairs.len())?;
        let degenerate = || on_one_plane(camera);
        let start = linear_camera(camera, pairs)?;
        let powers = determined(scaled);
        let rows: Vec<f64> = scaled
            .iter()
            .flat_map(|point| powers.iter().map(|powers| monomial(*point, *powers)))
            .collect();
        let pixels: Vec<f64> = pairs.iter().flat_map(|(_, pixel)| [pixel.x, pixel.y]).collect();
        let solution = solve(&rows, powers.len(), &pixels, 2).ok_or_else(degenerate)?;
        let terms = (0..powers.len()).map(|term| [solution[(term, 0)], solution[(term, 1)]]);
        let (noise, covariance) = (PixelNoise::even(0.0), Covariance::default());
        let mut fitted = Self { terms: terms.collect(), powers, start, noise, covariance };
        let errors = scaled
            .iter()
            .zip(pairs)
            .map(|(point, (_, pixel))| (*pixel, (fitted.project(*point).0 - pixel).norm_squared()));
        let width = fitted.powers.len();
        fitted.noise = PixelNoise::fit(&errors.collect::<Vec<_>>(), (2 * width) as f64);
        let mut spread = LeastSquaresCovariance::new(width);
        for (row, (_, pixel)) in rows.chunks_exact(width).zip(pairs) {
            spread.add(row, fitted.noise.variance(*pixel));
        }
        fitted.covariance = spread.covariance().ok_or_else(degenerate)?;
        Ok(fitted)
    }

    /// Covariance of a pixel of a point on scaled coordinates about its prediction.
    fn pixel_covariance(&self, point: [f64; 3], pixel: Pixel) -> Matrix2<f64> {
        let values: Vec<f64> = self.powers.iter().map(|powers| monomial(point, *powers)).collect();
        let variance = self.noise.variance(pixel) + self.covariance.of_one(&values);
        Matrix2::from_diagonal_element(variance)
    }

    /// Where a point on scaled coordinates falls, with the derivatives by them.
    fn project(&self, point: [f64; 3]) -> (Pixel, Matrix2x3<f64>) {
        let (mut pixel, mut slopes) = (Pixel::origin(), Matrix2x3::zeros());
        // All powers at once, and what they are derived to.
        let along = point.map(|value| [1.0, value, value * value, value * value * value]);
        let derived = along.map(|[one, value, square, _]| [0.0, one, 2.0 * value, 3.0 * square]);
        for (powers, term) in self.powers.iter().zip(&self.terms) {
            let [a, b, c] = powers.map(usize::from);
            let [x, y, z] = [along[0][a], along[1][b], along[2][c]];
            let by = [derived[0][a] * y * z, x * derived[1][b] * z, x * y * derived[2][c]];
            for row in 0..2 {
                pixel[row] += term[row] * (x * y * z);
                for (axis, by) in by.into_iter().enumerate() {
                    slopes[(row, axis)] += term[row] * by;
                }
            }
        }
        (pixel, slopes)
    }

    /// With the factors of all terms that a polynomial may have; `None` where it has others.
    fn whole(&self) -> Option<SoloffPolynomial> {
        let place = |powers: &[u8; 3]| POWERS.iter().position(|known| known == powers);
        let places: Vec<usize> = self.powers.iter().map(place).collect::<Option<_>>()?;
        let (mut factors, mut covariance) = ([[0.0; TERMS]; 2], [[0.0; TERMS]; TERMS]);
        for (own, (place, term)) in places.iter().zip(&self.terms).enumerate() {
            (factors[0][*place], factors[1][*place]) = (term[0], term[1]);
            for (other, second) in places[..=own].iter().enumerate() {
                covariance[*place.max(second)][*place.min(second)] =
                    self.covariance.between(own, other)?;
            }
        }
        Some(SoloffPolynomial { factors, covariance })
    }

    fn is_consistent(&self) -> bool {
        self.powers.len() == self.terms.len()
            && self.noise.is_consistent()
            && self.covariance.is_sound(self.powers.len())
            && self.powers.iter().all(|[x, y, z]| x.max(y) <= &3 && *z <= 2)
            && self.terms.iter().flatten().chain(&self.start.0).all(|value| value.is_finite())
    }
}

impl Method for Soloff {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        let along = |axis: usize| train.known().map(move |(world, _)| world[axis]);
        let low = [0, 1, 2].map(|axis| along(axis).fold(f64::INFINITY, f64::min));
        let high = [0, 1, 2].map(|axis| along(axis).fold(f64::NEG_INFINITY, f64::max));
        let mut fitted = SoloffReconstructor {
            cameras: Vec::new(),
            centre: [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis])),
            // Where all points are level any unit does.
            half: [0, 1, 2].map(|axis| {
                let half = 0.5 * (high[axis] - low[axis]);
                if half > 0.0 { half } else { 1.0 }
            }),
            pixel_sigma: 0.0,
        };
        let (mut squares, mut freedom) = (0.0, 0.0);
        for camera in 0..train.cameras {
            let pairs = train.seen_by_camera(camera);
            let scaled: Vec<[f64; 3]> = pairs.iter().map(|(p, _)| fitted.scaled(*p)).collect();
            let polynomial = PolynomialCamera::fit(&pairs, &scaled, camera, progress)?;
            for (point, (_, pixel)) in scaled.iter().zip(&pairs) {
                squares += (polynomial.project(*point).0 - pixel).norm_squared();
            }
            freedom += 2.0 * (pairs.len() as f64 - polynomial.powers.len() as f64);
            fitted.cameras.push(polynomial);
        }
        fitted.pixel_sigma = (squares / f64::max(freedom, 1.0)).sqrt();
        Ok(Fit::of(fitted))
    }

    fn summary(&self) -> &'static str {
        "each camera a polynomial of the world, cubic across and quadratic in depth (1997)"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

impl SoloffReconstructor {
    fn scaled(&self, point: Point3) -> [f64; 3] {
        [0, 1, 2].map(|axis| (point[axis] - self.centre[axis]) / self.half[axis])
    }

    /// Where a camera observes a world point, with derivatives.
    fn seen_by(&self, camera: &PolynomialCamera, world: Point3) -> (Pixel, Matrix2x3<f64>) {
        let (pixel, mut slopes) = camera.project(self.scaled(world));
        for axis in 0..3 {
            slopes.column_mut(axis).unscale_mut(self.half[axis]);
        }
        (pixel, slopes)
    }

    /// The cameras made ready for many points.
    fn formulas(&self) -> Option<FormulaCameras<'_>> {
        let cameras = self.cameras.iter().map(PolynomialCamera::whole).collect::<Option<_>>()?;
        let placed = self.cameras.iter().map(|camera| PlacedCamera::plain(&camera.start));
        let polynomials = Polynomials { cameras, centre: self.centre, half: self.half };
        Some(FormulaCameras {
            placed: placed.collect::<Option<_>>()?,
            formulas: Formulas::Polynomials(polynomials),
            noise: self.cameras.iter().map(|camera| &camera.noise).collect(),
        })
    }

    /// Where a camera, counted from 0, observes a world point.
    #[must_use]
    pub fn project(&self, camera: usize, world: Point3) -> Option<Pixel> {
        Some(self.cameras.get(camera)?.project(self.scaled(world)).0)
    }
}

impl Reconstructor for SoloffReconstructor {
    fn cameras(&self) -> usize {
        self.cameras.len()
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let (cameras, seen): (Vec<&PolynomialCamera>, Vec<Pixel>) =
            self.cameras.iter().zip(pixels).filter_map(|(c, p)| Some((c, (*p)?))).unzip();
        let starts = cameras.iter().map(|camera| &camera.start);
        let start = triangulation::linear(starts.zip(seen.iter().copied()))?;
        let found = triangulation::refine(start, &seen, |index, point| {
            Some(self.seen_by(cameras[index], point))
        })?;
        let observation = |(camera, pixel): (&&PolynomialCamera, Pixel)| {
            let (predicted, slopes) = self.seen_by(camera, found.point);
            let covariance = camera.pixel_covariance(self.scaled(found.point), pixel);
            Observation { pixel, predicted, slopes, covariance, weight: 1.0 }
        };
        let observations: Vec<Observation> = cameras.iter().zip(seen).map(observation).collect();
        Located::by_least_squares(found.point, &observations)
    }

    fn pixel_sigma(&self, camera: usize, pixel: Pixel, _world: Point3) -> Option<f64> {
        Some(self.cameras.get(camera)?.noise.variance(pixel).sqrt())
    }

    fn plan(&self) -> Plan<'_> {
        self.formulas().map_or(Plan::PointByPoint, Plan::Formulas)
    }

    fn effective_parameters(&self) -> Option<f64> {
        let terms: usize = self.cameras.iter().map(|camera| camera.terms.len()).sum();
        Some(terms as f64 / self.cameras.len() as f64)
    }

    fn is_consistent(&self) -> bool {
        self.cameras.len() >= 2
            && self.pixel_sigma >= 0.0
            && self.centre.iter().all(|value| value.is_finite())
            && self.half.iter().all(|value| value.is_finite() && *value > 0.0)
            && self.cameras.iter().all(PolynomialCamera::is_consistent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{AnyReconstructor, staged::staged};
    use wheatstone_numeric::{progress::Silent, random::Random};

    #[test]
    fn there_are_soloffs_nineteen_terms_and_planes_take_depth_away() {
        assert_eq!(all_powers().len(), 19);
        let mut random = Random::new(4);
        let mut levels = |heights: &[f64]| -> Vec<u8> {
            let points: Vec<[f64; 3]> = (0..200)
                .map(|index| {
                    let height = heights[index % heights.len()];
                    [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), height]
                })
                .collect();
            let kept = determined(&points);
            (0..3).map(|z| kept.iter().filter(|powers| powers[2] == z).count() as u8).collect()
        };
        assert_eq!(levels(&[-1.0, 0.0, 0.4, 1.0]), [10, 6, 3]);
        assert_eq!(levels(&[-1.0, 0.1, 1.0]), [10, 6, 3]);
        assert_eq!(levels(&[-1.0, 1.0]), [10, 6, 0]);
        assert_eq!(levels(&[-1.0, -0.999, 1.0]), [10, 6, 0]);
    }

    #[test]
    fn slopes_agree_with_differences() {
        let fit = Soloff {}.fit(&staged(0.0), 0, &Silent).unwrap();
        let AnyReconstructor::Soloff(fitted) = fit.reconstructor else { panic!("not fitted") };
        let (at, step) = (fitted.scaled(Point3::new(6.0, -7.0, 90.0)), 1e-6);
        for camera in &fitted.cameras {
            let (_, slopes) = camera.project(at);
            for axis in 0..3 {
                let (mut ahead, mut behind) = (at, at);
                ahead[axis] += step;
                behind[axis] -= step;
                let change = camera.project(ahead).0 - camera.project(behind).0;
                assert!((change / (2.0 * step) - slopes.column(axis)).norm() < 1e-5);
            }
        }
    }
}
