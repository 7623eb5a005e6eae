//! Grey values to bytes, as many at once as registers hold.

use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// The least and the greatest value; infinite where there are none.
pub(super) fn extremes(values: &[f32]) -> (f32, f32) {
    on_widest(Extremes(values))
}

/// Each value less `offset`, times `factor`, rounded to a whole number from 0 to 255.
pub(super) fn bytes(values: &[f32], offset: f32, factor: f32) -> Vec<u8> {
    let mut bytes = vec![0; values.len()];
    on_widest(Bytes { values, offset, factor, bytes: &mut bytes });
    bytes
}

struct Extremes<'a>(&'a [f32]);

/// Numbers that are compared side by side, whatever the registers' width: four of the widest.
const SIDE_BY_SIDE: usize = 64;

impl WithSimd for Extremes<'_> {
    type Output = (f32, f32);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (f32, f32) {
        let (mut low, mut high) =
            ([f32::INFINITY; SIDE_BY_SIDE], [f32::NEG_INFINITY; SIDE_BY_SIDE]);
        let mut compare = |values: &[f32]| {
            for ((value, low), high) in values.iter().zip(&mut low).zip(&mut high) {
                *low = if *value < *low { *value } else { *low };
                *high = if *value > *high { *value } else { *high };
            }
        };
        let (whole, rest) = self.0.as_chunks::<SIDE_BY_SIDE>();
        for values in whole {
            compare(values);
        }
        compare(rest);
        let least = low.into_iter().fold(f32::INFINITY, f32::min);
        (least, high.into_iter().fold(f32::NEG_INFINITY, f32::max))
    }
}

struct Bytes<'a> {
    values: &'a [f32],
    offset: f32,
    factor: f32,
    bytes: &'a mut [u8],
}

impl WithSimd for Bytes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (byte, value) in self.bytes.iter_mut().zip(self.values) {
            // Where nothing is negative, to add a half and cut is to round.
            let value = ((value - self.offset) * self.factor + 0.5).clamp(0.0, 255.0);
            *byte = value as i32 as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_rounded_and_kept_within_bytes() {
        let mut values: Vec<f32> = (0..300).map(|value| value as f32 * 0.9 - 3.3).collect();
        values.extend([-0.4, 0.49, 0.5, 254.49, 254.5, 255.4, 400.0]);
        let expected: Vec<u8> = values.iter().map(|value| value.round() as u8).collect();
        assert_eq!(bytes(&values, 0.0, 1.0), expected);
        assert_eq!(bytes(&[10.0, 12.0, 11.0], 10.0, 127.5), [0, 255, 128]);
        assert_eq!(extremes(&values), (-3.3, 400.0));
        assert_eq!(extremes(&values[290..297]), (values[290], values[296]));
        assert_eq!(extremes(&[]), (f32::INFINITY, f32::NEG_INFINITY));
    }
}
