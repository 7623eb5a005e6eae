//! Numbers as other programs read and write them.

use super::InputFile;
use wheatstone_core::Result;

/// A number with as many digits as bring it back bit for bit, always with a decimal point, so that every
/// YAML reader takes it for a number (YAML 1.1 takes `1e-7` for text).
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.split_once('e') {
        None => text,
        Some((digits, exponent)) => {
            let point = if digits.contains('.') { "" } else { ".0" };
            let sign = if exponent.starts_with('-') { "" } else { "+" };
            format!("{digits}{point}e{sign}{exponent}")
        }
    }
}

/// Several of them.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>, between: &str) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(between)
}

/// A number that is finite, and not so large that its square overflows.
pub(super) fn finite(text: &str, file: &InputFile, line: u64) -> Result<f64> {
    const LARGEST: f64 = 1e100;
    match text.trim().parse::<f64>() {
        Ok(value) if value.abs() <= LARGEST => Ok(value),
        Ok(_) => Err(file.error(line, format!("`{text}` is not a finite number"), "")),
        Err(_) => {
            let shown: String = text.chars().take(40).collect();
            Err(file.error(
                line,
                format!("`{shown}` is not a number"),
                "write numbers with a decimal point and without units",
            ))
        }
    }
}

/// Lines that hold something, with their numbers from 1; what follows a `#` is left out.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (u64, &str)> {
    text.lines()
        .zip(1_u64..)
        .map(|(whole, number)| (number, whole.split('#').next().unwrap_or("").trim()))
        .filter(|(_, content)| !content.is_empty())
}

/// All numbers of a line, separated by spaces or commas.
pub(super) fn row(content: &str, file: &InputFile, line: u64) -> Result<Vec<f64>> {
    let cells = content.split(|c: char| c.is_whitespace() || c == ',').filter(|c| !c.is_empty());
    cells.map(|cell| finite(cell, file, line)).collect()
}
