//! What pairs of cameras match with pixels of the reference camera.

use crate::matches::MatchedPixel;
use wheatstone_stereo::DisparityMap;

/// What the pairs match with pixels of the reference camera.
pub(crate) struct Seen {
    /// Pixels of the left rectified picture, row by row.
    pub(crate) places: Vec<u32>,
    pub(crate) reference: Vec<[f64; 2]>,
    pub(crate) confidence: Vec<f32>,
    /// How many pairs have the pixel in view and match nothing with it.
    pub(crate) missed: Vec<usize>,
    /// [pair][pixel]
    pub(crate) found: Vec<Vec<Option<Found>>>,
}

/// A pixel of another camera.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub(crate) at: MatchedPixel,
    pub(crate) confidence: f32,
}

impl Seen {
    pub(crate) fn new(pairs: usize) -> Self {
        let found = vec![Vec::new(); pairs];
        let (places, reference) = (Vec::new(), Vec::new());
        Self { places, reference, confidence: Vec::new(), missed: Vec::new(), found }
    }

    pub(crate) fn push(
        &mut self,
        (place, reference, confidence): (u32, [f64; 2], f32),
        found: &[Option<Found>],
    ) {
        self.places.push(place);
        self.reference.push(reference);
        self.confidence.push(confidence);
        self.found.iter_mut().zip(found).for_each(|(pair, found)| pair.push(*found));
    }
}

/// What a map has at a place.
pub(crate) struct Read {
    pub(crate) disparity: f64,
    pub(crate) sigma: f64,
    pub(crate) confidence: f32,
}

/// What a map has between pixels; `None` where it has nothing on one of them, or two surfaces.
pub(crate) fn read(map: &DisparityMap, (x, y): (f64, f64)) -> Option<Read> {
    /// Pixels of one surface differ by less, in pixels.
    const STEP: f32 = 1.0;
    let (column, row) = (x.floor(), y.floor());
    let (along, down) = (x - column, y - row);
    let mut read = Read { disparity: 0.0, sigma: 0.0, confidence: 1.0 };
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for (dy, share) in [(0, 1.0 - down), (1, down)] {
        for (dx, part) in [(0, 1.0 - along), (1, along)] {
            let weight = share * part;
            if weight == 0.0 {
                continue;
            }
            let (x, y) = (column as i64 + dx, row as i64 + dy);
            let inside = (0..map.width as i64).contains(&x) && (0..map.height as i64).contains(&y);
            let at = inside.then(|| y as usize * map.width + x as usize)?;
            let disparity = map.disparity[at];
            (least, most) = (least.min(disparity), most.max(disparity));
            read.disparity += weight * f64::from(disparity);
            read.sigma = read.sigma.max(f64::from(map.sigma[at]));
            read.confidence = read.confidence.min(map.confidence[at]);
        }
    }
    let is_one = most - least <= STEP && read.disparity.is_finite() && read.sigma.is_finite();
    (is_one && read.confidence > 0.0).then_some(read)
}
