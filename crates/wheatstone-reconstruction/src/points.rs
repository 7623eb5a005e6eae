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
    method::{LocatedBatch, Locator, PIXEL_STEP, PixelShare, SettledLocator, without_pixel_noise},
};

/// A located point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) place: Point3,
    pub(crate) covariance: Matrix3<f64>,
    pub(crate) trust: Trust,
}

/// Cameras of a model, made ready for many points.
pub(crate) struct PointEstimator<'a> {
    model: &'a Calibration,
    full: SettledLocator<'a>,
    points: SettledLocator<'a>,
}

impl<'a> PointEstimator<'a> {
    /// For points like those that `shown` holds: what it says of a point depends on nothing else.
    pub(crate) fn new(model: &'a Calibration, shown: &Matches) -> Self {
        let locator = || Locator::new(&*model.reconstructor, Some(&model.volume));
        let nothing = vec![f64::NAN; shown.len()];
        let columns = columns(model, &shown.cameras, &shown.pixels, &nothing);
        // How well pixels of charts agree says nothing of a match.
        let full = locator().with_uncertainty(None, None, model.stage_covariance.as_ref());
        let points = Locator::new(&*model.reconstructor, None).points_only();
        Self { model, full: full.settled(&columns), points: points.settled(&columns) }
    }

    /// Where points are that these pixels of cameras show; NaN for pixels that mean no point.
    pub(crate) fn places(&self, cameras: &[usize], pixels: &[[Vec<f64>; 2]]) -> [Vec<f64>; 3] {
        let nothing = vec![f64::NAN; pixels[0][0].len()];
        self.points.locate(&columns(self.model, cameras, pixels, &nothing)).point
    }

    /// Locates matches; `None` for a match that means no point.
    pub(crate) fn locate(&self, matches: &Matches) -> Vec<Option<Point>> {
        let nothing = vec![f64::NAN; matches.len()];
        let pixels = columns(self.model, &matches.cameras, &matches.pixels, &nothing);
        let located = self.full.locate(&pixels);
        let moved = |side: usize, axis: usize| {
            let mut pixels = matches.pixels.clone();
            pixels[side][axis].iter_mut().for_each(|value| *value += PIXEL_STEP);
            self.places(&matches.cameras, &pixels)
        };
        let sides = 0..matches.cameras.len();
        let moved: Vec<_> = sides.map(|side| [moved(side, 0), moved(side, 1)]).collect();
        let each = (0..matches.len()).into_par_iter();
        each.map(|index| self.point(matches, index, (&located, &moved))).collect()
    }

    /// Whether these pixels of cameras show what the calibration was shown.
    pub(crate) fn trust(&self, cameras: &[usize], pixels: &[[Vec<f64>; 2]]) -> Vec<Trust> {
        /// So many points at a time.
        const PART: usize = 4096;
        let count = pixels[0][0].len();
        let nothing = vec![f64::NAN; count];
        let columns = columns(self.model, cameras, pixels, &nothing);
        let parts: Vec<_> = (0..count).step_by(PART).collect();
        let of_part = |first: &usize| {
            let part = *first..count.min(first + PART);
            self.model.volume.trust_columns(&columns.part(part))
        };
        parts.par_iter().flat_map(of_part).collect()
    }

    fn point(
        &self,
        matches: &Matches,
        index: usize,
        (located, moved): (&LocatedBatch, &[[[Vec<f64>; 3]; 2]]),
    ) -> Option<Point> {
        let found = located.get(index)?;
        let (mut slopes_of, mut shares) = (Vec::with_capacity(matches.cameras.len()), Vec::new());
        for (side, camera) in matches.cameras.iter().enumerate() {
            let [x, y] = matches.pixel(side, index);
            if x.is_nan() {
                continue;
            }
            let own = self.model.reconstructor.pixel_sigma(*camera, Pixel::new(x, y), found.point);
            let variance = own.map_or(0.0, |own| own * own);
            let slopes = moved[side].each_ref().map(|to| {
                let to = to.each_ref().map(|column| column[index]);
                (Vector3::from(to) - found.point.coords) / PIXEL_STEP
            });
            shares.extend(slopes.map(|slope| PixelShare { slope, variance }));
            slopes_of.push((side, slopes));
        }
        let mut covariance = without_pixel_noise(found.covariance, &shares);
        covariance += match matches.pixel_sigma {
            Some(sigma) => {
                let slopes = slopes_of.iter().flat_map(|(_, slopes)| slopes);
                slopes.map(|slope| slope * slope.transpose() * (sigma * sigma)).sum()
            }
            None => by_matches(matches, index, &slopes_of),
        };
        let trust = located.trust.get(index).copied().unwrap_or(Trust::Outside);
        let finite = covariance.iter().all(|value| value.is_finite());
        finite.then_some(Point { place: found.point, covariance, trust })
    }
}

/// The covariance of a point by its matches; `slopes` are by how much it moves with x and y of the cameras that see it,
/// the reference first.
///
/// One match is off by its standard deviation. Of several, half of the variance is noise of the reference camera's
/// picture, which they share: it moves all of them as another reference pixel would.
fn by_matches(
    matches: &Matches,
    index: usize,
    slopes: &[(usize, [Vector3<f64>; 2])],
) -> Matrix3<f64> {
    let (mut own, mut shared) = (Matrix3::zeros(), [Vector3::zeros(); 2]);
    let others = slopes.iter().skip(1);
    for (side, slopes) in others.clone() {
        let of = |columns: &[[Vec<f64>; 2]]| columns[*side].each_ref().map(|column| column[index]);
        let ([x, y], direction) = (of(&matches.deviations), of(&matches.directions));
        let off = slopes[0] * x + slopes[1] * y;
        own += off * off.transpose();
        shared.iter_mut().zip(direction).for_each(|(sum, part)| *sum += off * part);
    }
    if others.len() == 1 {
        return own;
    }
    let shared: Matrix3<f64> = shared.iter().map(|sum| sum * sum.transpose()).sum();
    0.5 * (own + shared)
}

/// Pixels of some cameras as columns of all of the model's; `nothing` for the others.
fn columns<'c>(
    model: &Calibration,
    cameras: &[usize],
    pixels: &'c [[Vec<f64>; 2]],
    nothing: &'c [f64],
) -> PixelColumns<'c> {
    let of = |camera: usize| {
        let side = cameras.iter().position(|own| *own == camera);
        side.map_or([nothing; 2], |side| pixels[side].each_ref().map(Vec::as_slice))
    };
    PixelColumns::new((0..model.reconstructor.cameras()).map(of).collect())
}
