//! The probability that a disparity is less than one pixel off: a logistic regression on the evidence.

use crate::{
    coefficients::{CONFIDENCE, TERMS},
    evidence::Evidence,
};

/// Of every pixel; zero where there is no disparity.
pub(crate) fn write(evidence: &Evidence, out: &mut [f32]) {
    for (at, out) in out.iter_mut().enumerate() {
        *out = one(evidence, at);
    }
}

fn one(evidence: &Evidence, at: usize) -> f32 {
    if evidence.gap[at].is_nan() {
        return 0.0;
    }
    let weighted =
        terms(evidence, at).into_iter().zip(CONFIDENCE).map(|(term, weight)| term * weight);
    1.0 / (1.0 + libm::expf(-weighted.sum::<f32>()))
}

/// What is weighted: each between 0 and 1, and saturating where more says no more.
fn terms(evidence: &Evidence, at: usize) -> [f32; TERMS] {
    let saturating = |value: f32, half: f32| value / (value + half);
    let gap = saturating(evidence.gap[at], 16.0);
    let correlation = evidence.correlation[at].max(0.0);
    let texture = saturating(evidence.texture[at], 4.0);
    [
        1.0,
        gap,
        saturating(evidence.gap[at], 64.0),
        evidence.left_right[at] / 1.5,
        evidence.scatter[at] / 2.0,
        1.0 - evidence.known[at],
        correlation,
        correlation * correlation,
        texture,
        gap * correlation,
        gap * texture,
    ]
}
