//! Figures and words as the page can hold them.

pub(super) use crate::html::{base64, escape, json};

/// Three significant digits, so that figures of all sizes read alike.
pub(super) fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "none".into();
    }
    let digits = libm::floor(libm::log10(value.abs())) as i32;
    if !(-4..6).contains(&digits) {
        return format!("{value:.2e}");
    }
    let places = (2 - digits).max(0) as usize;
    let text = format!("{value:.places$}");
    // Rounding up may have gained a digit: 9.999 is 10.0.
    match text.trim_start_matches('-').trim_start_matches("0.").find('.') {
        Some(point) if point + places > 3 => format!("{value:.*}", places - 1),
        _ => text,
    }
}

/// A distance as one says it: whole numbers, two digits below ten.
pub(super) fn round(value: f64) -> String {
    if value.abs() >= 10.0 && value.abs() < 1e6 {
        return format!("{value:.0}");
    }
    let text = figure(value);
    match text.strip_suffix(|c: char| c.is_ascii_digit()) {
        Some(shorter) if text.contains('.') && !text.contains('e') => {
            shorter.trim_end_matches('.').into()
        }
        _ => text,
    }
}

/// A share as whole percent.
pub(super) fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        for (value, text) in [
            (0.0123456, "0.0123"),
            (0.5, "0.500"),
            (9.999, "10.0"),
            (0.9999, "1.00"),
            (99.96, "100"),
            (12.345, "12.3"),
            (-1.5, "-1.50"),
            (1234.5, "1234"),
            (3e-7, "3.00e-7"),
            (0.0, "0"),
            (f64::NAN, "none"),
        ] {
            assert_eq!(figure(value), text);
        }
        for (value, text) in [(98.4, "98"), (100.0, "100"), (1.234, "1.2"), (0.97, "0.97")] {
            assert_eq!(round(value), text);
        }
    }
}
