//! How vertical offsets vary over a picture.
//!
//! A camera that was turned about its axis shows things higher on one side and lower on the other, one that was moved ahead
//! shows them farther from the middle, and one that was turned sideways does so at the corners. A constant, slopes along
//! and down the picture, and the product of both tell all three; they are found by consensus of random samples (Fischler &
//! Bolles 1981, doi:10.1145/358669.358692).

use wheatstone_numeric::{least_squares::solve, random::Random};

/// The constant, the two slopes, and the product.
pub(crate) const TERMS: usize = 4;
/// Fewer corners tell the constant alone: a wrong one among them would bend the pattern.
const LEAST_CORNERS: usize = 24;
/// Of matches two fifths of which are wrong, one sample in eight is right.
const SAMPLES: usize = 200;
/// Fits to the corners that agree: the corners hardly change after the second.
const ROUNDS: usize = 3;

/// A corner that agrees with the pattern, in pixels.
pub(crate) struct Agreeing {
    /// Which of the corners it is.
    pub(crate) index: usize,
    /// What the pattern says of it.
    pub(crate) told: f64,
    /// What its own offset is beyond that.
    pub(crate) residual: f64,
}

/// Vertical offsets of corners of a picture.
pub(crate) struct Offsets {
    /// The terms at each corner, [`TERMS`] a corner, without unit: -1 and 1 are the picture's borders.
    terms: Vec<f64>,
    /// In pixels.
    offsets: Vec<f64>,
}

impl Offsets {
    /// Of corners at x, y with their offsets, in a picture of this width and height.
    pub(crate) fn new(corners: &[([f64; 2], f64)], size: [usize; 2]) -> Self {
        let of_corner = |([x, y], _): &([f64; 2], f64)| {
            let [u, v] =
                [(x, size[0]), (y, size[1])].map(|(at, side)| 2.0 * at / side as f64 - 1.0);
            [1.0, u, v, u * v]
        };
        Self {
            terms: corners.iter().flat_map(of_corner).collect(),
            offsets: corners.iter().map(|corner| corner.1).collect(),
        }
    }

    /// The corners that agree with the pattern that most of them agree with.
    pub(crate) fn agreed(&self, most_difference: f64) -> Vec<Agreeing> {
        let near = |pattern: &[f64]| -> Vec<usize> {
            let is_near = |index: &usize| {
                (self.told(pattern, *index) - self.offsets[*index]).abs() < most_difference
            };
            (0..self.offsets.len()).filter(is_near).collect()
        };
        let mut sorted = self.offsets.clone();
        sorted.sort_by(f64::total_cmp);
        let Some(median) = sorted.get(sorted.len() / 2) else { return Vec::new() };
        let mut pattern = vec![*median, 0.0, 0.0, 0.0];
        let mut agreeing = near(&pattern);
        let mut random = Random::new(1);
        let [samples, rounds] =
            if self.offsets.len() < LEAST_CORNERS { [0, 0] } else { [SAMPLES, ROUNDS] };
        for _ in 0..samples {
            let sample = [(); TERMS].map(|()| random.below(self.offsets.len()));
            let Some(other) = self.fitted(&sample) else { continue };
            let others = near(&other);
            if others.len() > agreeing.len() {
                (pattern, agreeing) = (other, others);
            }
        }
        for _ in 0..rounds {
            let Some(better) = self.fitted(&agreeing) else { break };
            agreeing = near(&better);
            pattern = better;
        }
        let agreeing = agreeing.into_iter().map(|index| {
            let told = self.told(&pattern, index);
            Agreeing { index, told, residual: self.offsets[index] - told }
        });
        agreeing.collect()
    }

    fn terms(&self, index: usize) -> &[f64] {
        &self.terms[index * TERMS..][..TERMS]
    }

    fn told(&self, pattern: &[f64], index: usize) -> f64 {
        self.terms(index).iter().zip(pattern).map(|(term, factor)| term * factor).sum()
    }

    /// The pattern of some corners; `None` where they do not tell all terms.
    fn fitted(&self, corners: &[usize]) -> Option<Vec<f64>> {
        let terms: Vec<f64> =
            corners.iter().flat_map(|index| self.terms(*index)).copied().collect();
        let offsets: Vec<f64> = corners.iter().map(|index| self.offsets[*index]).collect();
        Some(solve(&terms, TERMS, &offsets, 1)?.as_slice().to_vec())
    }
}
