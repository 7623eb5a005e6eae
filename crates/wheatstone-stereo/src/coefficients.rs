//! Numbers that were learnt.
//!
//! `bench/peers/stereo_confidence.py` learns them from rendered pairs of its own and from Middlebury's pairs, writes this file's
//! numbers, and says how well they do on pairs that it did not learn from. The last two constants were learnt by its method
//! from the evidence of its renders and of three rendered pairs of others, without learning the weights anew.

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
    constant: -0.988,
    quantities: [-0.256, 0.977, 1.167, 1.536, -0.299, -3.115, 0.482, 0.964],
    products: [
        0.364, 1.389, 1.677, 1.874, -0.396, -2.276, 0.434, -1.079, 1.686, 1.49, 1.736, -0.384,
        -1.565, 1.097, -1.158, -0.829, 0.249, -2.022, -0.743, 1.386, -3.047, -2.003, -1.781,
        -1.811, 0.74, -0.083, 0.152, 0.581, -0.767, 1.386, 0.649, -0.105, 1.806, 1.58, -1.327,
        -1.349,
    ],
};

/// The standard deviation of a refined disparity is a s (1 + b scatter), where s is what residuals tell: a, and b per pixel.
pub(crate) const REFINED: [f32; 2] = [1.061, 0.427];

/// The standard deviation of a disparity that was not refined, in pixels: without scatter, and per pixel of scatter.
pub(crate) const UNREFINED: [f32; 2] = [0.12, 0.15];
