//! Numbers that were learnt.
//!
//! `bench/peers/stereo_confidence.py` learns them from rendered pairs of its own and from Middlebury's pairs, and says how
//! well they do on pairs that it did not learn from.

/// Terms of the confidence: see [`confidence`](crate::confidence).
pub(crate) const TERMS: usize = 11;

/// Weights of the terms in the logarithm of the odds that a disparity is less than one pixel off.
pub(crate) const CONFIDENCE: [f32; TERMS] =
    [-4.0, 2.0, 2.0, -1.0, -3.0, -2.0, 2.0, 2.0, 1.0, 1.0, 1.0];

/// What the standard deviation of a refined disparity is made of: the factor of what residuals tell, and what comes on top in
/// any case, in pixels, as a square root of the sum of squares; and by how much scatter stretches both, per pixel.
pub(crate) const REFINED: [f32; 3] = [1.0, 0.03, 0.5];

/// The standard deviation of a disparity that was not refined, in pixels: without scatter, and per pixel of scatter.
pub(crate) const UNREFINED: [f32; 2] = [0.2, 0.5];
