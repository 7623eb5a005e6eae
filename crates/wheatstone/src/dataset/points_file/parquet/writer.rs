//! Points as Parquet, written in groups of rows.

use super::super::columns::{Column, Columns};
use crate::{Error, Result};
use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical},
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    errors::ParquetError,
    file::{
        properties::{EnabledStatistics, WriterProperties},
        writer::SerializedFileWriter,
    },
    schema::types::Type,
};
use std::{
    io::Write,
    path::{Path, PathBuf},
    sync::Arc,
};

/// Rows that are written together: large enough to compress well, some megabytes to hold.
const GROUP: usize = 1 << 17;

/// Writes columns, some rows at a time.
pub struct ColumnsWriter<W: Write + Send> {
    path: PathBuf,
    file: SerializedFileWriter<W>,
    held: Columns,
}

impl<W: Write + Send> ColumnsWriter<W> {
    /// Begins a file with the names and kinds of these columns; `path` stands for it in messages.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn new(path: &Path, sink: W, like: &Columns) -> Result<Self> {
        let field = |(name, column): &(String, Column)| {
            let kind = match column {
                Column::Numbers(_) => Physical::DOUBLE,
                Column::Integers(_) => Physical::INT64,
                Column::Texts(_) => Physical::BYTE_ARRAY,
            };
            let text = matches!(column, Column::Texts(_)).then_some(LogicalType::String);
            let built = Type::primitive_type_builder(name, kind)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(text)
                .build();
            built.map(Arc::new)
        };
        let fields = like.columns.iter().map(field).collect::<Result<Vec<_>, _>>();
        let schema = fields
            .and_then(|fields| Type::group_type_builder("points").with_fields(fields).build())
            .map_err(|e| writing(path, &e))?;
        // Measured numbers hardly ever repeat; names do.
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_created_by(concat!("wheatstone ", env!("CARGO_PKG_VERSION")).into());
        for (name, column) in &like.columns {
            if matches!(column, Column::Texts(_)) {
                properties = properties.set_column_dictionary_enabled(name.as_str().into(), true);
            }
        }
        let file = SerializedFileWriter::new(sink, Arc::new(schema), Arc::new(properties.build()));
        let file = file.map_err(|e| writing(path, &e))?;
        Ok(Self { path: path.into(), file, held: Columns::default() })
    }

    /// Adds rows of the same columns.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write(&mut self, rows: Columns) -> Result<()> {
        self.held.extend(rows);
        if self.held.rows() >= GROUP { self.group() } else { Ok(()) }
    }

    /// Writes what is held.
    fn group(&mut self) -> Result<()> {
        let held = std::mem::take(&mut self.held);
        if held.rows() == 0 {
            return Ok(());
        }
        let file = &mut self.file;
        let mut write = || {
            let mut group = file.next_row_group()?;
            for (_, column) in &held.columns {
                let Some(mut sink) = group.next_column()? else { break };
                match column {
                    Column::Numbers(cells) => {
                        let (levels, values) = split(cells, |value| *value);
                        sink.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
                    }
                    Column::Integers(cells) => {
                        let (levels, values) = split(cells, |value| *value);
                        sink.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
                    }
                    Column::Texts(cells) => {
                        let (levels, values) = split(cells, |text| ByteArray::from(text.as_str()));
                        sink.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
                    }
                }
                sink.close()?;
            }
            group.close()
        };
        write().map(|_| ()).map_err(|e| writing(&self.path, &e))
    }

    /// Ends the file and gives back where it went.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<W> {
        self.group()?;
        self.file.into_inner().map_err(|e| writing(&self.path, &e))
    }
}

/// 1 for each cell that holds something and 0 for each that does not, and what the first hold.
fn split<C, V>(cells: &[Option<C>], value: impl Fn(&C) -> V) -> (Vec<i16>, Vec<V>) {
    let levels = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    (levels, cells.iter().flatten().map(value).collect())
}

fn writing(path: &Path, error: &ParquetError) -> Error {
    Error::writing(path, std::io::Error::other(error.to_string()))
}
