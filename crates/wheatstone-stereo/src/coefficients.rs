//! Numbers that were learnt.
//!
//! `bench/peers/stereo_confidence.py` learns them from rendered pairs of its own and from Middlebury's pairs, writes this file's
//! numbers, and says how well they do on pairs that it did not learn from. The two constants of standard deviations were learnt by its method
//! from the evidence of its renders and of three rendered pairs of others, without learning the weights anew.

/// Quantities that the confidence is computed from: see [`confidence`](crate::confidence).
pub(crate) const QUANTITIES: usize = 11;

/// A hidden unit of the network.
pub(crate) struct Unit {
    pub(crate) constant: f32,
    /// Of the quantities, in their order.
    pub(crate) weights: [f32; QUANTITIES],
    /// Of the unit, in the logarithm of the odds.
    pub(crate) out: f32,
}

/// A network for the logarithm of the odds that a disparity is less than one pixel off.
pub(crate) struct Network {
    pub(crate) constant: f32,
    pub(crate) hidden: [Unit; 16],
}

pub(crate) const CONFIDENCE: Network = Network {
    constant: 0.2861,
    hidden: [
        Unit {
            constant: -4.421,
            weights: [
                0.4579, -2.998, 1.069, -0.5898, -0.9419, 1.027, -0.6809, 1.799, 1.699, 0.6132,
                1.987,
            ],
            out: -0.8969,
        },
        Unit {
            constant: 3.174,
            weights: [
                -0.1216, 0.3714, 1.447, -2.799, -0.7601, 1.073, -3.851, -2.415, 0.7911, -3.033,
                1.259,
            ],
            out: 1.009,
        },
        Unit {
            constant: -9.974,
            weights: [
                7.353, 0.3961, -0.1286, 0.7464, 1.97, -0.6376, -0.5285, 1.967, 1.565, -4.018, 3.145,
            ],
            out: 1.115,
        },
        Unit {
            constant: -8.519,
            weights: [
                6.718, 2.267, -0.09388, -3.854, 0.06688, -0.2454, -2.065, 4.524, -2.493, 2.989,
                3.339,
            ],
            out: 0.9467,
        },
        Unit {
            constant: -2.217,
            weights: [
                0.105, 1.131, 1.225, 3.874, -1.146, 0.5044, 1.995, -2.183, -0.6169, 0.7181, 1.878,
            ],
            out: -0.5022,
        },
        Unit {
            constant: 4.526,
            weights: [
                0.6238, 1.008, -0.03148, -0.6939, -0.312, -2.913, -1.05, -3.005, 0.3385, 1.19,
                -0.5825,
            ],
            out: -0.6019,
        },
        Unit {
            constant: -0.3356,
            weights: [
                -0.613, 0.4414, 5.722, 1.593, 0.8191, -0.6581, -0.4293, 3.218, -0.01975, -1.832,
                -2.566,
            ],
            out: -0.721,
        },
        Unit {
            constant: -7.158,
            weights: [
                4.532, 1.499, 1.444, -1.92, 0.3438, 0.3973, 6.442, 0.09088, 0.009602, -1.316,
                -0.6998,
            ],
            out: -0.9669,
        },
        Unit {
            constant: 0.02746,
            weights: [
                0.7289, -0.4047, -7.36, -0.07307, 0.6074, -0.4493, -1.313, 1.562, -0.008545,
                -1.648, 1.522,
            ],
            out: -0.3804,
        },
        Unit {
            constant: -3.181,
            weights: [
                2.845, 1.104, -0.687, -3.921, -0.1453, 0.7876, 1.346, -0.8057, 2.324, -1.343,
                -0.5845,
            ],
            out: 0.6924,
        },
        Unit {
            constant: 1.191,
            weights: [
                -0.316, -1.714, 4.813, 0.1112, -0.8795, 0.6083, -1.399, 6.259, -4.721, 0.7468, -1.4,
            ],
            out: 0.9635,
        },
        Unit {
            constant: 2.447,
            weights: [
                0.03187, 0.07035, -1.359, -0.9617, -0.6154, 2.972, 0.3563, -4.624, 0.6089, 1.366,
                -1.256,
            ],
            out: -0.7908,
        },
        Unit {
            constant: 7.409,
            weights: [
                -0.5585, -0.4689, 1.67, -0.9567, -0.8465, -0.4115, -4.524, -2.586, -1.561, 1.812,
                -1.439,
            ],
            out: -1.189,
        },
        Unit {
            constant: 0.5466,
            weights: [
                -0.02114, -0.2716, -2.714, -1.941, 1.61, -0.2405, 4.789, -0.1262, -3.712, -1.701,
                0.6045,
            ],
            out: -1.529,
        },
        Unit {
            constant: -9.672,
            weights: [
                0.2326, -1.03, -0.3763, -0.6426, 0.2133, 3.069, 3.221, -3.388, 6.59, -1.782, 2.597,
            ],
            out: 1.278,
        },
        Unit {
            constant: -0.1472,
            weights: [
                -0.4897, 1.486, 1.133, -0.6569, 0.7302, -2.571, -3.669, -4.787, 9.59, -3.275,
                -0.9986,
            ],
            out: 0.969,
        },
    ],
};

/// The standard deviation of a refined disparity is s (1 + b d), where s is what residuals tell, and the doubt d what the
/// confidence is below one: this is b.
pub(crate) const PER_DOUBT: f32 = 30.1;

/// The standard deviation of a disparity that was not refined, in pixels: without scatter, and per pixel of scatter.
pub(crate) const UNREFINED: [f32; 2] = [0.12, 0.15];
