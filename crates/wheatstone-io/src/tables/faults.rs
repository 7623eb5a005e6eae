//! What is wrong with cells of text.

use super::layout::LARGEST;
use std::path::Path;
use wheatstone_core::Error;

/// A fault of a cell: what the cell is, and what to do.
pub(super) struct Fault {
    what: String,
    hint: &'static str,
}

/// A cell as a number.
pub(super) fn number(text: &str) -> Result<f64, Fault> {
    match text.parse::<f64>() {
        Ok(value) if value.abs() <= LARGEST => Ok(value),
        Ok(_) => Err(Fault {
            what: format!("is `{text}`, which is no place"),
            hint: "remove the row, or leave the cells of a camera that did not see the point empty",
        }),
        Err(_) => Err(Fault {
            what: format!("is `{text}`, which is not a number"),
            hint: "numbers are written with a decimal point and without units",
        }),
    }
}

/// A cell without its partner.
pub(super) fn half() -> Fault {
    Fault {
        what: "is empty, but its partner is not".into(),
        hint: "give both coordinates, or neither where the camera did not see the point",
    }
}

impl Fault {
    /// As an error that says where.
    pub(super) fn at(self, path: &Path, line: Option<u64>, column: &str) -> Error {
        Error::Malformed {
            path: path.into(),
            line,
            problem: format!("column `{column}` {}", self.what),
            hint: self.hint.into(),
        }
    }
}

/// A row of another length than the header.
pub(super) fn unequal(path: &Path, line: Option<u64>, cells: u64, header: u64) -> Error {
    Error::Malformed {
        path: path.into(),
        line,
        problem: format!("{cells} cells, the header has {header}"),
        hint: "every line has as many cells as the header; leave unknown ones empty".into(),
    }
}

/// A row that is no text.
pub(super) fn no_text(path: &Path, line: Option<u64>) -> Error {
    Error::Malformed {
        path: path.into(),
        line,
        problem: "not text (UTF-8)".into(),
        hint: "is this the file that you meant?".into(),
    }
}
