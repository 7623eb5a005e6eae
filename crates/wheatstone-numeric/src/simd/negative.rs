//! Negation of registers.

use pulp::Simd;

/// `-x`. (Pulp's own function is left as a call by the compiler, which costs a kernel all of its registers.)
#[inline(always)]
pub(crate) fn negative_doubles<S: Simd>(simd: S, x: S::f64s) -> S::f64s {
    simd.xor_f64s(x, simd.splat_f64s(-0.0))
}

/// `-x`, as [`negative_doubles`].
#[inline(always)]
pub(super) fn negative_singles<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    simd.xor_f32s(x, simd.splat_f32s(-0.0))
}
