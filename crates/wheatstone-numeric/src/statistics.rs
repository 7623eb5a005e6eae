//! Summaries of samples: root mean square, mean, median, percentiles; and what chance alone makes of a
//! sum of squares.

/// Root of the mean square; 0 for no values.
#[must_use]
pub fn root_mean_square(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Arithmetic mean; 0 for no values.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// The value below which `share` (0..=1) of the sample lies, interpolated linearly between order
/// statistics as most software does (type 7 of Hyndman & Fan, doi:10.1080/00031305.1996.10473566);
/// 0 for no values.
#[must_use]
pub fn percentile(values: &[f64], share: f64) -> f64 {
    let mut values = values.to_vec();
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let position = share.clamp(0.0, 1.0) * last as f64;
    let below = position.floor() as usize;
    let (_, least, more) = values.select_nth_unstable_by(below, f64::total_cmp);
    let (least, next) = (*least, more.iter().copied().min_by(f64::total_cmp));
    least + (next.unwrap_or(least) - least) * (position - below as f64)
}

/// The middle of the sample; 0 for no values.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    percentile(values, 0.5)
}

/// The probability that a chi-square variable exceeds `value`: one minus the regularised incomplete
/// gamma function of `freedom / 2` and `value / 2`, by its series below the mean and by its continued
/// fraction above (Abramowitz & Stegun 1964, 6.5.29 and 6.5.31; the fraction evaluated as in Lentz 1976,
/// doi:10.1364/AO.15.000668).
#[must_use]
pub fn chi_square_beyond(value: f64, freedom: usize) -> f64 {
    const MOST_TERMS: usize = 1000;
    if value <= 0.0 || freedom == 0 {
        return if value <= 0.0 { 1.0 } else { 0.0 };
    }
    let (a, x) = (freedom as f64 / 2.0, value / 2.0);
    let scale = libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for n in 1..MOST_TERMS {
            term *= x / (a + n as f64);
            sum += term;
            if term < sum * f64::EPSILON {
                break;
            }
        }
        return (1.0 - scale * sum).clamp(0.0, 1.0);
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (f64::MAX, 1.0 / b);
    let mut fraction = d;
    for n in 1..MOST_TERMS {
        let n = n as f64;
        let numerator = n * (a - n);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    (scale * fraction).clamp(0.0, 1.0)
}

/// The value that a chi-square variable exceeds with probability `rate` (above 0 and below 1): Newton's steps on
/// the logarithm of [`chi_square_beyond`], halving where they leave what encloses it; infinite for a rate of 0.
#[must_use]
pub fn chi_square_upper_quantile(rate: f64, freedom: usize) -> f64 {
    if rate <= 0.0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, freedom as f64 + 1.0);
    while chi_square_beyond(high, freedom) > rate {
        (low, high) = (high, 2.0 * high);
    }
    let a = freedom as f64 / 2.0;
    let constant = libm::lgamma(a) + a * std::f64::consts::LN_2;
    let mut value = f64::midpoint(low, high);
    // Each halving gains a bit, each good step doubles them; a double has 53.
    for _ in 0..64 {
        let beyond = chi_square_beyond(value, freedom);
        if beyond > rate {
            low = value
        } else {
            high = value
        }
        let density = libm::exp((a - 1.0) * libm::log(value) - 0.5 * value - constant);
        let newton = value + beyond / density * libm::log(beyond / rate);
        let next = if low <= newton && newton <= high { newton } else { f64::midpoint(low, high) };
        let gap = (next - value).abs();
        value = next;
        if gap <= 4.0 * f64::EPSILON * value {
            break;
        }
    }
    value
}
