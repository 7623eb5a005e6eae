//! Tables of points read whole, and written whole.

use super::{
    collected::{Collected, Duplicates},
    reader::{TableOptions, TableReader},
    writer::{TableStyle, TableWriter},
};
use arrow_array::{ArrayRef, Float64Array, StringArray};
use std::{path::Path, sync::Arc};
use wheatstone_core::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    storage, unit,
};

/// Reads a whole table: text, Parquet or Arrow. Lengths are in `unit` where it does not say otherwise, and
/// converted to it where it does.
///
/// # Errors
///
/// [`wheatstone_core::Error::Io`]; [`wheatstone_core::Error::Malformed`] naming line, column and what was
/// seen; [`wheatstone_core::Error::Mismatch`] where units do not convert.
pub fn read(path: &Path, unit: &str, duplicates: Duplicates) -> Result<Dataset> {
    let unit = Some(unit.to_owned());
    read_with(path, &TableOptions { unit, duplicates, ..TableOptions::default() })
}

/// Reads a whole table as the options say. Lengths are in millimetres where nothing says a unit.
///
/// # Errors
///
/// As [`read`].
pub fn read_with(path: &Path, options: &TableOptions) -> Result<Dataset> {
    TableReader::open(path, options)?.gather(options)
}

/// Reads a whole table that is held in memory; `name` stands for it in messages.
///
/// # Errors
///
/// As [`read`].
pub fn read_bytes(name: &Path, bytes: Vec<u8>, options: &TableOptions) -> Result<Dataset> {
    TableReader::of_bytes(name, bytes, options)?.gather(options)
}

impl TableReader {
    /// All rows that are left, as correspondences.
    ///
    /// # Errors
    ///
    /// As [`read`].
    pub fn gather(mut self, options: &TableOptions) -> Result<Dataset> {
        let wanted = options.unit.as_deref();
        if let Some(unit) = wanted.filter(|unit| unit::is_of_other_kind(unit)) {
            return Err(Error::Setting {
                setting: "the unit of lengths".into(),
                value: format!("`{unit}`"),
                need: "a unit such as mm".into(),
            });
        }
        let own = self.unit()?;
        let unit = own.as_deref().or(wanted).unwrap_or("mm").to_owned();
        let mut found = Collected::new(self.path(), &unit, self.cameras(), options.duplicates);
        while let Some(rows) = self.next_rows()? {
            for (row, (point, view)) in rows.correspondences()?.into_iter().enumerate() {
                found.push(point, view.as_deref(), rows.line(row))?;
            }
        }
        found.finish()?.in_unit(wanted.unwrap_or(&unit))
    }
}

/// The text of a table of these correspondences.
#[must_use]
pub fn write(data: &Dataset) -> String {
    // Memory takes all that is written, and numbers and names are text.
    let bytes = encode(data, Path::new("points.csv")).unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

/// A table of these correspondences: text, Parquet or Arrow by the extension of a name.
///
/// # Errors
///
/// [`wheatstone_core::Error::Io`].
pub fn encode(data: &Dataset, name: &Path) -> Result<Vec<u8>> {
    encode_in(data, name, Some(data.unit.clone()))
}

/// The same, which says no unit where that was only assumed.
pub(crate) fn encode_in(data: &Dataset, name: &Path, unit: Option<String>) -> Result<Vec<u8>> {
    let (names, columns) = columns(data);
    let style = TableStyle { unit, ..TableStyle::default() };
    let mut writer = TableWriter::new(name, Vec::new(), names, style)?;
    writer.write_columns(&columns)?;
    writer.finish()
}

/// Writes a table of these correspondences to a file: text, Parquet or Arrow by its extension.
///
/// # Errors
///
/// [`wheatstone_core::Error::Io`]; the old file, if there was one, is then untouched.
pub fn save(data: &Dataset, path: &Path) -> Result<()> {
    storage::write(path, &encode(data, path)?)
}

/// Correspondences by column, with the names that a table gives them.
fn columns(data: &Dataset) -> (Vec<String>, Vec<ArrayRef>) {
    let rows = &data.correspondences;
    let (mut names, mut columns): (Vec<String>, Vec<ArrayRef>) = Default::default();
    let mut numbers = |name: String, of: &dyn Fn(&Correspondence) -> Option<f64>| {
        names.push(name);
        columns.push(Arc::new(rows.iter().map(of).collect::<Float64Array>()));
    };
    for camera in 0..data.cameras {
        for (axis, letter) in ["x", "y"].into_iter().enumerate() {
            numbers(format!("{letter}{}", camera + 1), &|row| {
                (*row.pixels.get(camera)?).map(|pixel| pixel[axis])
            });
        }
    }
    if rows.iter().any(|row| row.world.is_some()) {
        for (axis, name) in ["X", "Y", "Z"].into_iter().enumerate() {
            numbers(name.into(), &|row| row.world.map(|world| world[axis]));
        }
    }
    if rows.iter().any(|row| row.board.is_some()) {
        for (axis, name) in ["board_x", "board_y"].into_iter().enumerate() {
            numbers(name.into(), &|row| row.board.map(|board| board[axis]));
        }
    }
    if !data.views.is_empty() {
        let view = |row: &Correspondence| data.views.get(row.view).cloned();
        names.push("view".into());
        columns.push(Arc::new(rows.iter().map(view).collect::<StringArray>()));
    }
    if rows.iter().any(|row| row.id.is_some()) {
        names.push("id".into());
        columns.push(Arc::new(rows.iter().map(|row| row.id.clone()).collect::<StringArray>()));
    }
    (names, columns)
}
