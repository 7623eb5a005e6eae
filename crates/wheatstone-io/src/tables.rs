//! Points files: tables of matched pixels, with world coordinates where they are known.
//!
//! A header names the columns: `x1,y1,x2,y2[,x3,y3…]` pixels (empty: not seen by that camera),
//! `X,Y,Z` world, or `board_x,board_y` on a chart whose pose is unknown, optionally `view` and `id`.
//! Other columns are passed over. Commas, semicolons or tabs separate.

mod blocks;
mod collected;
mod columns;
mod decimals;
mod digits;
mod faults;
mod layout;
mod parquet;
mod records;
mod rows;
mod sheet;
mod spelled;
mod text;

pub use blocks::TextReader;
pub use collected::Duplicates;
pub use columns::{Cells, Column, Columns, Texts, Words};
pub use parquet::{ColumnsReader, ColumnsWriter, is_parquet};
pub use rows::{Rows, header_line};
pub use sheet::Pieces;
pub use text::{columns, write};

use collected::Collected;
use layout::Layout;
use std::{
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
};
use wheatstone_core::dataset::{Correspondence, Dataset};
use wheatstone_core::{
    Error, Result,
    geometry::{Pixel, Point3},
    storage,
};

/// Reads a points file row by row, in constant memory.
pub struct PointsReader {
    path: PathBuf,
    header: csv::StringRecord,
    layout: Layout,
    rows: csv::Reader<Box<dyn Read + Send>>,
}

/// The longest line that is looked at before a file is taken for something else than a table.
const LONGEST_HEADER: u64 = 1 << 20;

impl PointsReader {
    /// Opens a file, or standard input for `-`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] where the header does not name two cameras' pixels.
    pub fn open(path: &Path) -> Result<Self> {
        if path.as_os_str() == "-" {
            return Self::new(Path::new("standard input"), Box::new(std::io::stdin()));
        }
        Self::new(path, Box::new(storage::open(path)?))
    }

    /// Reads from anywhere; `name` stands for it in messages.
    ///
    /// # Errors
    ///
    /// As [`PointsReader::open`].
    pub fn new(name: &Path, source: Box<dyn Read + Send>) -> Result<Self> {
        let mut source = BufReader::with_capacity(1 << 18, source);
        let mut first = Vec::new();
        source
            .by_ref()
            .take(LONGEST_HEADER)
            .read_until(b'\n', &mut first)
            .map_err(|e| Error::reading(name, e))?;
        // The byte order mark that spreadsheets put first is no part of the first name.
        let line = first.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&first).to_vec();
        let delimiter = [b';', b'\t', b',']
            .into_iter()
            .max_by_key(|d| line.iter().filter(|b| *b == d).count())
            .unwrap_or(b',');
        let whole: Box<dyn Read + Send> = Box::new(std::io::Cursor::new(line).chain(source));
        let mut rows =
            csv::ReaderBuilder::new().delimiter(delimiter).trim(csv::Trim::All).from_reader(whole);
        let header = rows.headers().map_err(|e| malformed(name, &e))?.clone();
        let layout = Layout::read(name, Some(1), &header)?;
        Ok(Self { path: name.into(), header, layout, rows })
    }

    /// Cameras that the header names.
    #[must_use]
    pub fn cameras(&self) -> usize {
        self.layout.pixels.len()
    }

    /// Reads the next row into `record`; false at the end of the file.
    fn next(&mut self, record: &mut csv::StringRecord) -> Result<bool> {
        self.rows.read_record(record).map_err(|e| malformed(&self.path, &e))
    }

    /// The pixels of a row.
    fn pixels(&self, record: &csv::StringRecord) -> Result<Vec<Option<Pixel>>> {
        let each = self.layout.pixels.iter().map(|columns| {
            let [x, y] = columns.map(|column| (column, &record[column]));
            match (x.1.is_empty(), y.1.is_empty()) {
                (true, true) => Ok(None),
                (false, false) => {
                    Ok(Some(Pixel::new(self.number(record, x.0)?, self.number(record, y.0)?)))
                }
                (empty, _) => {
                    Err(self.fault(faults::half(), record, if empty { x.0 } else { y.0 }))
                }
            }
        });
        each.collect()
    }

    /// A whole row.
    fn correspondence(&self, record: &csv::StringRecord) -> Result<Correspondence> {
        Ok(Correspondence {
            view: 0,
            id: self.layout.id.map(|column| record[column].to_owned()).filter(|id| !id.is_empty()),
            pixels: self.pixels(record)?,
            world: self.numbers(record, self.layout.world)?.map(|[x, y, z]| Point3::new(x, y, z)),
            board: self.numbers(record, self.layout.board)?,
        })
    }

    /// Several cells that are given together or not at all.
    fn numbers<const N: usize>(
        &self,
        record: &csv::StringRecord,
        columns: Option<[usize; N]>,
    ) -> Result<Option<[f64; N]>> {
        let Some(columns) = columns else { return Ok(None) };
        if columns.iter().all(|column| record[*column].is_empty()) {
            return Ok(None);
        }
        let mut values = [0.0; N];
        for (value, column) in values.iter_mut().zip(columns) {
            *value = self.number(record, column)?;
        }
        Ok(Some(values))
    }

    fn number(&self, record: &csv::StringRecord, column: usize) -> Result<f64> {
        faults::number(&record[column]).map_err(|fault| self.fault(fault, record, column))
    }

    fn fault(&self, fault: faults::Fault, record: &csv::StringRecord, column: usize) -> Error {
        let line = record.position().map(csv::Position::line);
        fault.at(&self.path, line, &self.header[column])
    }
}

/// What the table's own reader could not read.
fn malformed(path: &Path, error: &csv::Error) -> Error {
    let line = error.position().map(csv::Position::line);
    let (problem, hint) = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            return faults::unequal(path, line, *len, *expected_len);
        }
        csv::ErrorKind::Utf8 { .. } => return faults::no_text(path, line),
        csv::ErrorKind::Io(e) => (e.to_string(), "is this the file that you meant?"),
        _ => (error.to_string(), "is this a CSV file?"),
    };
    Error::Malformed { path: path.into(), line, problem, hint: hint.into() }
}

/// Reads a whole points file, as text or Parquet by its extension.
///
/// # Errors
///
/// [`Error::Io`], or [`Error::Malformed`] naming line, column and what was seen.
pub fn read(path: &Path, unit: &str, duplicates: Duplicates) -> Result<Dataset> {
    if is_parquet(path) {
        return gather(ColumnsReader::open(path)?, unit, duplicates);
    }
    read_from(PointsReader::open(path)?, unit, duplicates)
}

/// Reads the rest of what a reader was opened on.
///
/// # Errors
///
/// As [`read`].
pub fn read_from(mut reader: PointsReader, unit: &str, duplicates: Duplicates) -> Result<Dataset> {
    let mut found = Collected::new(&reader.path, unit, reader.cameras(), duplicates);
    let mut record = csv::StringRecord::new();
    while reader.next(&mut record)? {
        let row = reader.correspondence(&record)?;
        let view = reader.layout.view.map(|column| &record[column]);
        found.push(row, view, record.position().map_or(0, csv::Position::line))?;
    }
    found.finish()
}

/// Reads a whole points file that is held in memory as Parquet; `path` stands for it in messages. Rows
/// that stand in it twice are kept.
///
/// # Errors
///
/// As [`read`].
pub fn read_parquet(path: &Path, bytes: Vec<u8>, unit: &str) -> Result<Dataset> {
    gather(ColumnsReader::of_bytes(path, bytes)?, unit, Duplicates::Keep)
}

/// A Parquet file with these correspondences.
///
/// # Errors
///
/// [`Error::Io`].
pub fn write_parquet(data: &Dataset) -> Result<Vec<u8>> {
    let rows = columns(data);
    let mut writer = ColumnsWriter::new(Path::new("points"), Vec::new(), &rows)?;
    writer.write(rows)?;
    writer.finish()
}

fn gather(mut reader: ColumnsReader, unit: &str, duplicates: Duplicates) -> Result<Dataset> {
    // Enough to read by column, little to hold.
    const ROWS: usize = 1 << 14;
    let mut found = Collected::new(reader.path(), unit, reader.cameras(), duplicates);
    while let Some(rows) = reader.next(ROWS)? {
        let first = reader.row() - rows.rows() as u64 + 1;
        for (line, (row, view)) in (first..).zip(reader.points(&rows)?) {
            found.push(row, view.as_deref(), line)?;
        }
    }
    found.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Dataset> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("points.csv");
        std::fs::write(&path, text).unwrap();
        read(&path, "mm", Duplicates::Refuse)
    }

    #[test]
    fn what_is_written_is_read_back_bit_for_bit() {
        let text = "x1,y1,x2,y2,x3,y3,X,Y,Z,view,id\n0.1,2,3,4,,,1,2,3.3333333333333335,a,7\n,,1e-7,2,3,4,-1,-2,-3,\"b,c\",8\n";
        let data = parse(text).unwrap();
        assert_eq!(data.views, ["a", "b,c"]);
        assert_eq!(data.correspondences[1].pixels[0], None);
        let again = parse(&write(&data)).unwrap();
        assert_eq!(again, data);
        let board = parse("x1,y1,x2,y2,board_x,board_y,view\n1,2,3,4,30,60,0\n").unwrap();
        assert_eq!(board.correspondences[0].board, Some([30.0, 60.0]));
        assert_eq!(parse(&write(&board)).unwrap(), board);
    }

    #[test]
    fn spreadsheets_habits_are_understood() {
        let plain = parse("x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n").unwrap();
        for text in [
            "\u{feff}x1,y1,x2,y2,X,Y,Z\r\n1,2,3,4,5,6,7\r\n",
            "x1;y1;x2;y2;X;Y;Z\n1;2;3;4;5;6;7",
            "x1\ty1\tx2\ty2\tX\tY\tZ\n1\t2\t3\t4\t5\t6\t7\n",
            " x1 , y1, x2,y2, X,Y,Z\n 1, 2 ,\"3\",4,5,6, 7.0\n\n",
            "weight,Z,Y,X,y2,x2,y1,x1\n0.5,7,6,5,4,3,2,1\n",
        ] {
            assert_eq!(parse(text).unwrap(), plain, "{text:?}");
        }
    }

    #[test]
    fn faults_are_named_with_line_and_column() {
        let header = "x1,y1,x2,y2,X,Y,Z\n1,2,3,4,5,6,7\n";
        for (text, line, words) in [
            (String::new(), Some(1), "empty"),
            ("1,2,3,4,5,6,7\n".into(), Some(1), "no header"),
            ("x1,y1,X,Y,Z\n".into(), Some(1), "`x2`"),
            ("x1,y1,x2,y2,x4,y4\n".into(), Some(1), "`x3`"),
            ("x1,y1,x2,y2,X,Y\n".into(), Some(1), "some are missing"),
            ("x1,y1,x2,y2,x1\n".into(), Some(1), "two columns"),
            ("x1,y1,x2,y2,X,Y,Z\n".into(), None, "no points"),
            (format!("{header}1,2,three,4,5,6,7\n"), Some(3), "column `x2` is `three`"),
            (format!("{header}1,2,3,nan,5,6,7\n"), Some(3), "column `y2` is `nan`"),
            (format!("{header}1,2,3,4,5,6,1e999\n"), Some(3), "column `Z` is `1e999`"),
            (format!("{header}1,2,3,4,5,6\n"), Some(3), "6 cells, the header has 7"),
            (format!("{header}1,2,3,,5,6,8\n"), Some(3), "column `y2` is empty"),
            (format!("{header}1,2,3,4,5,6,8\n1,2,3,4,5,6,7\n"), Some(4), "stands in line 2"),
        ] {
            match parse(&text) {
                Err(Error::Malformed { line: at, problem, hint, .. }) => {
                    assert_eq!(at, line, "{text:?}: {problem}");
                    assert!(problem.contains(words), "{text:?}: {problem}");
                    assert!(!hint.is_empty());
                }
                other => panic!("{text:?}: {other:?}"),
            }
        }
    }
}
