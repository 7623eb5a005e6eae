//! Matched pixels to points in the world, with the covariance of the match and of the calibration.
//!
//! A model's own covariance is that of pixels as its chart points had them. Here the left pixel is given (it says which
//! point is meant), and the right one is known along its epipolar line as well as the matcher says. So the part of the
//! covariance that comes from chart points' pixels is taken out, and the matcher's put in: first order, by the
//! derivatives of the map itself.

use crate::matches::Matches;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use wheatstone_core::{
    Calibration,
    dataset::volume::Trust,
    geometry::{Pixel, PixelColumns, Point3},
    method::{LocatedBatch, Locator, SettledLocator},
};

/// Points that are worked out together: their figures stay in little memory.
const BLOCK: usize = 1 << 16;

/// The step of derivatives, in pixels: small against a lens, large against rounding.
const STEP: f64 = 0.125;

/// A located point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) place: Point3,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) trust: Trust,
}

/// Two cameras of a model, made ready for many points.
pub(crate) struct PointEstimator<'a> {
    model: &'a Calibration,
    cameras: [usize; 2],
    full: SettledLocator<'a>,
    points: SettledLocator<'a>,
}

impl<'a> PointEstimator<'a> {
    /// For points like those that `shown` holds: what it says of a point depends on nothing else.
    pub(crate) fn new(model: &'a Calibration, cameras: [usize; 2], shown: &Matches) -> Self {
        let locator = || Locator::new(&*model.reconstructor, Some(&model.volume));
        let nothing = vec![f64::NAN; shown.len()];
        let columns = columns(model, cameras, [&shown.left, &shown.right], &nothing);
        // How well pixels of charts agree says nothing of a match.
        let full = locator().with_uncertainty(None, model.stage_covariance.as_ref());
        let points = Locator::new(&*model.reconstructor, None).points_only();
        Self { model, cameras, full: full.settled(&columns), points: points.settled(&columns) }
    }

    /// Locates matches whose disparities have these standard deviations, in pixels; `None` for a match that means no
    /// point.
    pub(crate) fn locate(&self, matches: &Matches, sigma: &[f32]) -> Vec<Option<Point>> {
        let mut found = Vec::with_capacity(matches.len());
        for start in (0..matches.len()).step_by(BLOCK) {
            let end = matches.len().min(start + BLOCK);
            let part = |column: &Vec<f64>| column[start..end].to_vec();
            let block = Matches {
                left: matches.left.each_ref().map(part),
                right: matches.right.each_ref().map(part),
                along: matches.along.each_ref().map(part),
            };
            found.extend(self.block(&block, &sigma[start..end]));
        }
        found
    }

    fn block(&self, matches: &Matches, sigma: &[f32]) -> Vec<Option<Point>> {
        let nothing = vec![f64::NAN; matches.len()];
        let (left, right) = (&matches.left, &matches.right);
        let located = self.full.locate(&columns(self.model, self.cameras, [left, right], &nothing));
        let moved = |side: usize, axis: usize| {
            let mut sides = [left.clone(), right.clone()];
            sides[side][axis].iter_mut().for_each(|value| *value += STEP);
            let sides = [&sides[0], &sides[1]];
            self.points.locate(&columns(self.model, self.cameras, sides, &nothing))
        };
        let moved = [[moved(0, 0), moved(0, 1)], [moved(1, 0), moved(1, 1)]];
        let each = (0..matches.len()).into_par_iter();
        each.map(|index| self.point(matches, f64::from(sigma[index]), index, (&located, &moved)))
            .collect()
    }

    fn point(
        &self,
        matches: &Matches,
        sigma: f64,
        index: usize,
        (located, moved): (&LocatedBatch, &[[LocatedBatch; 2]; 2]),
    ) -> Option<Point> {
        let found = located.get(index)?;
        let slope = |side: usize, axis: usize| {
            let to = moved[side][axis].point.each_ref().map(|column| column[index]);
            (Vector3::from(to) - found.point.coords) / STEP
        };
        let mut covariance = found.covariance;
        for (side, pixels) in [&matches.left, &matches.right].into_iter().enumerate() {
            let pixel = Pixel::new(pixels[0][index], pixels[1][index]);
            let own = self.model.reconstructor.pixel_sigma(self.cameras[side], pixel, found.point);
            let variance = own.map_or(0.0, |own| own * own);
            for axis in 0..2 {
                let slope = slope(side, axis);
                covariance -= slope * slope.transpose() * variance;
            }
        }
        // What is left is the calibration's; of numbers that nearly cancel it may be off a little.
        for axis in 0..3 {
            covariance[(axis, axis)] = covariance[(axis, axis)].max(0.0);
        }
        let [x, y] = matches.along.each_ref().map(|column| column[index]);
        let by_disparity = slope(1, 0) * x + slope(1, 1) * y;
        covariance += by_disparity * by_disparity.transpose() * (sigma * sigma);
        let trust = located.trust.get(index).copied().unwrap_or(Trust::Outside);
        let finite = covariance.iter().all(|value| value.is_finite());
        finite.then_some(Point { place: found.point, covariance, trust })
    }
}

/// Pixels of two cameras as columns of all of the model's; `nothing` for the others.
fn columns<'c>(
    model: &Calibration,
    cameras: [usize; 2],
    sides: [&'c [Vec<f64>; 2]; 2],
    nothing: &'c [f64],
) -> PixelColumns<'c> {
    let of = |camera: usize| {
        let side = cameras.iter().position(|own| *own == camera);
        side.map_or([nothing; 2], |side| sides[side].each_ref().map(Vec::as_slice))
    };
    PixelColumns::new((0..model.reconstructor.cameras()).map(of).collect())
}
