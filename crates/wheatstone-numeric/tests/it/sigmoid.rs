//! Exponentials and sigmoids beside the exact ones.

use wheatstone_numeric::sigmoid::{exp, sigmoid};

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
