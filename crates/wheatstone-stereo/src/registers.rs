//! Pieces of rows that kernels work on at a time.
//!
//! Kernels are plain loops over arrays of a fixed length, compiled for several widths of registers, of which
//! `wheatstone_numeric::simd` chooses one at run time. Integers, and sums of floating-point numbers in a written order,
//! come out the same at every width.

/// Bytes at a time.
pub(crate) const LANES: usize = 32;
/// Single-precision numbers at a time.
pub(crate) const FLOATS: usize = 8;

pub(crate) type Bytes = [u8; LANES];
pub(crate) type Floats = [f32; FLOATS];

/// The mean of two bytes, rounded up.
#[inline(always)]
pub(crate) fn mean(a: u8, b: u8) -> u8 {
    ((u16::from(a) + u16::from(b) + 1) >> 1) as u8
}

/// A function of two pieces, lane by lane. Pieces are values: what is neither read nor written in memory stays in a
/// register.
#[inline(always)]
pub(crate) fn lanes<T: Copy, const N: usize>(
    a: [T; N],
    b: [T; N],
    f: impl Fn(T, T) -> T,
) -> [T; N] {
    // A loop: longer closures of `array::from_fn` are calls, of one lane each.
    let mut out = a;
    for lane in 0..N {
        out[lane] = f(a[lane], b[lane]);
    }
    out
}

/// A function of every lane.
#[inline(always)]
pub(crate) fn each<T: Copy, const N: usize>(values: [T; N], f: impl Fn(T) -> T) -> [T; N] {
    std::array::from_fn(|lane| f(values[lane]))
}

#[inline(always)]
pub(crate) fn plus(a: f32, b: f32) -> f32 {
    a + b
}

#[inline(always)]
pub(crate) fn times(a: f32, b: f32) -> f32 {
    a * b
}

/// The least of some bytes.
#[inline(always)]
pub(crate) fn least(values: &Bytes) -> u8 {
    values.iter().fold(u8::MAX, |least, &value| least.min(value))
}

/// A slice as pieces; its length is a multiple of theirs.
#[inline(always)]
pub(crate) fn pieces<T, const N: usize>(values: &[T]) -> &[[T; N]] {
    values.as_chunks().0
}

/// As [`pieces`].
#[inline(always)]
pub(crate) fn pieces_mut<T, const N: usize>(values: &mut [T]) -> &mut [[T; N]] {
    values.as_chunks_mut().0
}

/// The piece that begins at an index.
#[inline(always)]
pub(crate) fn floats(values: &[f32], at: usize) -> Floats {
    let piece = &values[at..at + FLOATS];
    std::array::from_fn(|lane| piece[lane])
}
