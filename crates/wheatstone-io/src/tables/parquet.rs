//! Points files as Parquet: the same names of columns as in text, a null or NaN for an empty cell. Read and
//! written in batches of rows, by column, in constant memory.
//!
//! Columns of numbers, whole numbers, truth values and text are read, with any compression of Snappy and
//! Zstandard or none; columns of other kinds, and nested ones, are passed over. Written are doubles, whole
//! numbers of 64 bits and text, each optional, with Snappy, which every reader has.

mod cells;
mod pages;
mod source;
mod writer;

pub use writer::ColumnsWriter;

use super::{
    columns::{Column, Columns},
    layout::{LARGEST, Layout},
    rows::{Axis, Rows},
};
use parquet::{
    basic::{LogicalType, Type as Physical},
    column::reader::ColumnReader,
    errors::ParquetError,
    file::{
        reader::{ChunkReader, FileReader},
        serialized_reader::SerializedFileReader,
    },
    schema::types::ColumnDescriptor,
};
use rayon::prelude::*;
use source::Source;
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
};
use wheatstone_core::{
    Error, Result,
    dataset::Correspondence,
    geometry::{Pixel, Point3},
    storage,
};

const HINT: &str = "is this the file that you meant? pandas, polars and DuckDB write what is read";

/// Whether a path is that of a Parquet file, by its extension.
#[must_use]
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("parquet"))
}

/// Reads a points file column by column, some rows at a time.
pub struct ColumnsReader {
    path: PathBuf,
    file: Box<dyn FileReader>,
    /// Index in the file and name of the columns that are read.
    names: Vec<(usize, String)>,
    layout: Layout,
    group: usize,
    open: Vec<ColumnReader>,
    /// Rows left in the open group.
    left: usize,
    /// Rows read before.
    before: u64,
}

impl ColumnsReader {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] where it is no Parquet file, or its columns do not name two
    /// cameras' pixels.
    pub fn open(path: &Path) -> Result<Self> {
        let source = Source::new(storage::open(path)?);
        Self::new(path, source.map_err(|e| Error::reading(path, e))?)
    }

    /// Of a file held in memory; `path` stands for it in messages.
    ///
    /// # Errors
    ///
    /// As [`ColumnsReader::open`].
    pub fn of_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self> {
        Self::new(path, bytes::Bytes::from(bytes))
    }

    fn new<R: ChunkReader + 'static>(path: &Path, source: R) -> Result<Self> {
        let file = guarded(path, || SerializedFileReader::new(source))?;
        let schema = file.metadata().file_metadata().schema_descr_ptr();
        let readable = |column: &ColumnDescriptor| {
            let flat = column.path().parts().len() == 1 && column.max_rep_level() == 0;
            let plain = match column.physical_type() {
                Physical::DOUBLE | Physical::FLOAT | Physical::BOOLEAN | Physical::BYTE_ARRAY => {
                    true
                }
                // Times and decimals are whole numbers of something else than they say.
                Physical::INT32 | Physical::INT64 => {
                    matches!(column.logical_type_ref(), None | Some(LogicalType::Integer { .. }))
                }
                _ => false,
            };
            flat && plain
        };
        let columns = schema.columns().iter().enumerate();
        let names: Vec<(usize, String)> = columns
            .filter(|(_, column)| readable(column))
            .map(|(index, column)| (index, column.name().to_owned()))
            .collect();
        let header = names.iter().map(|(_, name)| name.as_str()).collect();
        let layout = Layout::read(path, None, &header)?;
        Ok(Self {
            path: path.into(),
            file: Box::new(file),
            names,
            layout,
            group: 0,
            open: Vec::new(),
            left: 0,
            before: 0,
        })
    }

    /// The names of the columns that are read.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(|(_, name)| name.as_str())
    }

    /// Cameras that the columns name.
    #[must_use]
    pub fn cameras(&self) -> usize {
        self.layout.pixels.len()
    }

    /// The next rows, at most so many; fewer at the end of a group of rows, `None` at the end of the file.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] for a file that is damaged.
    pub fn next(&mut self, most: usize) -> Result<Option<Columns>> {
        while self.left == 0 {
            if self.group >= self.file.num_row_groups() {
                return Ok(None);
            }
            let (file, group, names) = (&self.file, self.group, &self.names);
            let (left, open) = guarded(&self.path, || {
                let rows = file.get_row_group(group)?;
                let columns = names.iter().map(|(index, _)| rows.get_column_reader(*index));
                let count = usize::try_from(rows.metadata().num_rows()).unwrap_or(0);
                Ok((count, columns.collect::<Result<Vec<_>, ParquetError>>()?))
            })?;
            (self.left, self.open) = (left, open);
            self.group += 1;
        }
        let count = most.min(self.left);
        let schema = self.file.metadata().file_metadata().schema_descr_ptr();
        let open = std::mem::take(&mut self.open).into_par_iter().zip(&self.names);
        let read = open.map(|(reader, (index, name))| {
            let deepest = schema.column(*index).max_def_level();
            let (column, reader) = guarded(&self.path, || cells::cells(reader, count, deepest))?;
            if column.len() != count {
                return Err(damaged(&self.path, "its columns are of different lengths"));
            }
            Ok(((name.clone(), column), reader))
        });
        // All columns are waited for, so that of several faults the first one is told.
        let read: Vec<Result<_>> = read.collect();
        let (columns, open) = read.into_iter().collect::<Result<Vec<_>>>()?.into_iter().unzip();
        self.open = open;
        self.left -= count;
        self.before += count as u64;
        Ok(Some(Columns { columns }))
    }

    /// The number of the last row that was read, counted from 1.
    pub(super) fn row(&self) -> u64 {
        self.before
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The next rows with their pixels, at most so many; fewer at the end of a group of rows, `None` at the
    /// end of the file.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] for a file that is damaged, or a cell that is no place, naming row and column.
    pub fn next_rows(&mut self, most: usize) -> Result<Option<Rows>> {
        let Some(columns) = self.next(most)? else { return Ok(None) };
        let axis = |column: usize| match &columns.columns[column].1 {
            Column::Numbers(_) => Axis::Column(column),
            // What is no number stands out, and is then told by its row.
            other => {
                let number = |row| match other.number(row) {
                    Ok(number) => number.unwrap_or(f64::NAN),
                    Err(_) => f64::INFINITY,
                };
                Axis::Own((0..other.len()).map(number).collect())
            }
        };
        let pixels = self.layout.pixels.iter().map(|pair| pair.map(axis)).collect();
        let rows = Rows::of_columns(columns, pixels);
        if let Some((row, columns)) = rows.first_fault() {
            self.pixels(columns, row)?;
        }
        Ok(Some(rows))
    }

    /// The pixels of a row.
    fn pixels(&self, rows: &Columns, row: usize) -> Result<Vec<Option<Pixel>>> {
        let pixel = |columns: &[usize; 2]| {
            Ok(self.together(rows, row, *columns)?.map(|[x, y]| Pixel::new(x, y)))
        };
        self.layout.pixels.iter().map(pixel).collect()
    }

    /// Whole points, with the names of their views.
    pub(super) fn points(&self, rows: &Columns) -> Result<Vec<(Correspondence, Option<String>)>> {
        let text = |column: usize, row: usize| rows.columns[column].1.text(row);
        let point = |row: usize| {
            let pixels = self.pixels(rows, row)?;
            let world = match self.layout.world {
                Some(columns) => self.together(rows, row, columns)?,
                None => None,
            };
            let board = match self.layout.board {
                Some(columns) => self.together(rows, row, columns)?,
                None => None,
            };
            let id = self.layout.id.map(|column| text(column, row)).filter(|id| !id.is_empty());
            let world = world.map(|[x, y, z]| Point3::new(x, y, z));
            let view = self.layout.view.map(|column| text(column, row));
            Ok((Correspondence { view: 0, id, pixels, world, board }, view))
        };
        (0..rows.rows()).map(point).collect()
    }

    /// Cells that are given together or not at all.
    fn together<const N: usize>(
        &self,
        rows: &Columns,
        row: usize,
        columns: [usize; N],
    ) -> Result<Option<[f64; N]>> {
        let wrong = |column: usize, what: &str| Error::Malformed {
            path: self.path.clone(),
            line: None,
            problem: format!(
                "row {}: column `{}` {what}",
                self.before - rows.rows() as u64 + row as u64 + 1,
                rows.columns[column].0
            ),
            hint: "give all coordinates of a place, or null for all of them".into(),
        };
        let mut values = [0.0; N];
        let mut given = 0;
        let mut empty = columns[0];
        for (value, column) in values.iter_mut().zip(columns) {
            match rows.columns[column].1.number(row) {
                Ok(Some(number)) if number.abs() <= LARGEST => {
                    (*value, given) = (number, given + 1)
                }
                Ok(None) => empty = column,
                Ok(Some(number)) => {
                    return Err(wrong(column, &format!("is `{number}`, which is no place")));
                }
                Err(text) => {
                    return Err(wrong(column, &format!("is `{text}`, which is not a number")));
                }
            }
        }
        match given {
            0 => Ok(None),
            given if given == N => Ok(Some(values)),
            _ => Err(wrong(empty, "is empty, but its partner is not")),
        }
    }
}

/// Runs a reader that trusts its file more than we do: where it stops short, the file is damaged.
fn guarded<T>(path: &Path, work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(damaged(path, &error.to_string())),
        Err(_) => Err(damaged(path, "its parts do not fit together")),
    }
}

fn damaged(path: &Path, what: &str) -> Error {
    // The reader's own words for a compression that it was built without.
    let packed = what.split_once("Disabled feature at compile time: ");
    let (problem, hint) = match packed {
        Some((_, kind)) => (
            format!("compressed in a way that is not read ({kind})"),
            "write it with Snappy (pandas' own choice), Zstandard or uncompressed",
        ),
        None => (format!("not a whole Parquet file: {what}"), HINT),
    };
    Error::Malformed { path: path.into(), line: None, problem, hint: hint.into() }
}
