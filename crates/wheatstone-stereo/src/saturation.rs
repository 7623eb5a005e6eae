//! Where pictures are saturated: pixels at the top of the range have neither texture nor noise.
//!
//! Residuals of a window are then smaller than its noise, by the share of its pixels that have any.

use crate::{map::DisparityMap, picture::Picture, window::RADIUS};
use rayon::prelude::*;

/// The level of a saturated pixel.
const TOP: u8 = u8::MAX;
/// Windows of which more is saturated in either picture say nothing.
const MOST: f32 = 0.5;

/// Takes the confidence of matches whose windows are mostly saturated, and makes up for residuals that others do not have.
pub(crate) fn doubt(map: &mut DisparityMap, pictures: [&Picture<'_>; 2]) {
    if !pictures.iter().any(|picture| picture.pixels().contains(&TOP)) {
        return;
    }
    let [left, right] = pictures.map(Saturated::of);
    let width = map.width;
    let rows = map.confidence.par_chunks_mut(width).zip(map.sigma.par_chunks_mut(width));
    let rows = rows.zip(map.disparity.par_chunks(width)).enumerate();
    rows.for_each(|(y, ((confidence, sigma), disparity))| {
        for x in (0..width).filter(|x| disparity[*x].is_finite()) {
            let there = (x as f32 - disparity[x]).round().max(0.0) as usize;
            let share = left.share(x, y).max(right.share(there, y));
            if share > MOST {
                (confidence[x], sigma[x]) = (0.0, f32::NAN);
            }
            sigma[x] /= (1.0 - share).sqrt();
        }
    });
}

/// Saturated pixels above and to the left of each.
struct Saturated {
    width: usize,
    height: usize,
    counts: Vec<u32>,
}

impl Saturated {
    fn of(picture: &Picture<'_>) -> Self {
        let (width, height) = (picture.width(), picture.height());
        let mut counts = vec![0; (width + 1) * (height + 1)];
        for y in 0..height {
            let (above, own) = counts[y * (width + 1)..].split_at_mut(width + 1);
            let mut along = 0;
            for (x, level) in picture.row(y).iter().enumerate() {
                along += u32::from(*level == TOP);
                own[x + 1] = above[x + 1] + along;
            }
        }
        Self { width, height, counts }
    }

    /// The share of the window about a pixel.
    fn share(&self, x: usize, y: usize) -> f32 {
        let ends = |at: usize, side: usize| {
            let from = at.saturating_sub(RADIUS).min(side - 1);
            (from, (at + RADIUS + 1).min(side))
        };
        let ((left, right), (top, bottom)) = (ends(x, self.width), ends(y, self.height));
        let count = |x: usize, y: usize| self.counts[y * (self.width + 1) + x];
        let inside =
            count(right, bottom) + count(left, top) - count(left, bottom) - count(right, top);
        inside as f32 / ((right - left) * (bottom - top)) as f32
    }
}
