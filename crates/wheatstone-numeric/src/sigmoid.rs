//! The log-sigmoid, fast enough for training loops: branch-free, so that compilers turn it into
//! vector instructions, and made of products and sums only, so that every machine agrees.

/// `1 / (1 + exp(-x))`, within 4 units in the last place of the exact value.
#[inline(always)]
#[must_use]
pub fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}

/// Added to a number below 2^51 it leaves the nearest whole number in the low bits.
pub(super) const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// Beyond this on either side, the value at the bound is taken.
pub(super) const BOUND: f64 = 700.0;

/// ln 2 in two parts; the first has 21 zero bits at its end, so its products are exact.
pub(super) const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];

/// (exp(r) - 1 - r) / r^2 for |r| <= ln(2) / 2, through the Chebyshev nodes of that range, worked out with sixty
/// digits; with it exp(r) is within 1.7e-17. Factors of even powers and of odd ones: as two sums, each half as
/// long, they are ready sooner.
pub(super) const TAIL: [[f64; 5]; 2] = [
    [
        0.500_000_000_000_000_1,
        0.041_666_666_666_624_164,
        0.001_388_888_891_719_671_9,
        2.480_152_132_236_869_2e-5,
        2.762_007_587_998_336_7e-7,
    ],
    [
        0.166_666_666_666_666_69,
        0.008_333_333_333_330_065,
        0.000_198_412_698_630_405_45,
        2.755_726_848_031_002_4e-6,
        2.510_037_583_256_123_4e-8,
    ],
];

/// `exp(x)` for `|x| <= 700`, within 2 units in the last place; beyond, the value at the bound.
///
/// Cody & Waite's reduction to `|r| <= ln(2) / 2`, then a polynomial.
#[inline(always)]
#[must_use]
pub fn exp(x: f64) -> f64 {
    let x = x.clamp(-BOUND, BOUND);
    let rounded = x * std::f64::consts::LOG2_E + ROUND;
    let whole = rounded - ROUND;
    let r = (x - whole * LN2[0]) - whole * LN2[1];
    let square = r * r;
    let [even, odd] = TAIL.map(|[others @ .., last]| {
        others.iter().rev().fold(last, |sum, factor| sum * square + factor)
    });
    let sum = 1.0 + (r + square * (even + r * odd));
    // Multiplying by 2^whole is adding it to the exponent bits.
    f64::from_bits(sum.to_bits().wrapping_add(rounded.to_bits() << 52))
}
