//! Numbers as text.

use std::io::Write;

/// Writes the fewest digits that bring a number back bit for bit, without an exponent: what its `Display`
/// writes, several times faster where most numbers are.
pub(super) fn push_number(out: &mut Vec<u8>, value: f64) {
    // Between these no exponent is written, and numbers beyond are rare.
    if (1e-5..1e15).contains(&value.abs()) {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(value);
        if !may_be_halfway(value, text) {
            return out.extend(text.strip_suffix(".0").unwrap_or(text).as_bytes());
        }
    }
    // A vector takes all that is written to it.
    let _ = write!(out, "{value}");
}

/// Whether a number may lie halfway between its digits and their neighbours. `Display` then rounds away from
/// zero and others to even; numbers that were single precision do so often.
fn may_be_halfway(value: f64, text: &str) -> bool {
    // With fewer digits than 15 they are the number's own.
    const LEAST: usize = 16;
    if text.len() < LEAST {
        return false;
    }
    let decimals = text.bytes().rev().position(|byte| byte == b'.').unwrap_or(0);
    // Halves of the last digit are whole multiples of this power of two, and scaling by it is exact.
    let scaled = value * f64::from(1_u32 << (decimals + 1).min(31));
    scaled == scaled.trunc()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::Random;

    #[test]
    fn digits_are_those_of_display() {
        let mut random = Random::new(8);
        let half = |random: &mut Random| random.below(1 << 32) as u64;
        let bits = |random: &mut Random| f64::from_bits((half(random) << 32) | half(random));
        let mut numbers: Vec<f64> = (0..100_000).map(|_| bits(&mut random)).collect();
        for exponent in -8..18 {
            let unit = 10_f64.powi(exponent);
            numbers.extend((0..10_000).map(|_| unit * random.uniform(-10.0, 10.0)));
            numbers.extend((1..100).map(|whole| unit * f64::from(whole)));
            numbers.extend([unit.next_down(), unit.next_up(), -unit]);
        }
        numbers.extend((0..200_000).map(|_| f64::from(random.uniform(0.0, 2000.0) as f32)));
        numbers.extend((0..100_000).map(|_| f64::from(random.uniform(0.0, 2.0) as f32)));
        numbers.extend([0.0, -0.0, f64::INFINITY, f64::NAN, f64::MIN_POSITIVE, f64::MAX]);
        for number in numbers {
            let mut out = Vec::new();
            push_number(&mut out, number);
            assert_eq!(String::from_utf8(out).unwrap(), number.to_string());
        }
    }
}
