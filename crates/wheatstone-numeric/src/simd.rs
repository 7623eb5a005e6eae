//! Arithmetic on as many numbers at once as the processor's registers hold, chosen at run time.
//!
//! Kernels are written once, over [`Real`] and [`Simd`], and compiled for every width. They must give
//! the same bits at each: where a product is added without being rounded before, it is so everywhere (a
//! processor that has no instruction for it takes long), and no sum may run across a register in an order
//! that depends on its width.

mod exponentials;
mod negative;

pub use exponentials::exponentials;
use exponentials::exponentials_of_negative;
pub(crate) use exponentials::has_second_of_lost;
pub(crate) use negative::negative_doubles;
use negative::negative_singles;
use pulp::Arch;
pub use pulp::{Simd, WithSimd};
use std::sync::OnceLock;

/// The environment variable that keeps a whole process to the narrowest registers, where it is `128` (bits), for
/// tests that results do not depend on their width. It is read once.
pub const REGISTERS: &str = "WHEATSTONE_REGISTERS";

/// Whether [`REGISTERS`] asks for the narrowest registers.
fn kept_narrow() -> bool {
    static NARROW: OnceLock<bool> = OnceLock::new();
    *NARROW.get_or_init(|| std::env::var_os(REGISTERS).is_some_and(|bits| bits == "128"))
}

/// Runs a kernel in the widest registers there are, unless [`REGISTERS`] forbids it.
#[inline]
pub fn on_widest<K: WithSimd>(kernel: K) -> K::Output {
    match Arch::new() {
        // Where nothing wider is known to be there: pairs of doubles, which every 64-bit machine has.
        Arch::Scalar => Simd::vectorize(pulp::Scalar128b, kernel),
        #[allow(unreachable_patterns, reason = "some processors have one kind of registers only")]
        _ if kept_narrow() => Simd::vectorize(pulp::Scalar128b, kernel),
        #[allow(unreachable_patterns, reason = "some processors have one kind of registers only")]
        wide => wide.dispatch(kernel),
    }
}

/// A floating-point number that kernels can be written over, and vectors of it.
pub trait Real: Copy + Default + Send + Sync + 'static {
    /// As many as a register holds.
    type Vector<S: Simd>: Copy;

    /// The nearest to a double.
    fn nearest(value: f64) -> Self;

    /// As a double.
    fn double(self) -> f64;

    /// One and another.
    #[must_use]
    fn plus(self, other: Self) -> Self;

    /// A slice as vectors; what does not fill one is left off.
    fn vectors<S: Simd>(values: &[Self]) -> &[Self::Vector<S>];

    /// As [`Real::vectors`].
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [Self::Vector<S>];

    /// The same number everywhere.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;

    /// a + b.
    fn add<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;

    /// a - b.
    fn subtract<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;

    /// a b.
    fn multiply<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;

    /// sum + a b, rounded once.
    fn add_product<S: Simd>(
        simd: S,
        sum: Self::Vector<S>,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// sum - a b, rounded once.
    fn subtract_product<S: Simd>(
        simd: S,
        sum: Self::Vector<S>,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// `1 / (1 + exp(-x))` of several at a time, so that none waits for another: in double precision within
    /// 4 units in the last place of the exact value, as [`super::sigmoid::sigmoid`], in single precision within
    /// 2e-7 of it.
    fn sigmoid<S: Simd, const N: usize>(simd: S, x: [Self::Vector<S>; N]) -> [Self::Vector<S>; N];

    /// How many numbers a vector holds.
    #[must_use]
    fn width<S: Simd>() -> usize {
        size_of::<Self::Vector<S>>() / size_of::<Self>()
    }
}

/// `first[r]` and the sum over k of `factors[k][r] * vectors[k]`, in the order of k.
#[inline(always)]
pub fn add_products<'a, T: Real, S: Simd, const R: usize>(
    simd: S,
    mut sums: [T::Vector<S>; R],
    factors: &[T],
    vectors: impl Iterator<Item = &'a T::Vector<S>>,
) -> [T::Vector<S>; R] {
    for (factors, vector) in factors.as_chunks::<R>().0.iter().zip(vectors) {
        for (sum, factor) in sums.iter_mut().zip(factors) {
            *sum = T::add_product(simd, *sum, T::splat(simd, *factor), *vector);
        }
    }
    sums
}

impl Real for f64 {
    type Vector<S: Simd> = S::f64s;

    #[inline(always)]
    fn nearest(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn double(self) -> f64 {
        self
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn vectors<S: Simd>(values: &[Self]) -> &[S::f64s] {
        S::as_simd_f64s(values).0
    }

    #[inline(always)]
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(values).0
    }

    #[inline(always)]
    fn splat<S: Simd>(simd: S, value: Self) -> S::f64s {
        simd.splat_f64s(value)
    }

    #[inline(always)]
    fn add<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.add_f64s(a, b)
    }

    #[inline(always)]
    fn subtract<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.sub_f64s(a, b)
    }

    #[inline(always)]
    fn multiply<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.mul_f64s(a, b)
    }

    #[inline(always)]
    fn add_product<S: Simd>(simd: S, sum: S::f64s, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.mul_add_f64s(a, b, sum)
    }

    #[inline(always)]
    fn subtract_product<S: Simd>(simd: S, sum: S::f64s, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.mul_add_f64s(negative_doubles(simd, a), b, sum)
    }

    #[inline(always)]
    fn sigmoid<S: Simd, const N: usize>(simd: S, mut x: [S::f64s; N]) -> [S::f64s; N] {
        for x in &mut x {
            *x = negative_doubles(simd, *x);
        }
        let (one, mut values) = (simd.splat_f64s(1.0), exponentials(simd, x));
        for value in &mut values {
            *value = simd.div_f64s(one, simd.add_f64s(one, *value));
        }
        values
    }
}

impl Real for f32 {
    type Vector<S: Simd> = S::f32s;

    #[inline(always)]
    fn nearest(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn double(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self + other
    }

    #[inline(always)]
    fn vectors<S: Simd>(values: &[Self]) -> &[S::f32s] {
        S::as_simd_f32s(values).0
    }

    #[inline(always)]
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [S::f32s] {
        S::as_mut_simd_f32s(values).0
    }

    #[inline(always)]
    fn splat<S: Simd>(simd: S, value: Self) -> S::f32s {
        simd.splat_f32s(value)
    }

    #[inline(always)]
    fn add<S: Simd>(simd: S, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.add_f32s(a, b)
    }

    #[inline(always)]
    fn subtract<S: Simd>(simd: S, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.sub_f32s(a, b)
    }

    #[inline(always)]
    fn multiply<S: Simd>(simd: S, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.mul_f32s(a, b)
    }

    #[inline(always)]
    fn add_product<S: Simd>(simd: S, sum: S::f32s, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.mul_add_f32s(a, b, sum)
    }

    #[inline(always)]
    fn subtract_product<S: Simd>(simd: S, sum: S::f32s, a: S::f32s, b: S::f32s) -> S::f32s {
        simd.mul_add_f32s(negative_singles(simd, a), b, sum)
    }

    #[inline(always)]
    fn sigmoid<S: Simd, const N: usize>(simd: S, x: [S::f32s; N]) -> [S::f32s; N] {
        let (one, mut values) = (simd.splat_f32s(1.0), exponentials_of_negative(simd, x));
        for value in &mut values {
            *value = simd.div_f32s(one, simd.add_f32s(one, *value));
        }
        values
    }
}

/// Runs a kernel at every width that this machine has, narrowest first, and last as [`on_widest`] does: for tests
/// that all widths give the same bits. `kernel` makes it anew for each.
pub fn on_each<K: WithSimd>(mut kernel: impl FnMut() -> K) -> Vec<K::Output> {
    let mut results = vec![Simd::vectorize(pulp::Scalar128b, kernel())];
    #[cfg(target_arch = "x86_64")]
    results.extend(pulp::x86::V3::try_new().map(|simd| Simd::vectorize(simd, kernel())));
    results.push(on_widest(kernel()));
    results
}
