//! Formulas that are written once, for one number and for a register full of them.

use super::simd::{Simd, has_second_of_lost, negative_doubles};
use std::ops::{Add, Div, Mul, Sub};

/// What a formula computes with. Both kinds give the same bits: what is rounded once is so in both, and every
/// number of a register goes its own way.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The same value in all places.
    fn all(self, value: f64) -> Self;

    /// Itself and a product of two others, rounded once. A number by itself may call for it, which takes as long
    /// as a few products: for formulas of which many are worked out at once.
    fn add_product(self, a: Self, b: Self) -> Self;

    /// Itself less a product of two others, rounded once.
    fn subtract_product(self, a: Self, b: Self) -> Self;

    /// Without its sign.
    fn magnitude(self) -> Self;

    /// The larger of two; the other one where this is not a number.
    fn max_with(self, other: Self) -> Self;

    /// The smaller of two; the other one where this is not a number.
    fn or_smaller(self, other: Self) -> Self;

    /// 0 where it lies between two numbers, and not a number elsewhere.
    fn held(self, least: f64, most: f64) -> Self;

    /// 0 where it is less, 1 elsewhere.
    fn beyond(self, most: f64) -> Self;

    /// Whether all are 0, of numbers that are not negative.
    fn is_zero(self) -> bool;

    /// The square root.
    fn root(self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn all(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        libm::fma(a, b, self)
    }

    #[inline(always)]
    fn subtract_product(self, a: Self, b: Self) -> Self {
        libm::fma(-a, b, self)
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn max_with(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn or_smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn held(self, least: f64, most: f64) -> Self {
        if self > least && self < most { 0.0 } else { Self::NAN }
    }

    #[inline(always)]
    fn beyond(self, most: f64) -> Self {
        if self < most { 0.0 } else { 1.0 }
    }

    #[inline(always)]
    fn is_zero(self) -> bool {
        self <= 0.0
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

/// A register full of doubles.
#[derive(Clone, Copy)]
pub struct Doubles<S: Simd>(pub S, pub S::f64s);

impl<S: Simd> Add for Doubles<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.add_f64s(self.1, other.1))
    }
}

impl<S: Simd> Sub for Doubles<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.sub_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul for Doubles<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.mul_f64s(self.1, other.1))
    }
}

impl<S: Simd> Div for Doubles<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0, self.0.div_f64s(self.1, other.1))
    }
}

impl<S: Simd> Number for Doubles<S> {
    #[inline(always)]
    fn all(self, value: f64) -> Self {
        Self(self.0, self.0.splat_f64s(value))
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        Self(self.0, self.0.mul_add_f64s(a.1, b.1, self.1))
    }

    #[inline(always)]
    fn subtract_product(self, a: Self, b: Self) -> Self {
        Self(self.0, self.0.mul_add_f64s(negative_doubles(self.0, a.1), b.1, self.1))
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        Self(self.0, self.0.abs_f64s(self.1))
    }

    #[inline(always)]
    fn max_with(self, other: Self) -> Self {
        if has_second_of_lost::<S>() {
            return Self(self.0, self.0.max_f64s(self.1, other.1));
        }
        let larger = self.0.greater_than_f64s(self.1, other.1);
        Self(self.0, self.0.select_f64s(larger, self.1, other.1))
    }

    #[inline(always)]
    fn or_smaller(self, other: Self) -> Self {
        if has_second_of_lost::<S>() {
            return Self(self.0, self.0.min_f64s(self.1, other.1));
        }
        let smaller = self.0.less_than_f64s(self.1, other.1);
        Self(self.0, self.0.select_f64s(smaller, self.1, other.1))
    }

    #[inline(always)]
    fn held(self, least: f64, most: f64) -> Self {
        let simd = self.0;
        let above = simd.greater_than_f64s(self.1, simd.splat_f64s(least));
        let below = simd.less_than_f64s(self.1, simd.splat_f64s(most));
        let held = simd.and_m64s(above, below);
        let (yes, no) = (simd.splat_f64s(0.0), simd.splat_f64s(f64::NAN));
        Self(simd, simd.select_f64s(held, yes, no))
    }

    #[inline(always)]
    fn beyond(self, most: f64) -> Self {
        let simd = self.0;
        let less = simd.less_than_f64s(self.1, simd.splat_f64s(most));
        Self(simd, simd.select_f64s(less, simd.splat_f64s(0.0), simd.splat_f64s(1.0)))
    }

    #[inline(always)]
    fn is_zero(self) -> bool {
        self.0.reduce_max_f64s(self.1) <= 0.0
    }

    #[inline(always)]
    fn root(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }
}

/// Two numbers side by side: neither waits for the other.
#[derive(Clone, Copy)]
pub struct Pair<N>(pub [N; 2]);

/// Does to two pairs what is done to two numbers.
macro_rules! both {
    ($operation:ident, $method:ident) => {
        impl<N: Number> $operation for Pair<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let (Self([a, b]), Self([c, d])) = (self, other);
                Self([a.$method(c), b.$method(d)])
            }
        }
    };
}

both!(Add, add);
both!(Sub, sub);
both!(Mul, mul);
both!(Div, div);

impl<N: Number> Number for Pair<N> {
    #[inline(always)]
    fn all(self, value: f64) -> Self {
        let all = self.0[0].all(value);
        Self([all, all])
    }

    #[inline(always)]
    fn add_product(self, a: Self, b: Self) -> Self {
        let (Self([sum, other]), Self([a, c]), Self([b, d])) = (self, a, b);
        Self([sum.add_product(a, b), other.add_product(c, d)])
    }

    #[inline(always)]
    fn subtract_product(self, a: Self, b: Self) -> Self {
        let (Self([sum, other]), Self([a, c]), Self([b, d])) = (self, a, b);
        Self([sum.subtract_product(a, b), other.subtract_product(c, d)])
    }

    #[inline(always)]
    fn magnitude(self) -> Self {
        let Self([a, b]) = self;
        Self([a.magnitude(), b.magnitude()])
    }

    #[inline(always)]
    fn max_with(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a.max_with(c), b.max_with(d)])
    }

    #[inline(always)]
    fn or_smaller(self, other: Self) -> Self {
        let (Self([a, b]), Self([c, d])) = (self, other);
        Self([a.or_smaller(c), b.or_smaller(d)])
    }

    #[inline(always)]
    fn held(self, least: f64, most: f64) -> Self {
        let Self([a, b]) = self;
        Self([a.held(least, most), b.held(least, most)])
    }

    #[inline(always)]
    fn beyond(self, most: f64) -> Self {
        let Self([a, b]) = self;
        Self([a.beyond(most), b.beyond(most)])
    }

    #[inline(always)]
    fn is_zero(self) -> bool {
        let Self([a, b]) = self;
        a.is_zero() & b.is_zero()
    }

    #[inline(always)]
    fn root(self) -> Self {
        let Self([a, b]) = self;
        Self([a.root(), b.root()])
    }
}

/// Registers full of a slice's numbers; what does not fill one is left off.
#[inline(always)]
#[must_use]
pub fn registers<S: Simd>(values: &[f64]) -> &[S::f64s] {
    S::as_simd_f64s(values).0
}

/// As [`registers`].
#[inline(always)]
pub fn registers_mut<S: Simd>(values: &mut [f64]) -> &mut [S::f64s] {
    S::as_mut_simd_f64s(values).0
}
