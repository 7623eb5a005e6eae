//! World points with their pixels in one camera.

use crate::geometry::{Pixel, Point3};

/// A world point and where the camera saw it.
pub(super) type Pair = (Point3, Pixel);

/// The sides of the box round the pixels.
pub(super) fn sides(pairs: &[Pair]) -> [f64; 2] {
    [0, 1].map(|axis: usize| {
        let values = || pairs.iter().map(|(_, pixel)| pixel[axis]);
        let low = values().fold(f64::INFINITY, f64::min);
        values().fold(0.0, |side, value| f64::max(side, value - low))
    })
}

/// The larger of them.
pub(super) fn extent(pairs: &[Pair]) -> f64 {
    sides(pairs).into_iter().fold(0.0, f64::max)
}

/// At most so many pairs, spread evenly.
pub(super) fn thinned(pairs: &[Pair], most: usize) -> Vec<Pair> {
    if pairs.len() <= most {
        return pairs.to_vec();
    }
    (0..most).map(|index| pairs[index * pairs.len() / most]).collect()
}
