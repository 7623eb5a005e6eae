//! Numbers as text.

use super::{
    decimals::{LARGE_POWERS, POWERS},
    sheet::Sheet,
};
use std::io::Write;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// Numbers that are made ready at once: their digits stay in the nearest cache.
pub(super) const ROWS: usize = 64;

/// Some numbers of a column, ready to be written: the fewest digits that bring each back bit for bit.
#[derive(Clone, Debug)]
pub(super) struct Digits {
    /// The first of 17 digits.
    first: [u8; ROWS],
    /// How many of them are decimals; [`NONE`] for numbers that are written otherwise.
    decimals: [u8; ROWS],
    /// The other digits, in two halves; once ready a byte each, the first one in the lowest.
    others: [[u64; ROWS]; 2],
}

/// No number has so many decimals.
const NONE: u8 = u8::MAX;

/// Makes numbers ready in registers of any width.
struct Making<'a> {
    values: &'a [f64],
    digits: &'a mut Digits,
}

impl WithSimd for Making<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { values, digits } = self;
        for (row, value) in values.iter().enumerate().take(ROWS) {
            // Powers of two have nearer neighbours below, and numbers beyond are rare.
            let is_power_of_two = value.to_bits() << 12 == 0;
            let is_usual = (1e-5..1e15).contains(&value.abs()) && !is_power_of_two;
            let (own, decimals) = shortest(if is_usual { *value } else { 1.5 });
            let (first, others) = (own / POWERS[16], own % POWERS[16]);
            digits.first[row] = first as u8;
            digits.decimals[row] = if is_usual { decimals } else { NONE };
            digits.others[0][row] = others / POWERS[8];
            digits.others[1][row] = others % POWERS[8];
        }
        for half in &mut digits.others {
            // What is left from before is no number any more.
            half[values.len().min(ROWS)..].fill(0);
            for number in half {
                *number = digits_of_eight(*number);
            }
        }
    }
}

impl Default for Digits {
    fn default() -> Self {
        Self { first: [0; ROWS], decimals: [NONE; ROWS], others: [[0; ROWS]; 2] }
    }
}

impl Digits {
    /// Makes numbers ready, at most [`ROWS`].
    pub(super) fn make(&mut self, values: &[f64]) {
        on_widest(Making { values, digits: self });
    }

    /// Writes the number that was made ready in this place, without an exponent: what its `Display` writes,
    /// several times faster where most numbers are.
    #[inline]
    pub(super) fn push(&self, out: &mut Sheet, row: usize, value: f64) {
        if self.decimals[row] == NONE {
            // A sheet takes all that is written to it.
            let _ = write!(out, "{value}");
            return;
        }
        let place = out.room();
        place[0] = b'-';
        let sign = usize::from(value < 0.0);
        let length = self.write(row, &mut place[sign..]);
        out.advance(sign + length);
    }

    /// Writes digits without zeros at their end, and the point among them; how many bytes that takes. All is
    /// put where it belongs from registers, since what was just written is slow to read again.
    #[inline]
    fn write(&self, row: usize, out: &mut [u8]) -> usize {
        let (first, decimals) = (self.first[row], usize::from(self.decimals[row]));
        let figures = u128::from(self.others[0][row]) | (u128::from(self.others[1][row]) << 64);
        // The last digit is in the highest byte.
        let zeros = (figures.leading_zeros() / 8) as usize;
        let zero = u128::from(EACH * u64::from(b'0'));
        let figures = figures | zero | (zero << 64);
        let has_first = usize::from(first > 0);
        let count = 16 + has_first;
        let mut put = |at: usize, figures: u128| {
            out[at..at + 16].copy_from_slice(&figures.to_le_bytes());
        };
        if decimals < count {
            // The figures before the point, and those behind it. Where there is no first of 17, another comes
            // to stand in its place.
            let before = count - decimals;
            let own = before - has_first;
            put(0, u128::from(b'0' + first));
            put(has_first, figures);
            put(before + 1, figures >> (8 * own));
            out[before] = b'.';
            return if zeros + own >= 16 { before } else { count + 1 - zeros };
        }
        let begin = 2 + decimals - count;
        put(0, u128::from_le_bytes(*b"0.00000000000000"));
        put(begin, u128::from(b'0' + first));
        put(begin + has_first, figures);
        begin + count - zeros
    }
}

/// What brings a double's last bit, `2^-bits`, to between 1 and 10, by `bits`: the exponent of the power of ten
/// that does, and `2^53` times what the last bit then is, which is a whole number.
const SCALES: [(u8, u64); 70] = {
    let mut scales = [(0, 0); 70];
    let (mut bits, mut decimals) = (3, 0);
    while bits < scales.len() {
        while LARGE_POWERS[decimals] < 1 << bits {
            decimals += 1;
        }
        scales[bits] = (decimals as u8, ((LARGE_POWERS[decimals] << 53) >> bits) as u64);
        bits += 1;
    }
    scales
};

/// The shortest whole number of 16 or 17 digits, zeros at its end not counted, that over 10 to the second
/// number is nearer to a double than to its neighbours; of two as near the larger one, which is what `Display`
/// takes. For doubles from 1e-5 to 1e15 nothing is rounded on the way: there are at most 49 bits behind the
/// point, those of half the last bit of `1e-5`, scaled.
#[inline(always)]
fn shortest(value: f64) -> (u64, u8) {
    const BEHIND: u32 = 50;
    let (fraction, exponent) = parts(value);
    let (decimals, last) = SCALES[exponent.unsigned_abs() as usize];
    let scaled = u128::from(fraction << 11) * u128::from(last);
    let (whole, rest) = ((scaled >> 64) as u64, scaled as u64);
    // Of numbers that end with a zero at most one is near enough.
    let tens = 10 * (whole / 10);
    let above = ((whole - tens) << BEHIND) | (rest >> (64 - BEHIND));
    let below = (10 << BEHIND) - above;
    // Halfway to the neighbours belongs to even fractions.
    let reach = (last >> (54 - BEHIND)) + u64::from(fraction % 2 == 0);
    let nearest = whole + (rest >> 63);
    let digits = if below < reach { tens + 10 } else { nearest };
    (if above < reach { tens } else { digits }, decimals)
}

/// The digits of a number below 10^8, the first one in the lowest byte: halves, then pairs, then single ones,
/// all at once. `109951163 / 2^40`, `10486 / 2^20` and `103 / 2^10` are the parts of 10 000, 100 and 10 closely
/// enough.
#[inline(always)]
fn digits_of_eight(number: u64) -> u64 {
    let thousands = (number * 109_951_163) >> 40;
    let halves = thousands | ((number - 10_000 * thousands) << 32);
    let hundreds = ((halves * 10_486) >> 20) & 0x0000_007F_0000_007F;
    let pairs = hundreds | ((halves - 100 * hundreds) << 16);
    let tens = ((pairs * 103) >> 10) & 0x000F_000F_000F_000F;
    tens | ((pairs - 10 * tens) << 8)
}

/// A one in each of eight bytes.
const EACH: u64 = 0x0101_0101_0101_0101;

/// A number that is not tiny as a whole number and the exponent of the power of two that it is multiplied by.
#[inline(always)]
fn parts(value: f64) -> (u64, i32) {
    const BITS: u32 = f64::MANTISSA_DIGITS - 1;
    let bits = value.abs().to_bits();
    let fraction = (bits & ((1 << BITS) - 1)) | (1 << BITS);
    // The exponent is told from -1023 on, that of the first bit.
    (fraction, (bits >> BITS) as i32 - 1023 - BITS as i32)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    /// Numbers of all kinds.
    pub(in super::super) fn numbers() -> Vec<f64> {
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
        numbers
    }

    #[test]
    fn digits_are_those_of_display() {
        let (mut out, mut digits) = (Sheet::default(), Digits::default());
        for numbers in numbers().chunks(ROWS) {
            digits.make(numbers);
            for (row, number) in numbers.iter().enumerate() {
                out.begin(0);
                digits.push(&mut out, row, *number);
                assert_eq!(std::str::from_utf8(out.text()).unwrap(), number.to_string());
            }
        }
    }
}
