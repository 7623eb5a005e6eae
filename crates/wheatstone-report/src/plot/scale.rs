//! From values to places along an axis, and where its marks go.

use super::super::text::figure;

/// One axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Scale {
    /// From the least to the greatest value, widened a little; from nought where `from_zero`.
    pub(crate) fn around(values: impl Iterator<Item = f64>, from_zero: bool) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| value.is_finite()) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if from_zero {
            low = low.min(0.0);
        }
        let room = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1e-9) };
        let foot = if from_zero && low == 0.0 { 0.0 } else { room };
        Self { low: low - foot, high: high + room, logarithmic: false }
    }

    /// Exactly from `low` to `high`.
    pub(crate) fn exactly(low: f64, high: f64) -> Self {
        Self { low, high, logarithmic: false }
    }

    /// Powers of ten, around positive values.
    pub(crate) fn logarithmic(values: impl Iterator<Item = f64>) -> Self {
        let logarithms = values.filter(|value| *value > 0.0).map(libm::log10);
        let Self { low, high, .. } = Self::around(logarithms, false);
        Self { low, high: high.max(low + 0.3), logarithmic: true }
    }

    /// Where a value lies, 0 to 1 from one end to the other.
    pub(crate) fn share(&self, value: f64) -> f64 {
        let value = if self.logarithmic { libm::log10(value.max(1e-300)) } else { value };
        (value - self.low) / (self.high - self.low)
    }

    /// Round values with their labels, about `count` of them.
    pub(crate) fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        if self.logarithmic {
            return self.decades();
        }
        let (low, high) = (self.low.min(self.high), self.low.max(self.high));
        let rough = (high - low) / count.max(1) as f64;
        let power = libm::exp10(libm::floor(libm::log10(rough)));
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        let step = steps.into_iter().find(|step| *step >= rough * 0.999).unwrap_or(rough);
        let first = libm::ceil(low / step - 1e-9) as i64;
        let last = libm::floor(high / step + 1e-9) as i64;
        let places = (-libm::floor(libm::log10(step) + 1e-9)).clamp(0.0, 12.0) as usize;
        let label = |number: i64| {
            let value = number as f64 * step;
            if number != 0 && !(1e-4..1e6).contains(&value.abs().max(step)) {
                format!("{value:.1e}")
            } else {
                format!("{value:.places$}")
            }
        };
        (first..=last.min(first + 50)).map(|n| (n as f64 * step, label(n))).collect()
    }

    fn decades(&self) -> Vec<(f64, String)> {
        let exponents = libm::floor(self.low) as i32..=libm::ceil(self.high) as i32;
        let parts: &[f64] = match self.high - self.low {
            range if range > 3.0 => &[1.0],
            range if range > 1.2 => &[1.0, 3.0],
            _ => &[1.0, 2.0, 3.0, 5.0, 7.0],
        };
        exponents
            .flat_map(|exponent| parts.iter().map(move |part| part * libm::exp10(exponent.into())))
            .filter(|value| (-1e-9..=1.0 + 1e-9).contains(&self.share(*value)))
            .map(|value| (value, plain(value)))
            .collect()
    }
}

/// A round value without trailing noughts.
fn plain(value: f64) -> String {
    let text = figure(value);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

/// The power of ten times 1, 2 or 5 that is next below a value.
pub(crate) fn round_below(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let power = libm::exp10(libm::floor(libm::log10(value)));
    [5.0, 2.0, 1.0].map(|step| step * power).into_iter().find(|it| *it <= value).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::Scale;

    #[test]
    fn marks_are_round_and_inside() {
        let scale = Scale::around([0.0, 1.0].into_iter(), true);
        let labels: Vec<String> = scale.ticks(5).into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0.0", "0.5", "1.0"]);
        let downwards = Scale::exactly(480.0, -0.5).ticks(5);
        assert_eq!(downwards[0].1, "0");
        assert_eq!(downwards[1].1, "100");
        let scale = Scale::logarithmic([0.02, 4.0].into_iter());
        let labels: Vec<String> = scale.ticks(5).into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0.03", "0.1", "0.3", "1", "3"]);
        for odd in [[f64::NAN, f64::NAN], [5.0, 5.0], [-1e9, 1e9], [1e-12, 2e-12]] {
            let scale = Scale::around(odd.into_iter(), false);
            let ticks = scale.ticks(5);
            assert!(!ticks.is_empty() && ticks.len() < 15, "{odd:?}: {ticks:?}");
            assert!(ticks.iter().all(|(v, _)| (-0.001..=1.001).contains(&scale.share(*v))));
        }
    }
}
