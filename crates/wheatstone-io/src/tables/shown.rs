//! Cells of any kind as text.

use arrow_array::{Array, ArrayRef, Float32Array, Float64Array, StringArray, cast::AsArray};
use arrow_cast::display::{ArrayFormatter, FormatOptions};
use std::fmt::Write;

/// A column whose cells are written as text. Numbers have the shortest digits that read back the same.
pub(super) enum Shown<'a> {
    Double(&'a Float64Array),
    Single(&'a Float32Array),
    Text(&'a StringArray),
    Other(ArrayFormatter<'a>),
    /// Lists, structures and what else text has no form for.
    Nothing,
}

impl<'a> Shown<'a> {
    pub(super) fn of(array: &'a ArrayRef) -> Self {
        if let Some(numbers) = array.as_any().downcast_ref() {
            return Self::Double(numbers);
        }
        if let Some(numbers) = array.as_any().downcast_ref() {
            return Self::Single(numbers);
        }
        if let Some(text) = array.as_string_opt() {
            return Self::Text(text);
        }
        const PLAIN: FormatOptions = FormatOptions::new().with_display_error(true);
        ArrayFormatter::try_new(array, &PLAIN).map_or(Self::Nothing, Self::Other)
    }

    /// Writes a cell; nothing for one that holds none.
    pub(super) fn push(&self, row: usize, out: &mut String) {
        let written = match self {
            Self::Double(numbers) if numbers.is_valid(row) && !numbers.value(row).is_nan() => {
                write!(out, "{}", numbers.value(row))
            }
            Self::Single(numbers) if numbers.is_valid(row) && !numbers.value(row).is_nan() => {
                write!(out, "{}", numbers.value(row))
            }
            Self::Text(text) if text.is_valid(row) => out.write_str(text.value(row)),
            Self::Other(formatter) => write!(out, "{}", formatter.value(row)),
            _ => Ok(()),
        };
        // Text in memory takes all that is written.
        debug_assert!(written.is_ok());
    }

    pub(super) fn is_number(&self) -> bool {
        matches!(self, Self::Double(_) | Self::Single(_))
    }

    /// A cell.
    pub(super) fn text(&self, row: usize) -> String {
        let mut text = String::new();
        self.push(row, &mut text);
        text
    }
}
