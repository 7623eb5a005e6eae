//! Text as numbers.

/// Reads the number that begins at a place, and where it ends: the nearest to a sign, digits and decimals,
/// as `str::parse` has it. None for other numbers, for more digits than 19, and close to the end of all.
#[inline]
pub(super) fn number_at(bytes: &[u8], begin: usize) -> Option<(f64, usize)> {
    let negative = bytes.get(begin) == Some(&b'-');
    let first = begin + usize::from(negative);
    let (mut whole, mut at) = digits_at(bytes, 0, first)?;
    let (mut count, mut decimals) = (at - first, 0);
    if bytes.get(at) == Some(&b'.') {
        let point = at + 1;
        (whole, at) = digits_at(bytes, whole, point)?;
        decimals = at - point;
        count += decimals;
    }
    // Nineteen nines are below 2^64.
    if !(1..=19).contains(&count) {
        return None;
    }
    let value = quotient(whole, decimals);
    Some((if negative { -value } else { value }, at))
}

/// Goes on with a whole number by the digits that begin at a place, and where they end; the number means
/// nothing where it has more digits than 19.
#[inline]
fn digits_at(bytes: &[u8], mut whole: u64, mut at: usize) -> Option<(u64, usize)> {
    loop {
        let chunk = u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?);
        // Digits become 0 to 9, and of all else the highest bit becomes 1.
        let own = chunk ^ EACH.wrapping_mul(0x30);
        let others = ((own & EACH.wrapping_mul(0x7F)).wrapping_add(EACH.wrapping_mul(0x76)) | own)
            & (EACH << 7);
        let count = others.trailing_zeros() / 8;
        if count == 0 {
            return Some((whole, at));
        }
        // With zeros before them they are eight.
        let value = eight_digits(own << (64 - 8 * count));
        whole = whole.wrapping_mul(POWERS[count as usize]).wrapping_add(value);
        at += count as usize;
        if count < 8 {
            return Some((whole, at));
        }
    }
}

/// A one in each of eight bytes.
const EACH: u64 = 0x0101_0101_0101_0101;

/// The number of eight digits a byte each, the first one in the lowest: pairs of digits, then pairs of those,
/// which two products add up in their upper halves.
#[inline]
fn eight_digits(digits: u64) -> u64 {
    const PAIRS: u64 = 0x0000_00FF_0000_00FF;
    let pairs = digits.wrapping_mul(10).wrapping_add(digits >> 8);
    let odd = (pairs & PAIRS).wrapping_mul(100 + (1_000_000 << 32));
    let even = ((pairs >> 16) & PAIRS).wrapping_mul(1 + (10_000 << 32));
    odd.wrapping_add(even) >> 32
}

/// Powers of ten.
pub(super) const LARGE_POWERS: [u128; 22] = {
    let mut powers = [1; 22];
    let mut index = 1;
    while index < powers.len() {
        powers[index] = 10 * powers[index - 1];
        index += 1;
    }
    powers
};

/// Those that fit.
pub(super) const POWERS: [u64; 20] = {
    let mut powers = [1; 20];
    let mut index = 1;
    while index < powers.len() {
        powers[index] = LARGE_POWERS[index] as u64;
        index += 1;
    }
    powers
};

/// A power of ten to divide by: moved up to the highest bit, by so many bits; and `(2^128 - 1) / moved - 2^64`.
#[derive(Clone, Copy)]
struct Divisor {
    moved: u64,
    up: u32,
    reciprocal: u64,
}

const DIVISORS: [Divisor; POWERS.len()] = {
    let mut divisors = [Divisor { moved: 0, up: 0, reciprocal: 0 }; POWERS.len()];
    let mut index = 0;
    while index < divisors.len() {
        let up = POWERS[index].leading_zeros();
        let moved = POWERS[index] << up;
        divisors[index] = Divisor { moved, up, reciprocal: (u128::MAX / moved as u128) as u64 };
        index += 1;
    }
    divisors
};

impl Divisor {
    /// Half of a whole number times 2^64 over this, both with their highest bits, and whether more is left:
    /// algorithm 4 of Möller & Granlund 2011, doi:10.1109/TC.2010.143.
    #[inline]
    fn half(self, whole: u64) -> (u64, bool) {
        let (high, low) = (whole >> 1, whole << 63);
        let first = u128::from(self.reciprocal) * u128::from(high)
            + ((u128::from(high) << 64) | u128::from(low));
        let mut quotient = ((first >> 64) as u64).wrapping_add(1);
        let mut rest = low.wrapping_sub(quotient.wrapping_mul(self.moved));
        if rest > first as u64 {
            quotient = quotient.wrapping_sub(1);
            rest = rest.wrapping_add(self.moved);
        }
        if rest >= self.moved {
            (quotient, rest) = (quotient.wrapping_add(1), rest - self.moved);
        }
        (quotient, rest > 0)
    }
}

/// The double nearest to a whole number over a power of ten of at most 19.
#[inline]
fn quotient(whole: u64, decimals: usize) -> f64 {
    // Powers of ten up to 10^22 are doubles, and so are whole numbers up to here: one division of doubles is
    // rounded once.
    if whole <= 1 << f64::MANTISSA_DIGITS || decimals == 0 {
        return whole as f64 / POWERS[decimals] as f64;
    }
    // A quotient of 63 or 64 bits, of which the last says whether there is more, is rounded once as well, when
    // it becomes a double.
    let (divisor, up) = (DIVISORS[decimals], whole.leading_zeros());
    let (quotient, more) = divisor.half(whole << up);
    // The numbers are neither tiny nor large: their exponent is in the double's range.
    let exponent = i64::from(divisor.up) - i64::from(up) - 63;
    (quotient | u64::from(more)) as f64 * f64::from_bits(((exponent + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::super::digits::tests::numbers;
    use super::*;
    use wheatstone_numeric::random::Random;

    /// What is read of a text, with something behind it.
    fn read(text: &str) -> Option<f64> {
        let (value, end) = number_at(format!("{text},1.25,3\n\n").as_bytes(), 0)?;
        (end == text.len()).then_some(value)
    }

    #[test]
    fn numbers_are_those_of_the_standard_library() {
        let mut random = Random::new(9);
        let mut texts: Vec<String> = numbers().iter().map(f64::to_string).collect();
        // Any digits, also such that lie halfway between two doubles.
        for _ in 0..300_000 {
            let whole = ((random.below(1 << 32) as u64) << 32) | random.below(1 << 32) as u64;
            let (digits, decimals) = (whole >> random.below(64), random.below(20));
            let mut text = format!("{digits:020}");
            text.insert(20 - decimals, '.');
            texts.push(text.trim_start_matches('0').to_owned());
            let below_one = f64::from_bits((whole >> 12) | (0x3FE << 52));
            texts.push(format!("{below_one:.*}", random.below(19)));
            let halfway = (1 << 53) | (whole >> 11) | 1;
            texts.push(format!("{halfway}.0"));
            texts.push(format!("{}.5", halfway >> 1));
        }
        texts.extend(
            ["1.", ".5", "-0", "-.25", "0.0", "9999999999999999999", "1844674407370955161.9"]
                .map(String::from),
        );
        let mut known = 0;
        for text in &texts {
            if let Some(value) = read(text) {
                known += 1;
                let expected: f64 = text.parse().unwrap();
                assert_eq!(value.to_bits(), expected.to_bits(), "{text}");
            }
        }
        assert!(known > texts.len() / 2, "{known}");
        for other in [
            "",
            "-",
            ".",
            "-.",
            "+1",
            "1e5",
            "nan",
            "inf",
            "1.2.3",
            "1 ",
            "x",
            "12345678901234567890",
        ] {
            assert_eq!(read(other), None, "{other}");
        }
    }
}
