//! The log-sigmoid, fast enough for training loops: branch-free, so that compilers turn it into
//! vector instructions, and made of products and sums only, so that every machine agrees.

/// `1 / (1 + exp(-x))`, within 4 units in the last place of the exact value.
#[inline(always)]
#[must_use]
pub fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}

/// `exp(x)` for `|x| <= 700`, within 2 units in the last place; beyond, the value at the bound.
///
/// Cody & Waite's reduction to `|r| <= ln(2) / 2`, then the Taylor polynomial of degree 13, whose
/// remainder there is below 5e-18.
#[inline(always)]
#[must_use]
pub fn exp(x: f64) -> f64 {
    // Added to a number below 2^51 it leaves the nearest whole number in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52
    const LOG2_E: f64 = std::f64::consts::LOG2_E;
    // ln 2 in two parts; the first has 21 zero bits at its end, so its products are exact.
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    const INVERSE_FACTORIALS: [f64; 14] = [
        1.0,
        1.0,
        1.0 / 2.0,
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5_040.0,
        1.0 / 40_320.0,
        1.0 / 362_880.0,
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
        1.0 / 479_001_600.0,
        1.0 / 6_227_020_800.0,
    ];
    let x = x.clamp(-700.0, 700.0);
    let rounded = x * LOG2_E + ROUND;
    let whole = rounded - ROUND;
    let r = (x - whole * LN2_HIGH) - whole * LN2_LOW;
    let mut sum = INVERSE_FACTORIALS[13];
    let mut degree = 13;
    while degree > 0 {
        degree -= 1;
        sum = sum * r + INVERSE_FACTORIALS[degree];
    }
    // Multiplying by 2^whole is adding it to the exponent bits.
    f64::from_bits(sum.to_bits().wrapping_add(rounded.to_bits() << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance between two doubles of the same sign, in units in the last place.
    fn units_apart(a: f64, b: f64) -> u64 {
        a.to_bits().abs_diff(b.to_bits())
    }

    #[test]
    fn both_stay_within_their_stated_bound() {
        for step in -700_000..=700_000_i32 {
            let x = f64::from(step) * 1e-3 + 1.234e-7;
            let x = x.clamp(-700.0, 700.0);
            assert!(units_apart(exp(x), libm::exp(x)) <= 2, "exp({x})");
            let exact = 1.0 / (1.0 + libm::exp(-x));
            assert!(units_apart(sigmoid(x), exact) <= 4, "sigmoid({x})");
        }
    }

    #[test]
    fn the_far_ends_saturate() {
        assert_eq!(sigmoid(1e9), 1.0);
        assert!(sigmoid(-1e9) > 0.0 && sigmoid(-1e9) < 1e-300);
        assert!(sigmoid(f64::NAN).is_nan());
    }
}
