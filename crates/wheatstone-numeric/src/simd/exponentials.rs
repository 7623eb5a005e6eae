//! Exponentials in vector registers.

use super::negative::negative_singles;
use crate::sigmoid::{BOUND, LN2, ROUND, TAIL};
use pulp::{Simd, bytemuck::cast};

/// `exp(x)` of several doubles at a time for `|x| <= 700`, within 2 units in the last place of the exact value, as
/// [`exp`](crate::sigmoid::exp); beyond, the value at the bound.
#[inline(always)]
pub fn exponentials<S: Simd, const N: usize>(simd: S, mut x: [S::f64s; N]) -> [S::f64s; N] {
    let (mut whole, mut sums) = (x, x);
    let (log2_e, round) = (simd.splat_f64s(std::f64::consts::LOG2_E), simd.splat_f64s(ROUND));
    for (x, whole) in x.iter_mut().zip(&mut whole) {
        *x = clamped_double(simd, *x);
        *whole = simd.mul_add_f64s(*x, log2_e, round);
        *whole = simd.sub_f64s(*whole, round);
        *x = simd.mul_add_f64s(*whole, simd.splat_f64s(-LN2[0]), *x);
        *x = simd.mul_add_f64s(*whole, simd.splat_f64s(-LN2[1]), *x);
    }
    for (sum, r) in sums.iter_mut().zip(&x) {
        let square = simd.mul_f64s(*r, *r);
        let mut halves = [square; 2];
        for (half, [others @ .., last]) in halves.iter_mut().zip(TAIL) {
            *half = simd.splat_f64s(last);
            for factor in others.into_iter().rev() {
                *half = simd.mul_add_f64s(*half, square, simd.splat_f64s(factor));
            }
        }
        let [even, odd] = halves;
        let tail = simd.mul_add_f64s(*r, odd, even);
        *sum = simd.mul_add_f64s(square, tail, *r);
        *sum = simd.add_f64s(simd.splat_f64s(1.0), *sum);
    }
    for (sum, whole) in sums.iter_mut().zip(&whole) {
        *sum = scaled_double(simd, *sum, *whole);
    }
    sums
}

/// `value 2^whole`.
#[inline(always)]
fn scaled_double<S: Simd>(simd: S, value: S::f64s, whole: S::f64s) -> S::f64s {
    // The exponent's bits are added to. There are no shifts of 64 bits: with 1.5 * 2^20 added, the whole
    // number begins at bit 32, all below is zero, and a shift by 20 in each half brings it to the exponent.
    let whole: S::u32s = cast(simd.add_f64s(whole, simd.splat_f64s(1_572_864.0)));
    let exponent = simd.wrapping_dyn_shl_u32s(whole, simd.splat_u32s(20));
    cast(simd.add_u32s(cast(value), exponent))
}

/// Whether the minimum and maximum of two numbers of which one is not a number are the second, as in x86's
/// registers of four doubles and more; elsewhere the first may be taken.
#[inline(always)]
pub(crate) fn has_second_of_lost<S: Simd>() -> bool {
    size_of::<S::f64s>() >= size_of::<[f64; 4]>()
}

/// `x` between -[`BOUND`] and [`BOUND`]; what is not a number stays so.
#[inline(always)]
fn clamped_double<S: Simd>(simd: S, x: S::f64s) -> S::f64s {
    let (low, high) = (simd.splat_f64s(-BOUND), simd.splat_f64s(BOUND));
    if has_second_of_lost::<S>() {
        simd.min_f64s(high, simd.max_f64s(low, x))
    } else {
        let x = simd.select_f64s(simd.less_than_f64s(x, low), low, x);
        simd.select_f64s(simd.less_than_f64s(high, x), high, x)
    }
}

/// 2^r for |r| <= 1/2 in single precision, within 1.6e-7 of it relatively: through the Chebyshev nodes.
const POWER_OF_TWO: [f32; 6] = [
    1.000_000_1,
    std::f32::consts::LN_2,
    0.240_221_07,
    0.055_503_57,
    0.009_676_032,
    0.001_339_086_3,
];

/// `exp(-x)` of several singles at a time for `|x| <= 87`, within 2e-6 relatively; beyond, the value at the bound.
#[inline(always)]
pub(super) fn exponentials_of_negative<S: Simd, const N: usize>(
    simd: S,
    mut x: [S::f32s; N],
) -> [S::f32s; N] {
    // As ROUND of doubles, for 24 bits.
    const ROUND: f32 = 12_582_912.0; // 1.5 * 2^23
    let (log2_e, round) = (simd.splat_f32s(-std::f32::consts::LOG2_E), simd.splat_f32s(ROUND));
    let mut rounded = x;
    for (x, rounded) in x.iter_mut().zip(&mut rounded) {
        *x = clamped_single(simd, *x);
        *rounded = simd.mul_add_f32s(*x, log2_e, round);
        let whole = simd.sub_f32s(*rounded, round);
        *x = simd.mul_add_f32s(*x, log2_e, negative_singles(simd, whole));
    }
    let [others @ .., last] = POWER_OF_TWO;
    let mut sums = [simd.splat_f32s(last); N];
    for factor in others.into_iter().rev() {
        let factor = simd.splat_f32s(factor);
        for (sum, r) in sums.iter_mut().zip(&x) {
            *sum = simd.mul_add_f32s(*sum, *r, factor);
        }
    }
    for (sum, rounded) in sums.iter_mut().zip(&rounded) {
        *sum = scaled_single(simd, *sum, *rounded);
    }
    sums
}

/// `value 2^whole`, where the whole number stands in the low bits of `rounded`.
#[inline(always)]
fn scaled_single<S: Simd>(simd: S, value: S::f32s, rounded: S::f32s) -> S::f32s {
    let whole = simd.transmute_u32s_f32s(rounded);
    let exponent = simd.wrapping_dyn_shl_u32s(whole, simd.splat_u32s(23));
    simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(value), exponent))
}

/// As [`clamped_double`], to the range of [`exponentials_of_negative`].
#[inline(always)]
fn clamped_single<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let (low, high) = (simd.splat_f32s(-87.0), simd.splat_f32s(87.0));
    if has_second_of_lost::<S>() {
        simd.min_f32s(high, simd.max_f32s(low, x))
    } else {
        let x = simd.select_f32s(simd.less_than_f32s(x, low), low, x);
        simd.select_f32s(simd.less_than_f32s(high, x), high, x)
    }
}
