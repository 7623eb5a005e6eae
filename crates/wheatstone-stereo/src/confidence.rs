//! The probability that a disparity is less than one pixel off: a logistic regression on the evidence, its squares and its
//! products.

use crate::{
    coefficients::{CONFIDENCE, QUANTITIES},
    evidence::Evidence,
    registers::{FLOATS, Floats},
};
use pulp::{Arch, Simd, WithSimd};

/// Of the pixels of one row; zero where there is no disparity.
pub(crate) fn write(evidence: &Evidence, out: &mut [f32]) {
    Arch::new().dispatch(Row { evidence, out: &mut *out });
    for (out, gap) in out.iter_mut().zip(&evidence.gap) {
        *out = if gap.is_nan() { 0.0 } else { 1.0 / (1.0 + libm::expf(-*out)) };
    }
}

/// Logarithms of the odds of one row.
struct Row<'a> {
    evidence: &'a Evidence,
    out: &'a mut [f32],
}

impl WithSimd for Row<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (piece, out) in self.out.chunks_mut(FLOATS).enumerate() {
            let odds = odds(&quantities(self.evidence, piece * FLOATS));
            out.copy_from_slice(&odds[..out.len()]);
        }
    }
}

/// What is weighted, of eight pixels: each within -1 and 1, and saturating where more says no more.
#[inline(always)]
fn quantities(evidence: &Evidence, at: usize) -> [Floats; QUANTITIES] {
    let Evidence { gap, lead, left_right, scatter, known, correlation, texture } = evidence;
    let piece = |values: &[f32]| -> Floats {
        let values = &values[at..values.len().min(at + FLOATS)];
        std::array::from_fn(|lane| values.get(lane).copied().unwrap_or(0.0))
    };
    let saturating = |values: &[f32], half: f32| piece(values).map(|value| value / (value + half));
    [
        saturating(gap, 16.0),
        saturating(gap, 64.0),
        piece(lead).map(|lead| (lead / 16.0).clamp(-1.0, 1.0)),
        piece(left_right).map(|residual| residual / 1.5),
        piece(scatter).map(|scatter| scatter / 2.0),
        piece(known).map(|known| 1.0 - known),
        piece(correlation).map(|correlation| correlation.max(0.0)),
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
