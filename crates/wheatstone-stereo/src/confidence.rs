//! The probability that a disparity is less than one pixel off: a logistic regression on the evidence, its squares and its
//! products.

use crate::{
    coefficients::{CONFIDENCE, QUANTITIES},
    evidence::Evidence,
    registers::{FLOATS, Floats, each, floats},
};
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Of the pixels of one row, whose evidence is filled up to whole registers; zero where there is no disparity.
pub(crate) fn write(evidence: &Evidence, out: &mut [f32]) {
    on_widest(Row { evidence, out });
}

/// The work of one row.
struct Row<'a> {
    evidence: &'a Evidence,
    out: &'a mut [f32],
}

impl WithSimd for Row<'_> {
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

/// What is weighted, of eight pixels: each within -1 and 1, and saturating where more says no more.
#[inline(always)]
fn quantities(evidence: &Evidence, at: usize) -> [Floats; QUANTITIES] {
    let Evidence { gap, lead, left_right, scatter, known, correlation, texture } = evidence;
    let piece = |values: &[f32]| floats(values, at);
    let saturating =
        |values: &[f32], half: f32| each(piece(values), |value| value / (value + half));
    [
        saturating(gap, 16.0),
        saturating(gap, 64.0),
        each(piece(lead), |lead| (lead / 16.0).clamp(-1.0, 1.0)),
        each(piece(left_right), |residual| residual / 1.5),
        each(piece(scatter), |scatter| scatter / 2.0),
        each(piece(known), |known| 1.0 - known),
        each(piece(correlation), |correlation| correlation.max(0.0)),
        saturating(texture, 4.0),
    ]
}

/// The constant, then every quantity, then the products of each with itself and with those behind it.
#[inline(always)]
fn odds(quantities: &[Floats; QUANTITIES]) -> Floats {
    let mut odds = [CONFIDENCE.constant; FLOATS];
    let mut products = CONFIDENCE.products.iter();
    for (k, (one, weight)) in quantities.iter().zip(CONFIDENCE.quantities).enumerate() {
        for lane in 0..FLOATS {
            odds[lane] += weight * one[lane];
        }
        for (other, weight) in quantities[k..].iter().zip(products.by_ref()) {
            for lane in 0..FLOATS {
                odds[lane] += weight * one[lane] * other[lane];
            }
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
