//! Tables as they are written: text, Parquet or Arrow.

use super::{
    cells::malformed,
    columnar::UNIT,
    parquet_checksums::{CheckedOutput, CheckedStores},
    rows::Rows,
    shown::Shown,
};
use arrow_array::{ArrayRef, RecordBatch};
use arrow_ipc::writer::FileWriter;
use arrow_schema::{Field, Schema, SchemaRef};
use flate2::{Compression as Gzip, write::GzEncoder};
use parquet::{
    arrow::{
        ArrowWriter,
        arrow_writer::{
            ArrowColumnWriter, ArrowRowGroupWriterFactory, ArrowWriterOptions, compute_leaves,
        },
    },
    basic::{Compression, Encoding},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::{EnabledStatistics, WriterProperties},
        writer::SerializedFileWriter,
    },
    schema::types::ColumnPath,
};
use rayon::prelude::*;
use std::{
    io::Write,
    path::{Path, PathBuf},
    sync::Arc,
};
use wheatstone_core::{Error, Result};

/// What kind of table a name asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    GzippedText,
    Parquet,
    Arrow,
}

impl Kind {
    /// By a file's extension.
    pub(super) fn of(path: &Path) -> Self {
        let extension =
            path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "parquet" | "pq" => Self::Parquet,
            "arrow" | "feather" | "ipc" => Self::Arrow,
            "gz" => Self::GzippedText,
            _ => Self::Text,
        }
    }
}

/// Endings of files that hold tables, but not as they are written here: text under such a name would be refused, or
/// misread, by whoever opens it.
const NOT_WRITTEN: &[&str] =
    &["npy", "npz", "mat", "h5", "hdf5", "xlsx", "xls", "ods", "json", "jsonl", "db", "sqlite"];

/// Refuses a name that says what is not written.
fn writable(path: &Path) -> Result<()> {
    let ending =
        path.extension().map(|end| end.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !NOT_WRITTEN.contains(&ending.as_str()) {
        return Ok(());
    }
    let problem = format!("tables are not written as .{ending}");
    let hint = "end the name in .csv, .csv.gz, .parquet or .arrow, which say how it is written";
    Err(malformed(path, None, problem, hint))
}

/// How a table is written.
#[derive(Clone, Debug)]
pub struct TableStyle {
    /// What separates cells of text.
    pub delimiter: u8,
    /// The unit of its lengths. Files by column say it in their metadata.
    pub unit: Option<String>,
    /// Whether text says the unit as well, in a comment before the header.
    pub unit_comment: bool,
}

impl Default for TableStyle {
    fn default() -> Self {
        Self { delimiter: b',', unit: None, unit_comment: false }
    }
}

/// Writes a table, some rows at a time: text, Parquet or Arrow by the extension of its name.
pub struct TableWriter<W: Write + Send> {
    path: PathBuf,
    names: Vec<String>,
    style: TableStyle,
    to: To<W>,
}

enum To<W: Write + Send> {
    Text(W),
    Gzipped(GzEncoder<W>),
    /// Begun with the first rows, which tell the kinds of the columns.
    Waiting(W, Kind),
    Parquet(Box<Parquet<W>>),
    Arrow(Box<FileWriter<W>>),
    /// Lost with an error.
    Nowhere,
}

impl<W: Write + Send> TableWriter<W> {
    /// With columns of these names.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Malformed`] for a name that asks for another kind of file.
    pub fn new(path: &Path, output: W, names: Vec<String>, style: TableStyle) -> Result<Self> {
        writable(path)?;
        let to = match Kind::of(path) {
            Kind::Text => To::Text(output),
            Kind::GzippedText => To::Gzipped(GzEncoder::new(output, Gzip::fast())),
            kind => To::Waiting(output, kind),
        };
        let mut writer = Self { path: path.into(), names, style, to };
        if !writer.is_by_column() {
            let mut head = match (&writer.style.unit, writer.style.unit_comment) {
                (Some(unit), true) => format!("# unit: {unit}\n").into_bytes(),
                _ => Vec::new(),
            };
            let mut cells = text_writer(&mut head, writer.style.delimiter);
            let written = cells.write_record(&writer.names).and_then(|()| Ok(cells.flush()?));
            drop(cells);
            written.map_err(|e| writer.failed(e.into()))?;
            writer.put(&[head])?;
        }
        Ok(writer)
    }

    fn is_by_column(&self) -> bool {
        matches!(self.to, To::Waiting(..) | To::Parquet(_) | To::Arrow(_))
    }

    /// Writes rows as they came, with columns that are `added` to them.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Malformed`] for a length in the rows that is no number.
    pub fn write(&mut self, rows: &Rows, added: &[ArrayRef]) -> Result<()> {
        let own = if self.is_by_column() { rows.typed()? } else { rows.batch().clone() };
        let columns: Vec<ArrayRef> = own.columns().iter().chain(added).cloned().collect();
        self.put_columns(&columns, rows.decimal_comma())
    }

    /// Writes columns, as many as were named.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write_columns(&mut self, columns: &[ArrayRef]) -> Result<()> {
        self.put_columns(columns, false)
    }

    fn put_columns(&mut self, columns: &[ArrayRef], decimal_comma: bool) -> Result<()> {
        if !self.is_by_column() {
            let text = as_text(columns, self.style.delimiter, decimal_comma);
            return self.put(&text);
        }
        let written = self.batch(columns).and_then(|batch| {
            if let To::Waiting(..) = self.to {
                self.begin(&batch.schema())?;
            }
            match &mut self.to {
                To::Parquet(parquet) => parquet.write(&batch)?,
                To::Arrow(arrow) => arrow.write(&batch)?,
                _ => {}
            }
            Ok(())
        });
        written.map_err(|e| self.failed(e))
    }

    fn batch(&self, columns: &[ArrayRef]) -> Result<RecordBatch, Foreign> {
        let field = |(name, column): (&String, &ArrayRef)| {
            Field::new(name, column.data_type().clone(), true)
        };
        let fields: Vec<Field> = self.names.iter().zip(columns).map(field).collect();
        let unit = self.style.unit.iter().map(|unit| (UNIT.to_owned(), unit.clone()));
        let schema = Schema::new_with_metadata(fields, unit.collect());
        Ok(RecordBatch::try_new(Arc::new(schema), columns.to_vec())?)
    }

    fn begin(&mut self, schema: &SchemaRef) -> Result<(), Foreign> {
        let To::Waiting(output, kind) = std::mem::replace(&mut self.to, To::Nowhere) else {
            return Ok(());
        };
        self.to = if kind == Kind::Parquet {
            To::Parquet(Box::new(Parquet::new(output, schema, self.style.unit.as_deref())?))
        } else {
            To::Arrow(Box::new(FileWriter::try_new(output, schema)?))
        };
        Ok(())
    }

    fn put(&mut self, pieces: &[Vec<u8>]) -> Result<()> {
        let written = pieces.iter().try_for_each(|piece| match &mut self.to {
            To::Text(output) => output.write_all(piece),
            To::Gzipped(output) => output.write_all(piece),
            _ => Ok(()),
        });
        written.map_err(|e| Error::writing(&self.path, e))
    }

    /// Ends the table and gives its output back.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<W> {
        if let To::Waiting(..) = self.to {
            // No rows: all columns are empty ones of numbers.
            let none: ArrayRef = Arc::new(arrow_array::Float64Array::from(Vec::<f64>::new()));
            self.write_columns(&vec![none; self.names.len()])?;
        }
        let finished = match std::mem::replace(&mut self.to, To::Nowhere) {
            To::Text(mut output) => output.flush().map(|()| output).map_err(Into::into),
            To::Gzipped(output) => output.finish().map_err(Into::into),
            To::Parquet(parquet) => parquet.finish().map_err(Into::into),
            To::Arrow(arrow) => arrow.into_inner().map_err(Into::into),
            To::Waiting(..) | To::Nowhere => Err("writing ended early".into()),
        };
        finished.map_err(|e| self.failed(e))
    }

    /// What a writer could not do: that of the system below it, where it says one.
    fn failed(&self, error: Foreign) -> Error {
        let source = match error.downcast::<std::io::Error>() {
            Ok(own) => *own,
            Err(other) => std::io::Error::other(other.to_string()),
        };
        Error::writing(&self.path, source)
    }
}

type Foreign = Box<dyn std::error::Error>;

/// Writes Parquet with checksums, all columns of a group at once.
struct Parquet<W: Write + Send> {
    writer: SerializedFileWriter<CheckedOutput<W>>,
    factory: ArrowRowGroupWriterFactory,
    stores: Arc<CheckedStores>,
    schema: SchemaRef,
    /// The columns of the group that is being written, and its rows.
    open: Option<(Vec<ArrowColumnWriter>, usize)>,
    groups: usize,
}

impl<W: Write + Send> Parquet<W> {
    /// Rows of a group: some megabytes a column are held at most.
    const GROUP: usize = 1 << 18;

    /// Bytes of a group, where rows are long.
    const GROUP_BYTES: usize = 1 << 28;

    fn new(output: W, schema: &SchemaRef, unit: Option<&str>) -> Result<Self, ParquetError> {
        // Doubles of measurements hardly repeat: as they are, they are read and written quickest. An index of offsets,
        // and a dictionary before the data, would not know of the checksums.
        let mut properties = WriterProperties::builder()
            .set_encoding(Encoding::PLAIN)
            .set_dictionary_enabled(false)
            .set_offset_index_disabled(true)
            .set_statistics_enabled(EnabledStatistics::None);
        for field in schema.fields().iter().filter(|field| !field.data_type().is_floating()) {
            let column = ColumnPath::from(field.name().as_str());
            properties = properties.set_column_compression(column, Compression::SNAPPY);
        }
        if let Some(unit) = unit {
            let pair = KeyValue::new(UNIT.to_owned(), unit.to_owned());
            properties = properties.set_key_value_metadata(Some(vec![pair]));
        }
        let stores = Arc::new(CheckedStores::default());
        let options = ArrowWriterOptions::new()
            .with_properties(properties.build())
            .with_page_store_factory(Arc::clone(&stores) as _);
        let output = CheckedOutput::new(output);
        let (writer, factory) =
            ArrowWriter::try_new_with_options(output, Arc::clone(schema), options)?
                .into_serialized_writer()?;
        Ok(Self { writer, factory, stores, schema: Arc::clone(schema), open: None, groups: 0 })
    }

    fn write(&mut self, batch: &RecordBatch) -> Result<(), ParquetError> {
        let (mut columns, rows) = match self.open.take() {
            Some(open) => open,
            None => (self.factory.create_column_writers(self.groups)?, 0),
        };
        let mut leaves = Vec::new();
        for (field, column) in self.schema.fields().iter().zip(batch.columns()) {
            leaves.extend(compute_leaves(field, column)?);
        }
        columns
            .par_iter_mut()
            .zip(leaves.par_iter())
            .try_for_each(|(column, leaf)| column.write(leaf))?;
        let rows = rows + batch.num_rows();
        let bytes: usize = columns.iter().map(ArrowColumnWriter::memory_size).sum();
        self.open = Some((columns, rows));
        let is_full = rows >= Self::GROUP || bytes >= Self::GROUP_BYTES;
        if is_full { self.end_group() } else { Ok(()) }
    }

    fn end_group(&mut self) -> Result<(), ParquetError> {
        let Some((columns, _)) = self.open.take() else { return Ok(()) };
        self.groups += 1;
        let chunks: Result<Vec<_>, _> =
            columns.into_par_iter().map(ArrowColumnWriter::close).collect();
        let mut chunks = chunks?;
        self.stores.correct(&mut chunks)?;
        let mut group = self.writer.next_row_group()?;
        for chunk in chunks {
            chunk.append_to_row_group(&mut group)?;
        }
        group.close()?;
        Ok(())
    }

    fn finish(mut self) -> Result<W, ParquetError> {
        self.end_group()?;
        let checksum = self.writer.inner_mut().hold();
        self.writer.append_key_value_metadata(checksum);
        Ok(self.writer.into_inner()?.finish()?)
    }
}

/// Columns as lines of text, in pieces.
fn as_text(columns: &[ArrayRef], delimiter: u8, decimal_comma: bool) -> Vec<Vec<u8>> {
    // Rows of a piece: large enough to pay for handing it over, small enough to balance.
    const PIECE: usize = 1024;
    let rows = columns.first().map_or(0, |column| column.len());
    let piece = |piece: usize| {
        let shown: Vec<Shown> = columns.iter().map(|column| Shown::of(column)).collect();
        let mut text = Vec::new();
        let (mut writer, mut cell) = (text_writer(&mut text, delimiter), String::new());
        for row in piece * PIECE..rows.min((piece + 1) * PIECE) {
            for column in &shown {
                cell.clear();
                column.push(row, &mut cell);
                let comma = decimal_comma && column.is_number();
                let written = if comma {
                    writer.write_field(cell.replacen('.', ",", 1))
                } else {
                    writer.write_field(&cell)
                };
                debug_assert!(written.is_ok(), "memory takes all that is written");
            }
            let written = writer.write_record(None::<&[u8]>);
            debug_assert!(written.is_ok(), "memory takes all that is written");
        }
        let written = writer.flush();
        debug_assert!(written.is_ok(), "memory takes all that is written");
        drop(writer);
        text
    };
    (0..rows.div_ceil(PIECE)).into_par_iter().map(piece).collect()
}

/// Writes lines that read back the same: what begins with the mark of comments is quoted.
fn text_writer(text: &mut Vec<u8>, delimiter: u8) -> csv::Writer<&mut Vec<u8>> {
    csv::WriterBuilder::new().delimiter(delimiter).comment(Some(b'#')).from_writer(text)
}
