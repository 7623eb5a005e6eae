//! Plain interpolation: the world point is read off a plane through the known points whose pixels are
//! nearest, all cameras' pixels taken as one place of many coordinates. No camera model, no training.
//!
//! Source: the modified Shepard method with planes (Shepard 1968, doi:10.1145/800186.810616; Franke &
//! Nielson 1980, doi:10.1002/nme.1620151110), evaluated as moving least squares (Lancaster &
//! Salkauskas 1981, doi:10.1090/S0025-5718-1981-0616367-1). The 2001 paper names interpolation as the
//! rival that its network does without.

use super::{AnyMethod, Fit, Located, Method, Reconstructor, checks::enough, only_default};
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3},
};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// How many points speak.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Interpolation {
    /// Nearest known points used for each located one.
    pub neighbours: usize,
}

impl Default for Interpolation {
    /// Four for each coefficient of a plane over two cameras' pixels, as Franke & Nielson take for
    /// theirs.
    fn default() -> Self {
        Self { neighbours: 20 }
    }
}

/// The known points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InterpolationReconstructor {
    cameras: usize,
    neighbours: usize,
    /// x and y of all cameras, a point each.
    pixels: Vec<Vec<f64>>,
    /// World coordinates, a point each.
    world: Vec<Point3>,
}

/// The pixels of all cameras in one row; `None` where one did not see the point.
fn place(pixels: &[Option<Pixel>]) -> Option<Vec<f64>> {
    let all = pixels.iter().copied().collect::<Option<Vec<Pixel>>>()?;
    Some(all.iter().flat_map(|pixel| [pixel.x, pixel.y]).collect())
}

impl Method for Interpolation {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        progress.check()?;
        if self.neighbours == 0 {
            return Err(Error::Setting {
                setting: "neighbours".into(),
                value: "0".into(),
                need: "1 or more".into(),
            });
        }
        let usable = train.known().filter_map(|(world, row)| Some((place(&row.pixels)?, world)));
        let (pixels, world): (Vec<_>, Vec<_>) = usable.unzip();
        // A plane over so many coordinates, and one point more.
        let need = 2 * train.cameras + 2;
        enough("interpolation", None, need, pixels.len())?;
        let (cameras, neighbours) = (train.cameras, self.neighbours.max(need));
        let fitted = InterpolationReconstructor { cameras, neighbours, pixels, world };
        Ok(Fit::of(fitted))
    }

    fn summary(&self) -> &'static str {
        "world coordinates interpolated between the nearest known points; no camera model"
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        only_default(self, name)
    }
}

/// Slopes are held by this share of what the neighbours' spread holds them: pixels of one point lie
/// on three dimensions of the 2n; along the others there is only noise, whose mean square is of the
/// order of this share of the neighbours' (half a pixel in fifty).
const RIDGE: f64 = 1e-4;

impl InterpolationReconstructor {
    /// The nearest points, with their distances, nearest first; one more than the neighbours, if
    /// there is, for the radius within which a point has a say.
    fn nearest(&self, place: &[f64]) -> Vec<(f64, usize)> {
        let distance = |known: &Vec<f64>| {
            known.iter().zip(place).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        };
        let mut all: Vec<(f64, usize)> =
            self.pixels.iter().enumerate().map(|(index, known)| (distance(known), index)).collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let count = (self.neighbours + 1).min(all.len());
        if count < all.len() {
            all.select_nth_unstable_by(count - 1, order);
            all.truncate(count);
        }
        all.sort_unstable_by(order);
        all
    }
}

impl Reconstructor for InterpolationReconstructor {
    fn cameras(&self) -> usize {
        self.cameras
    }

    fn locate(&self, pixels: &[Option<Pixel>]) -> Option<Located> {
        let here = place(pixels).filter(|here| here.len() == 2 * self.cameras)?;
        let near = self.nearest(&here);
        let radius = near.last()?.0.max(f64::MIN_POSITIVE);
        let width = here.len() + 1;
        let (mut matrix, mut right) = (DMatrix::zeros(width, width), DMatrix::zeros(width, 3));
        let mut rows = Vec::with_capacity(near.len());
        for (distance, index) in &near {
            // Franke & Nielson's weight, kept finite where pixels are the same.
            let relative = (distance / radius).max(1e-3);
            let weight = ((1.0 - relative) / relative).powi(2);
            let offsets = self.pixels[*index].iter().zip(&here).map(|(known, own)| known - own);
            let row: Vec<f64> = std::iter::once(1.0).chain(offsets.map(|d| d / radius)).collect();
            let world = self.world[*index];
            for (i, value) in row.iter().enumerate() {
                row.iter().enumerate().for_each(|(j, v)| matrix[(i, j)] += weight * value * v);
                (0..3).for_each(|axis| right[(i, axis)] += weight * value * world[axis]);
            }
            rows.push((weight, row, world));
        }
        let total: f64 = rows.iter().map(|(weight, ..)| weight).sum();
        // Unequal weights are worth so many equal ones (Kish 1965); the plane follows its own points.
        let squares: f64 = rows.iter().map(|(weight, ..)| weight * weight).sum();
        let followed = width as f64 * squares / (total * total);
        let spread = (1..width).map(|i| matrix[(i, i)]).sum::<f64>() / (width - 1) as f64;
        (1..width).for_each(|i| matrix[(i, i)] += RIDGE * spread);
        let factors = matrix.cholesky()?;
        let plane = factors.solve(&right);
        // What is read off is a weighted sum of the neighbours, and errs as they do: beyond them the
        // weights grow. Among them a plane's mean error over its points is the least that is assumed.
        let mut here_alone = DVector::zeros(width);
        here_alone[0] = 1.0;
        let solved = factors.solve(&here_alone);
        let share = |(weight, row, _): &(f64, Vec<f64>, Point3)| {
            weight * row.iter().zip(solved.iter()).map(|(value, s)| value * s).sum::<f64>()
        };
        let own: f64 = rows.iter().map(|row| share(row).powi(2)).sum();
        let inflation = 1.0 + followed + own.max(followed);
        let mut scatter = Matrix3::zeros();
        for (weight, row, world) in &rows {
            let read =
                |axis: usize| row.iter().enumerate().map(|(i, v)| v * plane[(i, axis)]).sum();
            let error = world.coords - Vector3::new(read(0), read(1), read(2));
            scatter += error * error.transpose() * (weight / total);
        }
        let point = Point3::new(plane[(0, 0)], plane[(0, 1)], plane[(0, 2)]);
        let finite = point.iter().chain(scatter.iter()).all(|value| value.is_finite());
        finite.then_some(Located { point, covariance: scatter * inflation, residual: None })
    }

    fn pixel_sigma(&self, _camera: usize, _pixel: Pixel, _world: Point3) -> Option<f64> {
        None
    }

    fn is_consistent(&self) -> bool {
        let width = 2 * self.cameras;
        self.cameras >= 2
            && self.neighbours > width
            && self.pixels.len() > width
            && self.pixels.len() == self.world.len()
            && self.pixels.iter().all(|row| row.len() == width)
            && self.pixels.iter().flatten().all(|value| value.is_finite())
            && self.world.iter().all(|point| point.iter().all(|value| value.is_finite()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::{AnyReconstructor, staged::staged};
    use wheatstone_numeric::progress::Silent;

    #[test]
    fn broken_numbers_are_refused() {
        let fit = Interpolation::default().fit(&staged(0.0), 0, &Silent).unwrap();
        let AnyReconstructor::Interpolation(fitted) = fit.reconstructor else { panic!("{fit:?}") };
        assert!(fitted.is_consistent());
        let text = serde_json::to_string(&fitted).unwrap();
        assert_eq!(serde_json::from_str::<InterpolationReconstructor>(&text).unwrap(), fitted);
        let odd = text.replacen('{', "{\"other\": 1,", 1);
        assert!(serde_json::from_str::<InterpolationReconstructor>(&odd).is_err());
        let mut broken = fitted.clone();
        broken.world.pop();
        assert!(!broken.is_consistent());
        let mut broken = fitted.clone();
        broken.pixels[3][1] = f64::NAN;
        assert!(!broken.is_consistent());
    }
}
