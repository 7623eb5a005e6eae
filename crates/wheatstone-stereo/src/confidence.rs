//! The probability that a disparity is less than one pixel off: a small network on the evidence, with one hidden layer.

use crate::{
    coefficients::{CONFIDENCE, QUANTITIES},
    evidence::Evidence,
    registers::{FLOATS, Floats, each},
};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Of as many pixels as there is room for; zero where there is no disparity.
pub(crate) fn write(evidence: &Evidence, out: &mut [f32]) {
    on_widest(Pixels { evidence, out });
}

/// The work on some pixels.
struct Pixels<'a> {
    evidence: &'a Evidence,
    out: &'a mut [f32],
}

impl WithSimd for Pixels<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (piece, out) in self.out.chunks_mut(FLOATS).enumerate() {
            let at = piece * FLOATS;
            let chances = each(odds(&quantities(self.evidence, at)), logistic);
            let gaps = &self.evidence.gap[at..];
            for ((out, chance), gap) in out.iter_mut().zip(chances).zip(gaps) {
                *out = if gap.is_nan() { 0.0 } else { chance };
            }
        }
    }
}

/// What is weighted, of eight pixels, or of as many as there are: each within -1 and 1, and saturating where more says no more.
#[inline(always)]
fn quantities(evidence: &Evidence, at: usize) -> [Floats; QUANTITIES] {
    let piece = |values: &[f32]| -> Floats {
        let mut piece = [0.0; FLOATS];
        let some = &values[at..values.len().min(at + FLOATS)];
        piece[..some.len()].copy_from_slice(some);
        piece
    };
    let saturating =
        |values: &[f32], half: f32| each(piece(values), |value| value / (value + half));
    let positive = |values: &[f32]| each(piece(values), |value| value.max(0.0));
    let unknown = |values: &[f32]| each(piece(values), |known| 1.0 - known);
    let Evidence { gap, lead, left_right, scatter, known, correlation, texture, .. } = evidence;
    let Evidence { surface, border, wide_known, wide_correlation, .. } = evidence;
    [
        saturating(gap, 16.0),
        each(piece(lead), |lead| (lead / 16.0).clamp(-1.0, 1.0)),
        each(piece(left_right), |residual| residual / 1.5),
        each(piece(scatter), |scatter| scatter / 2.0),
        unknown(known),
        positive(correlation),
        saturating(texture, 4.0),
        each(piece(surface), |log| (log / 10.0).min(1.0)),
        each(piece(border), |border| (border / 20.0).clamp(-1.0, 1.0)),
        unknown(wide_known),
        positive(wide_correlation),
    ]
}

/// A weighted sum of the hidden units, each a weighted sum of all quantities, or zero where that is negative.
#[inline(always)]
fn odds(quantities: &[Floats; QUANTITIES]) -> Floats {
    let mut odds = [CONFIDENCE.constant; FLOATS];
    for unit in &CONFIDENCE.hidden {
        let mut sum = [unit.constant; FLOATS];
        for (quantity, weight) in quantities.iter().zip(unit.weights) {
            for lane in 0..FLOATS {
                sum[lane] += weight * quantity[lane];
            }
        }
        for lane in 0..FLOATS {
            odds[lane] += unit.out * sum[lane].max(0.0);
        }
    }
    odds
}

/// 1 / (1 + exp(-odds)), to a millionth.
///
/// exp is a power of two times 2^t for t within -1/2 and 1/2, and that a Taylor polynomial: the same operations on every
/// machine, and several numbers at a time.
#[inline(always)]
fn logistic(odds: f32) -> f32 {
    let exponent = (-odds).clamp(-60.0, 60.0) * std::f32::consts::LOG2_E;
    let whole = (exponent + 128.5) as i32;
    let t = (exponent - (whole - 128) as f32) * std::f32::consts::LN_2;
    let series = 1.0 + t * (1.0 + t * (1.0 / 2.0 + t * (1.0 / 6.0 + t * (1.0 / 24.0 + t / 120.0))));
    1.0 / (1.0 + series * f32::from_bits(((whole - 1) << 23) as u32))
}

#[cfg(test)]
mod tests {
    use super::logistic;

    #[test]
    fn is_the_logistic_function() {
        for step in -1000..1000 {
            let odds = step as f32 * 0.05;
            let exact = 1.0 / (1.0 + libm::exp(-f64::from(odds)));
            assert!((f64::from(logistic(odds)) - exact).abs() < 2e-6, "{odds}");
        }
        assert!(logistic(1e9) > 0.999 && logistic(-1e9) < 0.001);
    }
}
