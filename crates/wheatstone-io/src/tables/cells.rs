//! Cells of tables as numbers, and what is wrong with those that are none.

use std::path::Path;
use wheatstone_core::Error;

/// What libraries say of a file.
pub(super) type Foreign = Box<dyn std::error::Error>;

/// What is wrong with a cell, and what to do about it.
#[derive(Debug)]
pub(super) struct Fault {
    what: String,
    hint: &'static str,
}

/// Beyond this no pixel and no chart lies, but overflow does.
const LARGEST: f64 = 1e9;

/// Words for a number that there is not, in small letters.
const NOTHING: [&str; 8] = ["nan", "na", "n/a", "#n/a", "none", "null", "<na>", "-nan"];

/// A cell of text as a number; `None` where it holds none. A comma may stand for the decimal point where
/// it does not separate cells.
pub(super) fn number(text: &str, comma: bool) -> Result<Option<f64>, Fault> {
    let value = match text.parse::<f64>() {
        Ok(value) => value,
        Err(_) if text.is_empty() || NOTHING.contains(&&*text.to_ascii_lowercase()) => {
            return Ok(None);
        }
        Err(_) => otherwise_written(text, comma).ok_or_else(|| not_a_number(text))?,
    };
    place(value)
}

/// A number with a decimal comma, the minus sign of typesetters (U+2212) or an exponent of Fortran, `1.5D+02`.
fn otherwise_written(text: &str, comma: bool) -> Option<f64> {
    let plain = text.replace('\u{2212}', "-").replace(['D', 'd'], "e");
    let with_point = (comma && !plain.contains('.')).then(|| plain.replacen(',', ".", 1));
    with_point.unwrap_or(plain).parse().ok()
}

fn not_a_number(text: &str) -> Fault {
    if text.contains('\0') {
        return Fault {
            what: "has a zero byte, and looks like UTF-16".into(),
            hint: "save the table as UTF-8 (`CSV UTF-8` in a spreadsheet)",
        };
    }
    Fault {
        what: format!("is `{text}`, which is not a number"),
        hint: "write numbers with a decimal point and without units",
    }
}

/// A number where one can be a pixel or a length; `None` for NaN.
pub(super) fn place(value: f64) -> Result<Option<f64>, Fault> {
    if value.abs() <= LARGEST {
        return Ok(Some(value));
    }
    if value.is_nan() {
        return Ok(None);
    }
    Err(Fault {
        what: format!("is `{value}`, which is out of range"),
        hint: "remove the row, or leave the cells of a camera that did not see the point empty",
    })
}

/// A cell without its partner.
pub(super) fn half() -> Fault {
    Fault {
        what: "is empty, but its partner is not".into(),
        hint: "give both coordinates, or neither if the camera did not see the point",
    }
}

/// A standard deviation that is none.
pub(super) fn no_sigma(value: f64) -> Fault {
    let what = if value.is_nan() { "is empty".into() } else { format!("is `{value}`") };
    Fault {
        what: format!("{what}, which is no standard deviation"),
        hint: "give each pixel one above 0, in pixels; it may be empty where the camera did not see the point",
    }
}

impl Fault {
    /// As an error that says where.
    pub(super) fn at(self, path: &Path, line: Option<u64>, column: &str) -> Error {
        malformed(path, line, format!("column `{column}` {}", self.what), self.hint)
    }

    /// As an error that names a row, of a table without lines.
    pub(super) fn in_row(self, path: &Path, row: u64, column: &str) -> Error {
        malformed(path, None, format!("row {row}: column `{column}` {}", self.what), self.hint)
    }
}

/// A row of another length than the header; `may_split` where commas are the separator, and would cut numbers that
/// have a decimal comma in two.
pub(super) fn unequal(
    path: &Path,
    line: u64,
    (cells, header): (usize, usize),
    may_split: bool,
) -> Error {
    let problem = format!("{cells} cells, the header has {header}");
    let hint = if may_split && cells > header {
        "give every line as many cells as the header, unknown ones empty; where numbers have decimal commas, separate the columns by semicolons or tabs"
    } else {
        "give every line as many cells as the header; leave unknown ones empty"
    };
    malformed(path, Some(line), problem, hint)
}

/// A row that is no text.
pub(super) fn no_text(path: &Path, line: u64) -> Error {
    let hint =
        "is this the file that you meant? If so, save it as UTF-8 (`CSV UTF-8` in a spreadsheet)";
    malformed(path, Some(line), "not text (UTF-8)".into(), hint)
}

pub(super) fn malformed(path: &Path, line: Option<u64>, problem: String, hint: &str) -> Error {
    Error::Malformed { path: path.into(), line, problem, hint: hint.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_programs_and_typesetters_write_them() {
        for (text, comma, value) in [
            ("\u{2212}1.5", false, -1.5),
            ("1.5D+02", false, 150.0),
            ("-1.5d\u{2212}1", false, -0.15),
            ("\u{2212}1,5", true, -1.5),
        ] {
            assert_eq!(number(text, comma).unwrap(), Some(value), "{text}");
        }
        for text in ["D", "d1", "1D", "\u{2212}", "1\u{2212}2", "1.5D+02D1"] {
            assert!(number(text, false).unwrap_err().what.contains("not a number"), "{text}");
        }
        assert!(number("1.5\0", false).unwrap_err().what.contains("UTF-16"));
    }
}
