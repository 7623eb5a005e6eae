//! Products that are added without being rounded before.

use wheatstone_numeric::{
    random::Random,
    simd::{Real, Simd, WithSimd, multiply_add_doubles, multiply_add_singles, on_each},
};

/// a b + c of three columns.
struct Sums<'a, T>([&'a [T]; 3]);

impl WithSimd for Sums<'_, f64> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let [a, b, c] = self.0;
        let mut sums = c.to_vec();
        let factors = f64::vectors::<S>(a).iter().zip(f64::vectors::<S>(b));
        for (sum, (a, b)) in f64::vectors_mut::<S>(&mut sums).iter_mut().zip(factors) {
            *sum = multiply_add_doubles(simd, *a, *b, *sum);
        }
        sums
    }
}

impl WithSimd for Sums<'_, f32> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
        let [a, b, c] = self.0;
        let mut sums = c.to_vec();
        let factors = f32::vectors::<S>(a).iter().zip(f32::vectors::<S>(b));
        for (sum, (a, b)) in f32::vectors_mut::<S>(&mut sums).iter_mut().zip(factors) {
            *sum = multiply_add_singles(simd, *a, *b, *sum);
        }
        sums
    }
}

/// At every width, of doubles and of singles; as many as fill the widest registers of singles.
fn assert_rounded_once(columns: &[Vec<f64>; 3]) {
    let [a, b, c] = columns.each_ref().map(Vec::as_slice);
    assert!(a.len().is_multiple_of(16) && !a.is_empty());
    for found in on_each(|| Sums([a, b, c])) {
        for (index, found) in found.into_iter().enumerate() {
            let (a, b, c) = (a[index], b[index], c[index]);
            let wanted = libm::fma(a, b, c);
            let is_same = found.to_bits() == wanted.to_bits();
            assert!(
                is_same || found.is_nan() && wanted.is_nan(),
                "{a:e} {b:e} {c:e}: {found:e} {wanted:e}"
            );
        }
    }
    let singles = columns
        .each_ref()
        .map(|column| -> Vec<f32> { column.iter().map(|value| *value as f32).collect() });
    let [a, b, c] = singles.each_ref().map(Vec::as_slice);
    for found in on_each(|| Sums([a, b, c])) {
        for (index, found) in found.into_iter().enumerate() {
            let (a, b, c) = (a[index], b[index], c[index]);
            let wanted = libm::fmaf(a, b, c);
            let is_same = found.to_bits() == wanted.to_bits();
            assert!(
                is_same || found.is_nan() && wanted.is_nan(),
                "{a:e} {b:e} {c:e}: {found:e} {wanted:e}"
            );
        }
    }
}

#[test]
fn the_bits_are_those_of_the_exact_sum_rounded_once() {
    let mut random = Random::new(8);
    let mut columns = [(); 3].map(|()| Vec::new());
    for index in 0..2_000_000 {
        // Sums that cancel, by a little and wholly, and sizes from one to ones far apart.
        let spread = [0.0, 0.3, 3.0, 30.0, 250.0][index % 5];
        let mut any = || random.normal() * libm::exp2(random.uniform(-spread, spread));
        let (a, b, other) = (any(), any(), any());
        let c = match index % 3 {
            0 => other,
            1 => -a * b,
            _ => -a * b * (1.0 + other * 1e-15),
        };
        columns.iter_mut().zip([a, b, c]).for_each(|(column, value)| column.push(value));
    }
    assert_rounded_once(&columns);
}

#[test]
fn ends_and_zeros_are_no_exceptions() {
    let ends = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-308,
        5e-324,
        -5e-324,
        1e-160,
        1e160,
        -1e160,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
        0.1,
        -3.3e-16,
    ];
    let mut columns = [(); 3].map(|()| Vec::new());
    for a in ends {
        for b in ends {
            for c in ends {
                columns.iter_mut().zip([a, b, c]).for_each(|(column, value)| column.push(value));
            }
        }
    }
    assert_rounded_once(&columns);
}
