//! Whether a distortion polynomial folds the picture over somewhere between the axis and a point.

/// Halvings after which a polynomial that still might touch 0 counts as doing so.
const MOST_HALVINGS: usize = 30;

/// Whether the polynomial `c0 + c1 s + c2 s^2 …` stays above 0 for every `s` from 0 to `end`.
///
/// The Bernstein coefficients on an interval bound the polynomial there from both sides; where they
/// do not decide, the interval is halved (de Casteljau).
pub(super) fn stays_positive<const N: usize>(coefficients: [f64; N], end: f64) -> bool {
    let mut scaled = coefficients;
    let (mut power, mut surely) = (1.0, scaled[0]);
    for value in &mut scaled {
        *value *= power;
        power *= end;
    }
    // What falls falls most at the end: most calls are decided here.
    for value in &scaled[1..] {
        surely += (value - value.abs()) / 2.0;
    }
    if surely > 0.0 {
        return true;
    }
    let degree = N - 1;
    let bernstein: [f64; N] = std::array::from_fn(|place| {
        let (mut sum, mut share) = (0.0, 1.0);
        for (power, value) in scaled.iter().enumerate().take(place + 1) {
            sum += share * value;
            share *= (place - power) as f64 / (degree - power).max(1) as f64;
        }
        sum
    });
    positive_between(bernstein, MOST_HALVINGS)
}

fn positive_between<const N: usize>(bernstein: [f64; N], halvings: usize) -> bool {
    // The first and the last are values of the polynomial. Not-a-number is not positive.
    let above = |value: &f64| *value > 0.0;
    if !above(&bernstein[0]) || !above(&bernstein[N - 1]) {
        return false;
    }
    if bernstein.iter().all(above) {
        return true;
    }
    if halvings == 0 {
        return false;
    }
    let (mut left, mut right) = (bernstein, bernstein);
    for (level, first) in left.iter_mut().enumerate().skip(1) {
        for place in 0..N - level {
            right[place] = (right[place] + right[place + 1]) / 2.0;
        }
        *first = right[0];
    }
    positive_between(left, halvings - 1) && positive_between(right, halvings - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dips_between_the_ends_are_found() {
        // (s - 1)^2 + gap has its least value, the gap, at s = 1.
        for (gap, positive) in [(1e-3, true), (-1e-3, false), (0.5, true), (-0.5, false)] {
            assert_eq!(stays_positive([1.0 + gap, -2.0, 1.0], 2.0), positive, "gap {gap}");
            // Times (1 + s)^2, which changes no sign.
            let quartic = [1.0 + gap, 2.0 * gap, gap - 2.0, 0.0, 1.0];
            assert_eq!(stays_positive(quartic, 3.0), positive, "quartic, gap {gap}");
        }
        assert!(stays_positive([1.0, -2.0, 1.0], 0.9) && !stays_positive([1.0, -2.0], 0.6));
        assert!(!stays_positive([1.0, f64::NAN], 0.6));
    }
}
