//! Products that are added without being rounded before, also where the processor has no instruction for it: slower
//! by far, but the same bits.
//!
//! Source: Boldo & Melquiond 2008, "Emulation of a FMA and correctly rounded sums: proved algorithms using rounding
//! to odd" (doi:10.1109/TC.2007.70819); exact products by Dekker 1971 (doi:10.1007/BF01397083).

use pulp::{
    Simd,
    bytemuck::{cast_slice, cast_slice_mut},
};
use std::any::TypeId;

/// Whether these are the registers of which nothing is known but that they hold pairs of doubles.
fn is_portable<S: Simd>() -> bool {
    TypeId::of::<S>() == TypeId::of::<pulp::Scalar128b>()
}

/// a b + c, rounded once, of doubles.
#[inline(always)]
pub fn multiply_add_doubles<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
    if !is_portable::<S>() {
        return simd.mul_add_f64s(a, b, c);
    }
    let (mut sums, a, b) = ([c], [a], [b]);
    let (a, b): (&[f64], &[f64]) = (cast_slice(&a), cast_slice(&b));
    for (sum, (a, b)) in cast_slice_mut::<_, f64>(&mut sums).iter_mut().zip(a.iter().zip(b)) {
        *sum = double(*a, *b, *sum);
    }
    let [sum] = sums;
    sum
}

/// a b + c, rounded once, of singles.
#[inline(always)]
pub fn multiply_add_singles<S: Simd>(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
    if !is_portable::<S>() {
        return simd.mul_add_f32s(a, b, c);
    }
    let (mut sums, a, b) = ([c], [a], [b]);
    let (a, b): (&[f32], &[f32]) = (cast_slice(&a), cast_slice(&b));
    for (sum, (a, b)) in cast_slice_mut::<_, f32>(&mut sums).iter_mut().zip(a.iter().zip(b)) {
        *sum = single(*a, *b, *sum);
    }
    let [sum] = sums;
    sum
}

/// What rounding leaves of a sum: both together are exact (Knuth's TwoSum).
#[inline(always)]
fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// The sum rounded to the neighbour whose last bit is set, unless it is exact: rounded again, to fewer bits, it is as
/// if it had been rounded once.
#[inline(always)]
fn odd_sum(a: f64, b: f64) -> f64 {
    let (sum, rest) = exact_sum(a, b);
    let bits = sum.to_bits();
    // The neighbour on the side of the rest: away from 0 where both have one sign.
    let is_outwards = (rest.to_bits() ^ bits) >> 63 == 0;
    let neighbour = if is_outwards { bits.wrapping_add(1) } else { bits.wrapping_sub(1) };
    f64::from_bits(if rest != 0.0 && bits & 1 == 0 { neighbour } else { bits })
}

/// A number as the sum of two of half its digits.
#[inline(always)]
fn halves(value: f64) -> (f64, f64) {
    let scaled = value * 134_217_729.0; // 2^27 + 1
    let upper = scaled - (scaled - value);
    (upper, value - upper)
}

/// a b + c, rounded once.
#[inline(always)]
fn double(a: f64, b: f64, c: f64) -> f64 {
    // Beyond these, halves and errors may not be numbers of full length.
    const LARGEST: f64 = 1e150;
    const SMALLEST: f64 = 1e-280;
    let product = a * b;
    let is_held = a.abs() < LARGEST && b.abs() < LARGEST && c.abs() < LARGEST;
    let is_zero = a == 0.0 || b == 0.0;
    if !(is_held && (product.abs() > SMALLEST || is_zero)) {
        return libm::fma(a, b, c);
    }
    let ((a_upper, a_lower), (b_upper, b_lower)) = (halves(a), halves(b));
    let rest =
        ((a_upper * b_upper - product) + a_upper * b_lower + a_lower * b_upper) + a_lower * b_lower;
    let (small, small_rest) = exact_sum(c, rest);
    let (large, large_rest) = exact_sum(product, small);
    let sum = large + odd_sum(small_rest, large_rest);
    // A sum of zeros has the sign that the plain one has.
    if sum == 0.0 { product + c } else { sum }
}

/// The same of singles.
#[inline(always)]
fn single(a: f32, b: f32, c: f32) -> f32 {
    let product = f64::from(a) * f64::from(b); // exact
    let plain = product + f64::from(c);
    // Sums of zeros and what is not a number have nothing to round.
    if plain == 0.0 || !plain.is_finite() {
        plain as f32
    } else {
        odd_sum(product, f64::from(c)) as f32
    }
}
