//! Vectors at every width of registers.

use wheatstone_numeric::{
    sigmoid::sigmoid,
    simd::{Real, Simd, WithSimd, on_each},
};

struct Sigmoids<T>(Vec<T>);

impl<T: Real> WithSimd for Sigmoids<T> {
    type Output = Vec<T>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Vec<T> {
        for vector in T::vectors_mut::<S>(&mut self.0) {
            [*vector] = T::sigmoid(simd, [*vector]);
        }
        self.0
    }
}

#[test]
fn the_sigmoid_of_doubles_stays_within_its_stated_bound_at_every_width() {
    let mut values: Vec<f64> = (-70_000..70_000).map(|i| f64::from(i) * 1.000_37e-2).collect();
    values.extend([0.0, -0.0, 1e9, -1e9, f64::INFINITY, f64::NEG_INFINITY, 700.0, -701.0]);
    let all = on_each(|| Sigmoids(values.clone()));
    for (x, found) in values.iter().zip(&all[0]) {
        let exact = 1.0 / (1.0 + libm::exp(-x.clamp(-700.0, 700.0)));
        let apart = found.to_bits().abs_diff(exact.to_bits());
        assert!(apart <= 4, "sigmoid({x}) is {apart} units wrong");
    }
    assert!(all.iter().all(|other| *other == all[0]));
    let lost = on_each(|| Sigmoids(vec![f64::NAN; 16]));
    assert!(lost.iter().flatten().all(|value| value.is_nan()));
}

#[test]
fn the_sigmoid_of_singles_stays_within_its_stated_bound_at_every_width() {
    let mut values: Vec<f32> = (-600_000..600_000).map(|i| i as f32 * 2.000_37e-4).collect();
    values.extend([[1e30, -1e30, f32::INFINITY, f32::NEG_INFINITY]; 4].as_flattened());
    let all = on_each(|| Sigmoids(values.clone()));
    for (x, found) in values.iter().zip(&all[0]) {
        let error = (f64::from(*found) - sigmoid(f64::from(*x))).abs();
        assert!(error < 2e-7, "sigmoid({x}) is wrong by {error}");
    }
    assert!(all.iter().all(|other| *other == all[0]));
    let lost = on_each(|| Sigmoids(vec![f32::NAN; 16]));
    assert!(lost.iter().flatten().all(|value| value.is_nan()));
}
