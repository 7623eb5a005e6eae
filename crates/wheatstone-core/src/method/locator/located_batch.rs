//! Located points in columns, and the parts of those that a task fills.

use super::{
    super::{CovarianceScale, Located, PointNoise, Residual},
    piece::TASK,
};
use crate::{
    dataset::volume::Trust,
    geometry::{PixelColumns, StageCovariance},
};
use nalgebra::Matrix3;
use std::ops::Range;

/// Located points, column by column: row `i` of every column belongs to row `i` of the pixels. NaN stands
/// where a point was not located, and for figures that do not exist.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LocatedBatch {
    /// X, Y and Z in the world frame, in world units.
    pub point: [Vec<f64>; 3],
    /// Covariance XX, XY, XZ, YY, YZ, ZZ, in squared world units; empty after [`super::Locator::points_only`].
    pub covariance: [Vec<f64>; 6],
    /// Reprojection error: root mean square over the pixel coordinates of the point, in pixels. Empty where
    /// the covariance is.
    pub residual: Vec<f64>,
    /// The standard deviation in pixels that noise and the uncertainty of the fit let expect of one pixel
    /// coordinate in it; empty where the covariance is.
    pub residual_sigma: Vec<f64>,
    /// Whether the pixels show what the fit was shown; empty where no volume was given.
    pub trust: Vec<Trust>,
}

/// Where the figures of some points go.
pub(super) struct Slots<'p> {
    pub(super) point: [&'p mut [f64]; 3],
    pub(super) covariance: [&'p mut [f64]; 6],
    pub(super) residual: &'p mut [f64],
    pub(super) residual_sigma: &'p mut [f64],
    pub(super) trust: &'p mut [Trust],
}

/// Where the six numbers of a covariance stand in it.
pub(super) const LOWER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Slots<'_> {
    /// Whether more than places is asked for.
    pub(super) fn has_covariance(&self) -> bool {
        !self.covariance[0].is_empty()
    }

    /// What is said of a point; `None` where it was not located.
    pub(super) fn get(&self, index: usize) -> Option<Located> {
        let point = self.point.each_ref().map(|column| column[index]);
        let [xx, xy, xz, yy, yz, zz] = self.covariance.each_ref().map(|column| column[index]);
        let residual = Residual { rms: self.residual[index], sigma: self.residual_sigma[index] };
        point[0].is_finite().then(|| Located {
            point: point.into(),
            covariance: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
            residual: residual.rms.is_finite().then_some(residual),
        })
    }

    /// Puts what the map said of a point; `keeps_place` where it is already known where the point is, so that it is at the
    /// same place with and without error bars.
    pub(super) fn put(&mut self, index: usize, found: Option<&Located>, keeps_place: bool) {
        let none = Located {
            point: [f64::NAN; 3].into(),
            covariance: Matrix3::repeat(f64::NAN),
            residual: None,
        };
        let found = found.unwrap_or(&none);
        if !(keeps_place && found.point.x.is_finite()) {
            for (axis, column) in self.point.iter_mut().enumerate() {
                column[index] = found.point[axis];
            }
        }
        if self.residual.is_empty() {
            return;
        }
        for (place, column) in LOWER.into_iter().zip(&mut self.covariance) {
            column[index] = found.covariance[place];
        }
        let told = found.residual.map_or([f64::NAN; 2], |Residual { rms, sigma }| [rms, sigma]);
        [self.residual[index], self.residual_sigma[index]] = told;
    }
}

impl Slots<'_> {
    /// Scales covariances by what each point's misfit lets expect of its noise.
    pub(super) fn scale(&mut self, noise: PointNoise, pixels: &PixelColumns) {
        for index in 0..self.residual.len() {
            let residual =
                Residual { rms: self.residual[index], sigma: self.residual_sigma[index] };
            let seen = pixels.point(index).flatten().count();
            if let Some(misfit) = residual.misfit(seen) {
                let scale = noise.scale(misfit);
                self.covariance.iter_mut().for_each(|column| column[index] *= scale);
            }
        }
    }

    /// Scales covariances where a camera model does not hold.
    pub(super) fn rescale(&mut self, scale: CovarianceScale) {
        for index in 0..self.point[0].len() {
            let [xx, xy, xz, yy, yz, zz] = self.covariance.each_ref().map(|column| column[index]);
            let scaled = scale.of(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
            for (place, column) in LOWER.into_iter().zip(&mut self.covariance) {
                column[index] = scaled[place];
            }
        }
    }

    /// Adds what is uncertain of charts' places.
    pub(super) fn widen(&mut self, stage: &StageCovariance) {
        for index in 0..self.point[0].len() {
            let more = stage.at([0, 1, 2].map(|axis: usize| self.point[axis][index]).into());
            for (place, column) in LOWER.into_iter().zip(&mut self.covariance) {
                column[index] += more[place];
            }
        }
    }
}

impl LocatedBatch {
    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.point[0].len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many points were located.
    #[must_use]
    pub fn located(&self) -> usize {
        self.point[0].iter().filter(|x| !x.is_nan()).count()
    }

    /// The standard deviations of X, Y and Z, in world units; empty where the covariance is.
    #[must_use]
    pub fn sigma(&self) -> [Vec<f64>; 3] {
        let root =
            |variances: &Vec<f64>| variances.iter().map(|variance| variance.sqrt()).collect();
        [0, 3, 5].map(|place| root(&self.covariance[place]))
    }

    /// One row; `None` where the point was not located, or covariances were not asked for.
    #[must_use]
    pub fn get(&self, row: usize) -> Option<Located> {
        let x = self.point[0].get(row).copied().filter(|x| !x.is_nan())?;
        let mut covariance = Matrix3::zeros();
        for ((a, b), values) in LOWER.into_iter().zip(&self.covariance) {
            let value = *values.get(row)?;
            (covariance[(a, b)], covariance[(b, a)]) = (value, value);
        }
        let residual =
            Residual { rms: *self.residual.get(row)?, sigma: *self.residual_sigma.get(row)? };
        Some(Located {
            point: [x, self.point[1][row], self.point[2][row]].into(),
            covariance,
            residual: residual.rms.is_finite().then_some(residual),
        })
    }

    /// Adds the rows of another behind its own.
    pub(super) fn append(&mut self, other: &Self) {
        let add = |own: &mut [Vec<f64>], others: &[Vec<f64>]| {
            own.iter_mut().zip(others).for_each(|(own, other)| own.extend_from_slice(other));
        };
        add(&mut self.point, &other.point);
        add(&mut self.covariance, &other.covariance);
        self.residual.extend_from_slice(&other.residual);
        self.residual_sigma.extend_from_slice(&other.residual_sigma);
        self.trust.extend_from_slice(&other.trust);
    }

    /// Makes room for so many points; what is in it is anything.
    pub(super) fn resize(&mut self, count: usize, with_covariance: bool, with_trust: bool) {
        let figures = if with_covariance { count } else { 0 };
        self.point.iter_mut().for_each(|column| column.resize(count, 0.0));
        self.covariance.iter_mut().for_each(|column| column.resize(figures, 0.0));
        self.residual.resize(figures, 0.0);
        self.residual_sigma.resize(figures, 0.0);
        self.trust.resize(if with_trust { count } else { 0 }, Trust::Outside);
    }

    /// Tasks after `done` points, and where each puts its figures.
    pub(super) fn tasks(&mut self, done: usize) -> Vec<(Range<usize>, Slots<'_>)> {
        fn next<'p, T>(left: &mut &'p mut [T], length: usize) -> &'p mut [T] {
            let length = length.min(left.len());
            let (own, others) = std::mem::take(left).split_at_mut(length);
            *left = others;
            own
        }
        let count = self.point[0].len();
        let mut point = self.point.each_mut().map(Vec::as_mut_slice);
        let mut covariance = self.covariance.each_mut().map(Vec::as_mut_slice);
        let (mut residual, mut sigma) = (&mut self.residual[..], &mut self.residual_sigma[..]);
        let mut trust = &mut self.trust[..];
        let (mut tasks, mut start) = (Vec::new(), 0);
        while start < count {
            let length = (TASK - (done + start) % TASK).min(count - start);
            let slots = Slots {
                point: point.each_mut().map(|column| next(column, length)),
                covariance: covariance.each_mut().map(|column| next(column, length)),
                residual: next(&mut residual, length),
                residual_sigma: next(&mut sigma, length),
                trust: next(&mut trust, length),
            };
            tasks.push((start..start + length, slots));
            start += length;
        }
        tasks
    }
}
