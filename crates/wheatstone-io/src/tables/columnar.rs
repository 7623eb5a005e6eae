//! Tables by column: Parquet and Arrow files, and batches in memory.

use super::{
    arrow_lengths,
    cells::{Foreign, malformed},
    layout::{Header, Layout},
    names::ColumnNames,
    numbers::Reading,
    parquet_lengths::{self, CheckedPages},
    rows::{Rows, Table},
};
use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_ipc::reader::{FileReader, StreamReader};
use arrow_schema::{ArrowError, SchemaRef};
use bytes::Bytes;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::file::reader::ChunkReader;
use std::{
    io::{Read, Seek},
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::Arc,
};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    limits,
};

/// Under this key a file by column says the unit of its lengths.
pub(super) const UNIT: &str = "unit";

type Batches = Box<dyn Iterator<Item = Result<RecordBatch, ArrowError>> + Send>;

/// Reads a table by column, some rows at a time.
pub(super) struct ColumnTable {
    pub(super) table: Arc<Table>,
    pub(super) unit: Option<String>,
    kind: &'static str,
    batches: Batches,
    /// What of the last batch was not passed on yet.
    rest: Option<RecordBatch>,
    /// Rows that were passed on.
    row: u64,
}

/// What messages call a table, by where it comes from.
const PARQUET: &str = "Parquet file";
const ARROW: &str = "Arrow file";
const HANDED_OVER: &str = "table in memory";

/// Rows that are decoded at once.
const ROWS: usize = 1 << 14;

impl ColumnTable {
    pub(super) fn parquet<F: ChunkReader + 'static>(
        path: &Path,
        file: F,
        told: Option<&ColumnNames>,
    ) -> Result<Self> {
        let (schema, unit, batches) = guarded(path, PARQUET, || {
            parquet_lengths::check_footer(&file)?;
            let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::default())?;
            parquet_lengths::check_columns(&metadata, file.len())?;
            let file = CheckedPages::new(file, &metadata);
            let rows = file.rows_at_once(&metadata, ROWS)?;
            let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
                .with_batch_size(rows);
            let pairs = builder.metadata().file_metadata().key_value_metadata();
            let unit = pairs.and_then(|pairs| {
                pairs.iter().find(|pair| pair.key == UNIT).and_then(|pair| pair.value.clone())
            });
            let reader = builder.build()?;
            Ok((reader.schema(), unit, Box::new(reader) as Batches))
        })?;
        Self::new(path, PARQUET, (schema, unit, batches), told)
    }

    /// A file of Arrow's, also known as Feather, or where it is none a stream.
    pub(super) fn arrow<R: Read + Seek + Send + 'static>(
        path: &Path,
        mut file: R,
        stream: bool,
        told: Option<&ColumnNames>,
    ) -> Result<Self> {
        let opened = guarded(path, ARROW, || {
            arrow_lengths::check(&mut file, stream)?;
            file.rewind()?;
            let batches: (SchemaRef, Batches) = if stream {
                let reader = StreamReader::try_new_buffered(file, None)?;
                (reader.schema(), Box::new(reader))
            } else {
                let reader = FileReader::try_new_buffered(file, None)?;
                (reader.schema(), Box::new(reader))
            };
            let unit = batches.0.metadata().get(UNIT).cloned();
            Ok((batches.0, unit, batches.1))
        })?;
        Self::new(path, ARROW, opened, told)
    }

    /// Batches that are in memory, or that another program hands over.
    pub(super) fn batches(
        name: &Path,
        batches: Box<dyn RecordBatchReader + Send>,
        told: Option<&ColumnNames>,
    ) -> Result<Self> {
        let opened = guarded(name, HANDED_OVER, || {
            let schema = batches.schema();
            let unit = schema.metadata().get(UNIT).cloned();
            Ok((schema, unit, batches as Batches))
        })?;
        Self::new(name, HANDED_OVER, opened, told)
    }

    fn new(
        path: &Path,
        kind: &'static str,
        (schema, unit, batches): (SchemaRef, Option<String>, Batches),
        told: Option<&ColumnNames>,
    ) -> Result<Self> {
        let mut names: Vec<String> =
            schema.fields().iter().map(|field| field.name().clone()).collect();
        let header = |names| Header { path, line: None, names };
        if let Some(ColumnNames::InOrder(own)) = told {
            if own.len() != names.len() {
                let problem = format!("{} columns, {} were named", names.len(), own.len());
                return Err(header(&names).refuse(problem));
            }
            for (name, own) in names.iter_mut().zip(own).filter(|(_, own)| !own.is_empty()) {
                name.clone_from(own);
            }
        }
        let layout = Layout::of(&header(&names), told)?;
        let reading = Reading { comma: true, lenient: false };
        let table = Table { path: path.into(), names, layout, reading };
        let table = Arc::new(table);
        Ok(Self { table, unit, kind, batches, rest: None, row: 0 })
    }

    /// The next rows, at most so many; none at the end.
    pub(super) fn next_rows(&mut self, most: usize) -> Result<Option<Rows>> {
        loop {
            let batch = match self.rest.take() {
                Some(rest) => rest,
                None => {
                    let (batches, columns) = (&mut self.batches, self.table.names.len());
                    let next = guarded(&self.table.path, self.kind, || {
                        let next = batches.next().transpose()?;
                        let is_whole =
                            next.as_ref().is_none_or(|next| next.num_columns() == columns);
                        if is_whole { Ok(next) } else { Err("a batch lacks columns".into()) }
                    })?;
                    match next {
                        Some(batch) => batch,
                        None => return Ok(None),
                    }
                }
            };
            let count = batch.num_rows().min(most);
            if count < batch.num_rows() {
                self.rest = Some(batch.slice(count, batch.num_rows() - count));
            }
            if count > 0 {
                let first = self.row + 1;
                self.row += count as u64;
                let rows = Rows::of_columns(Arc::clone(&self.table), batch.slice(0, count), first);
                return rows.map(Some);
            }
        }
    }
}

/// A file that is in memory.
pub(super) fn in_memory(bytes: Vec<u8>) -> Bytes {
    bytes.into()
}

/// Runs a reader that trusts its file more than we do: where it stops short, the file is damaged.
fn guarded<T>(path: &Path, kind: &str, work: impl FnOnce() -> Result<T, Foreign>) -> Result<T> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(damaged(path, kind, &error.to_string())),
        Err(_) => Err(damaged(path, kind, "its parts are inconsistent")),
    }
}

fn damaged(path: &Path, kind: &str, what: &str) -> Error {
    // The reader's own words for a compression that it was built without.
    if let Some((_, packed)) = what.split_once("Disabled feature at compile time: ") {
        let problem = format!("unsupported compression ({packed})");
        let hint =
            "write it with Snappy (the default of pandas), Zstandard or gzip, or uncompressed";
        return malformed(path, None, problem, hint);
    }
    let problem = format!("not a readable {kind}: {what}");
    if limits::is_told_by(what) {
        let hint = Hint::new("is this the file that you meant?", Remedy::Limits);
        return Error::Malformed { path: path.into(), line: None, problem, hint };
    }
    let hint = if kind == HANDED_OVER {
        "check the program that hands it over"
    } else {
        "is this the file that you meant? Was it copied completely?"
    };
    malformed(path, None, problem, hint)
}
