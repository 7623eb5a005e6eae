//! Tables that pass through a verb: rows in, rows with more columns out, as text or Parquet by the file's
//! extension, some at a time.

use crate::failure::{Failure, Outcome};
use std::{
    io::{BufWriter, Write},
    path::Path,
};
use wheatstone::{
    Error,
    dataset::points_file::{
        Column, Columns, ColumnsReader, ColumnsWriter, PointsReader, is_parquet,
    },
    geometry::Pixel,
    storage::Output,
};

/// Where rows come from.
pub(crate) enum Rows {
    Text { reader: Box<PointsReader>, records: Vec<csv::StringRecord> },
    Parquet(Box<ColumnsReader>),
}

/// Some rows: their pixels, a camera each, and all that they hold.
pub(crate) struct Chunk<'a> {
    pub(crate) pixels: Vec<Vec<Option<Pixel>>>,
    held: Held<'a>,
}

enum Held<'a> {
    Records(&'a PointsReader, &'a [csv::StringRecord]),
    Columns(Columns),
}

impl Rows {
    /// Of a file, or standard input for `-`.
    pub(crate) fn open(path: &Path) -> Outcome<Self> {
        if is_parquet(path) {
            return Ok(Self::Parquet(Box::new(ColumnsReader::open(path)?)));
        }
        Ok(Self::Text { reader: Box::new(PointsReader::open(path)?), records: Vec::new() })
    }

    pub(crate) fn cameras(&self) -> usize {
        match self {
            Self::Text { reader, .. } => reader.cameras(),
            Self::Parquet(reader) => reader.cameras(),
        }
    }

    /// The columns' names.
    pub(crate) fn names(&self) -> Vec<String> {
        match self {
            Self::Text { reader, .. } => reader.header().iter().map(str::to_owned).collect(),
            Self::Parquet(reader) => reader.names().map(str::to_owned).collect(),
        }
    }

    /// The character between cells that suits the input.
    pub(crate) fn delimiter(&self) -> u8 {
        match self {
            Self::Text { reader, .. } => reader.delimiter(),
            Self::Parquet(_) => b',',
        }
    }

    /// The next rows, at most so many; none at the end.
    pub(crate) fn next(&mut self, most: usize) -> Outcome<Option<Chunk<'_>>> {
        match self {
            Self::Parquet(reader) => {
                let Some(columns) = reader.next(most)? else { return Ok(None) };
                let pixels = reader.pixels(&columns)?;
                Ok(Some(Chunk { pixels, held: Held::Columns(columns) }))
            }
            Self::Text { reader, records } => {
                records.resize_with(most, csv::StringRecord::new);
                let mut pixels = Vec::with_capacity(most);
                for record in records.iter_mut() {
                    if !reader.next(record)? {
                        break;
                    }
                    pixels.push(reader.pixels(record)?);
                }
                let held = Held::Records(reader, &records[..pixels.len()]);
                Ok((!pixels.is_empty()).then_some(Chunk { pixels, held }))
            }
        }
    }
}

impl Chunk<'_> {
    /// The cells of a row as text.
    fn cells(&self, row: usize) -> Vec<String> {
        match &self.held {
            Held::Records(_, records) => records[row].iter().map(str::to_owned).collect(),
            Held::Columns(held) => held.columns.iter().map(|(_, c)| c.text(row)).collect(),
        }
    }

    /// All by column: of text, pixels and places are numbers and all else is text.
    fn columns(self, names: &[String]) -> Outcome<Columns> {
        let (reader, records) = match self.held {
            Held::Columns(held) => return Ok(held),
            Held::Records(reader, records) => (reader, records),
        };
        let mut columns = Vec::with_capacity(names.len());
        for (index, name) in names.iter().enumerate() {
            let column = if reader.is_number(index) {
                let cells = records.iter().map(|record| reader.cell(record, index));
                Column::Numbers(cells.collect::<wheatstone::Result<_>>()?)
            } else {
                let text = |record: &csv::StringRecord| {
                    let cell = &record[index];
                    (!cell.is_empty()).then(|| cell.to_owned())
                };
                Column::Texts(records.iter().map(text).collect())
            };
            columns.push((name.clone(), column));
        }
        Ok(Columns { columns })
    }
}

/// Where rows go.
pub(crate) struct Sink {
    names: Vec<String>,
    to: To,
    /// Name for messages; none for standard output.
    path: Option<std::path::PathBuf>,
}

enum To {
    Text(Box<csv::Writer<Box<dyn Commit>>>),
    /// Begun with the first rows, which tell the kinds of the columns.
    Parquet(Option<Output>, Option<Box<ColumnsWriter<Output>>>),
}

/// What is written to, and what ends it.
trait Commit: Write {
    fn commit(self: Box<Self>) -> Outcome;
}

impl Commit for Output {
    fn commit(self: Box<Self>) -> Outcome {
        Ok(Output::commit(*self)?)
    }
}

impl Commit for BufWriter<std::io::StdoutLock<'static>> {
    fn commit(mut self: Box<Self>) -> Outcome {
        self.flush().map_err(Failure::Output)
    }
}

impl Sink {
    /// To a file, or standard output for `-`. `names` are those of the columns that pass through, then
    /// those of the added ones.
    pub(crate) fn create(path: &Path, names: Vec<String>, delimiter: u8) -> Outcome<Self> {
        if is_parquet(path) {
            let to = To::Parquet(Some(Output::create(path)?), None);
            return Ok(Self { names, to, path: Some(path.into()) });
        }
        let standard = path.as_os_str() == "-";
        let out: Box<dyn Commit> = if standard {
            Box::new(BufWriter::with_capacity(1 << 18, std::io::stdout().lock()))
        } else {
            Box::new(Output::create(path)?)
        };
        let mut writer = csv::WriterBuilder::new()
            .delimiter(delimiter)
            .buffer_capacity(1 << 18)
            .from_writer(out);
        let path = (!standard).then(|| path.to_path_buf());
        writer.write_record(&names).map_err(|e| failed(path.as_deref(), e))?;
        Ok(Self { names, to: To::Text(Box::new(writer)), path })
    }

    /// Rows that passed through, with what is added to them, as many columns as were named.
    pub(crate) fn write(&mut self, chunk: Chunk, added: Vec<Column>) -> Outcome {
        match &mut self.to {
            To::Text(writer) => {
                for row in 0..chunk.pixels.len() {
                    let own = chunk.cells(row).into_iter();
                    let cells = own.chain(added.iter().map(|column| column.text(row)));
                    for cell in cells {
                        writer.write_field(cell).map_err(|e| failed(self.path.as_deref(), e))?;
                    }
                    let end = writer.write_record(None::<&[u8]>);
                    end.map_err(|e| failed(self.path.as_deref(), e))?;
                }
                Ok(())
            }
            To::Parquet(output, writer) => {
                let passing = self.names.len() - added.len();
                let mut rows = chunk.columns(&self.names[..passing])?;
                rows.columns.extend(added.into_iter().map(|column| (String::new(), column)));
                for ((own, _), name) in rows.columns.iter_mut().zip(&self.names) {
                    own.clone_from(name);
                }
                if let Some(output) = output.take() {
                    let path = self.path.as_deref().unwrap_or(Path::new("-"));
                    *writer = Some(Box::new(ColumnsWriter::new(path, output, &rows)?));
                }
                match writer {
                    Some(writer) => Ok(writer.write(rows)?),
                    None => Ok(()),
                }
            }
        }
    }

    /// Puts the file in its place.
    pub(crate) fn finish(self) -> Outcome {
        match self.to {
            To::Text(writer) => {
                let out = writer.into_inner().map_err(|e| {
                    let source = std::io::Error::from(e.error().kind());
                    failure(self.path.as_deref(), source)
                })?;
                out.commit()
            }
            To::Parquet(_, Some(writer)) => Ok(writer.finish()?.commit()?),
            To::Parquet(output, None) => {
                // No rows: all columns are empty ones of numbers.
                let Some(output) = output else { return Ok(()) };
                let empty = |name: &String| (name.clone(), Column::Numbers(Vec::new()));
                let like = Columns { columns: self.names.iter().map(empty).collect() };
                let path = self.path.as_deref().unwrap_or(Path::new("-"));
                Ok(ColumnsWriter::new(path, output, &like)?.finish()?.commit()?)
            }
        }
    }
}

fn failed(path: Option<&Path>, error: csv::Error) -> Failure {
    let source = match error.into_kind() {
        csv::ErrorKind::Io(source) => source,
        other => std::io::Error::other(format!("{other:?}")),
    };
    failure(path, source)
}

fn failure(path: Option<&Path>, source: std::io::Error) -> Failure {
    match path {
        Some(path) => Error::Io { action: "write", path: path.into(), source }.into(),
        None => Failure::Output(source),
    }
}
