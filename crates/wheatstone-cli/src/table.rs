//! Plain tables: first column to the left, figures to the right.

/// Lays out rows under a heading.
pub(crate) fn table(heading: &[&str], rows: &[Vec<String>]) -> String {
    let mut widths: Vec<usize> = heading.iter().map(|cell| cell.chars().count()).collect();
    for row in rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let line = |cells: &[String]| {
        let padded: Vec<String> =
            cells
                .iter()
                .zip(&widths)
                .enumerate()
                .map(|(column, (cell, width))| {
                    if column == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
                })
                .collect();
        format!("  {}\n", padded.join("  ").trim_end())
    };
    let heading: Vec<String> = heading.iter().map(|cell| (*cell).to_owned()).collect();
    let rule: Vec<String> = widths.iter().map(|width| "-".repeat(*width)).collect();
    let body: String = rows.iter().map(|row| line(row)).collect();
    line(&heading) + &line(&rule) + &body
}

/// Three significant digits, so that figures of all sizes read alike.
pub(crate) fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = value.abs();
    if !(1e-4..1e6).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let places = [100.0, 10.0, 1.0, 0.1, 0.01].iter().filter(|step| magnitude < **step).count();
    format!("{value:.places$}")
}

/// A value with its standard deviation, both to two digits of that.
pub(crate) fn with_sigma(value: f64, sigma: f64) -> String {
    /// More say nothing.
    const MOST: f64 = 9.0;
    if !(sigma > 0.0 && sigma.is_finite()) {
        return figure(value);
    }
    let places = (1.0 - sigma.log10().floor()).clamp(0.0, MOST) as usize;
    format!("{value:.places$} ± {sigma:.places$}")
}

/// A figure, or a dash where there is none.
pub(crate) fn figure_or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), figure)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        for (value, text) in [
            (0.0123456, "0.0123"),
            (0.5, "0.500"),
            (12.345, "12.3"),
            (1234.5, "1234"),
            (3e-7, "3.00e-7"),
        ] {
            assert_eq!(figure(value), text);
        }
    }

    #[test]
    fn values_are_rounded_by_their_standard_deviation() {
        for (value, sigma, text) in [
            (3.148_31, 0.002_14, "3.1483 ± 0.0021"),
            (-0.05, 0.1, "-0.05 ± 0.10"),
            (1234.5, 120.0, "1234 ± 120"),
            (1234.5, 0.0, "1234"),
        ] {
            assert_eq!(with_sigma(value, sigma), text);
        }
    }

    #[test]
    fn columns_line_up() {
        let text = table(&["a", "rms"], &[vec!["long name".into(), "1".into()]]);
        assert_eq!(text, "  a          rms\n  ---------  ---\n  long name    1\n");
    }
}
