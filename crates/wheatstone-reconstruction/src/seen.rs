//! What pairs of cameras match with pixels of the reference camera.

use crate::matches::MatchedPixel;
use nalgebra::{Matrix3, Vector3};
use wheatstone_core::geometry::Point3;

/// What the pairs match with pixels of the reference camera.
pub(crate) struct Seen {
    /// Pixels of the left rectified picture, row by row.
    pub(crate) places: Vec<u32>,
    pub(crate) reference: Vec<[f64; 2]>,
    pub(crate) confidence: Vec<f32>,
    /// How many pairs have the pixel in view and match nothing with it.
    pub(crate) missed: Vec<usize>,
    /// The standard deviation of every pixel along x and y, of the reference camera's too, where that is known. Where it
    /// is not, the reference camera's pixels say which points are meant, and matches are uncertain along their curves.
    pub(crate) pixel_sigma: Option<f64>,
    /// [pair][pixel]
    pub(crate) found: Vec<Vec<Option<Found>>>,
}

/// A pixel of another camera.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub(crate) at: MatchedPixel,
    /// Of the pair's rectified pictures, with its standard deviation, in pixels.
    pub(crate) disparity: f64,
    pub(crate) sigma: f64,
    pub(crate) confidence: f32,
    /// By how much the standard deviation is larger than that of least squares, for doubt.
    pub(crate) doubt: f64,
    /// What it means together with the reference pixel, where the pair's lattice says it.
    pub(crate) point: Option<PairPoint>,
}

/// Where a pixel and its disparity place a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PairPoint {
    pub(crate) place: Point3,
    /// By how much it moves with disparity.
    pub(crate) slope: Vector3<f64>,
    /// Its covariance by the calibration alone.
    pub(crate) calibration: Matrix3<f64>,
}

impl Seen {
    pub(crate) fn new(pairs: usize) -> Self {
        Self::with_room(pairs, 0)
    }

    /// With room for so many pixels.
    pub(crate) fn with_room(pairs: usize, pixels: usize) -> Self {
        Self {
            places: Vec::with_capacity(pixels),
            reference: Vec::with_capacity(pixels),
            confidence: Vec::with_capacity(pixels),
            missed: Vec::with_capacity(pixels),
            pixel_sigma: None,
            found: (0..pairs).map(|_| Vec::with_capacity(pixels)).collect(),
        }
    }

    /// Adds a pixel, and what each pair has; its confidence is that of the surest pair.
    pub(crate) fn push(
        &mut self,
        (place, reference): (u32, [f64; 2]),
        (found, missed): (&[Option<Found>], usize),
    ) {
        let sure = found.iter().flatten().map(|found| found.confidence).fold(0.0, f32::max);
        self.missed.push(missed);
        self.places.push(place);
        self.reference.push(reference);
        self.confidence.push(sure);
        self.found.iter_mut().zip(found).for_each(|(pair, found)| pair.push(*found));
    }

    /// Where a camera has a pixel, the reference camera first; NaN where it has none.
    pub(crate) fn pixel(&self, side: usize, index: usize) -> [f64; 2] {
        let Some(pair) = side.checked_sub(1) else { return self.reference[index] };
        self.found[pair][index].as_ref().map_or([f64::NAN; 2], |found| found.at.pixel)
    }

    /// x and y of all pixels of each camera.
    pub(crate) fn pixels(&self) -> Vec<[Vec<f64>; 2]> {
        let column = |side: usize, axis: usize| {
            (0..self.places.len()).map(|index| self.pixel(side, index)[axis]).collect()
        };
        (0..=self.found.len()).map(|side| [column(side, 0), column(side, 1)]).collect()
    }
}
