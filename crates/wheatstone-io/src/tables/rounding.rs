//! Numbers rounded to what they mean.

use super::writer::Kind;
use std::path::Path;

/// Digits that are kept beyond the first one of a standard deviation.
const BEYOND: i32 = 3;

/// Exponents of ten that are exact, up and down.
const EXACT: i32 = 22;

/// Whether a table of this name is text, whose numbers are read by people too; Parquet and Arrow keep all bits.
#[must_use]
pub fn is_text(path: &Path) -> bool {
    matches!(Kind::of(path), Kind::Text | Kind::GzippedText)
}

/// Rounds each value to three digits beyond the first one of its standard deviation: what is cut off is
/// less than a thousandth of that. Values whose standard deviation is not known stay as they are.
pub fn round_to_sigma(values: &mut [f64], sigmas: &[f64]) {
    for (value, sigma) in values.iter_mut().zip(sigmas) {
        if let Some(digits) = decimals(*sigma) {
            *value = rounded(*value, digits);
        }
    }
}

/// Digits behind the decimal point that a standard deviation leaves; none where it is 0 or no number.
fn decimals(sigma: f64) -> Option<i32> {
    if !(sigma.is_finite() && sigma > 0.0) {
        return None;
    }
    // The power of ten of its first digit, by the exact powers.
    let first = (-EXACT..=EXACT).rev().find(|power| power_of_ten(*power) <= sigma)?;
    Some(BEYOND - first).filter(|digits| digits.abs() <= EXACT)
}

fn power_of_ten(power: i32) -> f64 {
    if power < 0 { 1.0 / 10f64.powi(-power) } else { 10f64.powi(power) }
}

fn rounded(value: f64, decimals: i32) -> f64 {
    // Powers above 1 are exact, and a quotient by one is the number that the shortest decimal reads as.
    let scale = power_of_ten(decimals.abs());
    let found = if decimals >= 0 {
        (value * scale).round() / scale
    } else {
        (value / scale).round() * scale
    };
    // No minus stays before a 0.
    if found.is_finite() { found + 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_beyond_the_first_of_sigma_stay() {
        for (value, sigma, text) in [
            (12.345_678_901, 0.0123, "12.34568"),
            (12.345_678_901, 0.099, "12.34568"),
            (12.345_678_901, 0.1, "12.3457"),
            (-0.000_123_456_789, 1.0, "0"),
            (98_765.432_1, 2_345.0, "98765"),
            (98_765_432.1, 234_567.0, "98765400"),
            (1.0 / 3.0, f64::NAN, "0.3333333333333333"),
            (1.0 / 3.0, 0.0, "0.3333333333333333"),
        ] {
            let mut values = [value];
            round_to_sigma(&mut values, &[sigma]);
            assert_eq!(values[0].to_string(), text, "{value} +- {sigma}");
        }
    }

    #[test]
    fn what_is_cut_off_is_less_than_a_thousandth_of_sigma() {
        for step in 0..2000 {
            let (value, sigma) = (f64::from(step) * 0.731 - 700.0, 1e-4 * 1.01_f64.powi(step));
            let mut values = [value];
            round_to_sigma(&mut values, &[sigma]);
            assert!((values[0] - value).abs() <= 0.000_501 * sigma, "{value} +- {sigma}");
            let again = values;
            round_to_sigma(&mut values, &[sigma]);
            assert_eq!(values, again);
        }
    }
}
