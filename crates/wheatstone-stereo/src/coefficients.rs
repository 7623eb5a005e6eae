//! Numbers that were learnt.
//!
//! `bench/peers/stereo_confidence.py` learns them from rendered pairs of its own and from Middlebury's pairs, writes this file's
//! numbers, and says how well they do on pairs that it did not learn from.

/// Quantities that the confidence is computed from: see [`confidence`](crate::confidence).
pub(crate) const QUANTITIES: usize = 8;

/// Weights in the logarithm of the odds that a disparity is less than one pixel off.
pub(crate) struct Weights {
    pub(crate) constant: f32,
    pub(crate) quantities: [f32; QUANTITIES],
    /// Of products, in the order of the first factor and then of the second, which is the same or stands behind.
    pub(crate) products: [f32; QUANTITIES * (QUANTITIES + 1) / 2],
}

/// Of gap, gap, lead, left-right residual, scatter, unknown share, correlation and texture.
pub(crate) const CONFIDENCE: Weights = Weights {
    constant: -0.5,
    quantities: [0.0; QUANTITIES],
    products: [0.0; QUANTITIES * (QUANTITIES + 1) / 2],
};

/// The standard deviation of a refined disparity, in pixels, is sqrt((a s)^2 + b^2) (1 + c scatter) + d (1 - confidence), where s is what
/// residuals tell: a, b, c and d.
pub(crate) const REFINED: [f32; 4] = [1.0, 0.02, 0.5, 0.0];

/// The standard deviation of a disparity that was not refined, in pixels: without scatter, and per pixel of scatter.
pub(crate) const UNREFINED: [f32; 2] = [0.0834, 0.2674];
