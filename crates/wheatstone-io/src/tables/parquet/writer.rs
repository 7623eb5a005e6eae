//! Points as Parquet, written in groups of rows.

use super::{
    super::columns::{Cells, Column, Columns, Texts},
    pages::Pages,
};
use bytes::Bytes;
use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical},
    column::writer::{ColumnWriter, get_column_writer, get_typed_column_writer_mut},
    data_type::{ByteArray, ByteArrayType, Int64Type},
    errors::ParquetError,
    file::{
        metadata::{
            ColumnChunkMetaData, FileMetaData, ParquetMetaData, ParquetMetaDataWriter,
            RowGroupMetaData,
        },
        properties::{EnabledStatistics, WriterProperties, WriterPropertiesPtr},
        writer::{SerializedPageWriter, TrackedWrite},
    },
    schema::types::{ColumnDescPtr, SchemaDescPtr, SchemaDescriptor, Type},
};
use rayon::prelude::*;
use std::{
    io::Write,
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};
use wheatstone_core::{Error, Result};

/// Rows that are written together: large enough to read by column, some megabytes to hold.
const GROUP: usize = 1 << 17;

/// Most rows of a page: half a megabyte of numbers, as other writers have it.
const PAGE: usize = 1 << 16;

/// Writes columns, some rows at a time, the columns at once.
pub struct ColumnsWriter<W: Write + Send> {
    path: PathBuf,
    sink: W,
    /// Bytes that went there.
    written: u64,
    schema: SchemaDescPtr,
    properties: WriterPropertiesPtr,
    groups: Vec<RowGroupMetaData>,
    chunks: Vec<Chunk>,
    /// Rows in them.
    rows: usize,
}

/// What is gathered of a column before its group is written.
enum Chunk {
    /// Numbers and a few words.
    Pages(Pages),
    /// What repeats or is short: cells, to be compressed together.
    Cells(Vec<(Arc<Column>, Range<usize>)>),
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
                Column::Texts(_) | Column::Words(_) => Physical::BYTE_ARRAY,
            };
            let text = (kind == Physical::BYTE_ARRAY).then_some(LogicalType::String);
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
        // Of what is not put together by hand: whole numbers, and text, which repeats.
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true)
            .set_created_by(concat!("wheatstone ", env!("CARGO_PKG_VERSION")).into());
        for (name, column) in &like.columns {
            if matches!(column, Column::Texts(_)) {
                properties = properties.set_column_dictionary_enabled(name.as_str().into(), true);
            }
        }
        let chunk = |(_, column): &(String, Column)| match column {
            Column::Numbers(_) | Column::Words(_) => Chunk::Pages(Pages::default()),
            Column::Integers(_) | Column::Texts(_) => Chunk::Cells(Vec::new()),
        };
        let mut writer = Self {
            path: path.into(),
            sink,
            written: 0,
            schema: Arc::new(SchemaDescriptor::new(Arc::new(schema))),
            properties: Arc::new(properties.build()),
            groups: Vec::new(),
            chunks: like.columns.iter().map(chunk).collect(),
            rows: 0,
        };
        writer.put(MAGIC)?;
        Ok(writer)
    }

    /// Adds rows of the same columns.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn write(&mut self, rows: Columns) -> Result<()> {
        let count = rows.rows();
        let columns: Vec<Arc<Column>> =
            rows.columns.into_iter().map(|(_, column)| Arc::new(column)).collect();
        let mut begin = 0;
        while begin < count {
            let end = count.min(begin + PAGE.min(GROUP - self.rows));
            self.chunks.par_iter_mut().zip(&columns).for_each(|(chunk, column)| match chunk {
                Chunk::Pages(pages) => pages.add(column, begin..end),
                Chunk::Cells(cells) => cells.push((Arc::clone(column), begin..end)),
            });
            self.rows += end - begin;
            begin = end;
            if self.rows == GROUP {
                self.group()?;
            }
        }
        Ok(())
    }

    /// Writes what is gathered.
    fn group(&mut self) -> Result<()> {
        if self.rows == 0 {
            return Ok(());
        }
        let rows = std::mem::take(&mut self.rows);
        let mut chunks = std::mem::take(&mut self.chunks);
        let ended = chunks.par_iter().zip(self.schema.columns());
        let ended = ended.map(|(chunk, descriptor)| match chunk {
            Chunk::Pages(pages) => Ok((None, pages.close(Arc::clone(descriptor))?)),
            Chunk::Cells(cells) => packed(cells, Arc::clone(descriptor), &self.properties)
                .map(|(bytes, metadata)| (Some(bytes), metadata)),
        });
        let ended: Result<Vec<_>, ParquetError> = ended.collect();
        let (begin, mut columns) = (self.written, Vec::with_capacity(chunks.len()));
        for ((own, metadata), chunk) in
            ended.map_err(|e| writing(&self.path, &e))?.into_iter().zip(&chunks)
        {
            columns.push(moved(metadata, self.written).map_err(|e| writing(&self.path, &e))?);
            match (own, chunk) {
                (Some(own), _) => self.put(&own)?,
                (None, Chunk::Pages(pages)) => {
                    pages.pieces().try_for_each(|piece| self.put(piece))?;
                }
                (None, Chunk::Cells(_)) => {}
            }
        }
        let group = RowGroupMetaData::builder(Arc::clone(&self.schema))
            .set_total_byte_size(columns.iter().map(ColumnChunkMetaData::uncompressed_size).sum())
            .set_column_metadata(columns)
            .set_num_rows(rows as i64)
            .set_file_offset(begin as i64);
        self.groups.push(group.build().map_err(|e| writing(&self.path, &e))?);
        for chunk in &mut chunks {
            match chunk {
                Chunk::Pages(pages) => pages.clear(),
                Chunk::Cells(cells) => cells.clear(),
            }
        }
        self.chunks = chunks;
        Ok(())
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.written += bytes.len() as u64;
        self.sink.write_all(bytes).map_err(|e| Error::writing(&self.path, e))
    }

    /// Ends the file and gives back where it went.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<W> {
        self.group()?;
        let rows = self.groups.iter().map(RowGroupMetaData::num_rows).sum();
        let file = FileMetaData::new(
            self.properties.writer_version().as_num(),
            rows,
            Some(self.properties.created_by().to_owned()),
            None,
            Arc::clone(&self.schema),
            None,
        );
        let metadata = ParquetMetaData::new(file, std::mem::take(&mut self.groups));
        let mut end = Vec::new();
        let ended = ParquetMetaDataWriter::new(&mut end, &metadata).finish();
        ended.map_err(|e| writing(&self.path, &e))?;
        self.put(&end)?;
        Ok(self.sink)
    }
}

/// What a Parquet file begins with.
const MAGIC: &[u8] = b"PAR1";

/// What the file's end says of a column whose bytes begin there.
fn moved(column: ColumnChunkMetaData, begin: u64) -> Result<ColumnChunkMetaData, ParquetError> {
    let data = column.data_page_offset() + begin as i64;
    let dictionary = column.dictionary_page_offset().map(|offset| offset + begin as i64);
    column.into_builder().set_data_page_offset(data).set_dictionary_page_offset(dictionary).build()
}

/// The pages of whole numbers or text, compressed.
fn packed(
    cells: &[(Arc<Column>, Range<usize>)],
    descriptor: ColumnDescPtr,
    properties: &WriterPropertiesPtr,
) -> Result<(Vec<u8>, ColumnChunkMetaData), ParquetError> {
    let mut sink = TrackedWrite::new(Vec::new());
    let pages = Box::new(SerializedPageWriter::new(&mut sink));
    let mut writer = get_column_writer(descriptor, Arc::clone(properties), pages);
    for (column, rows) in cells {
        add(&mut writer, column, rows.clone())?;
    }
    let closed = writer.close()?;
    Ok((sink.into_inner()?, closed.metadata))
}

fn add(writer: &mut ColumnWriter, column: &Column, rows: Range<usize>) -> Result<(), ParquetError> {
    match column {
        Column::Integers(cells) => {
            let values = there(cells, rows.clone());
            let levels = levels(cells.held(), rows);
            let writer = get_typed_column_writer_mut::<Int64Type>(writer);
            writer.write_batch(&values, Some(&levels), None)?;
        }
        Column::Texts(texts) => {
            let values = pieces(texts, rows.clone());
            let levels = levels(texts.held(), rows);
            let writer = get_typed_column_writer_mut::<ByteArrayType>(writer);
            writer.write_batch(&values, Some(&levels), None)?;
        }
        Column::Numbers(_) | Column::Words(_) => {}
    }
    Ok(())
}

/// 1 for each cell that holds something and 0 for each that does not.
fn levels(held: Option<&[bool]>, rows: Range<usize>) -> Vec<i16> {
    match held {
        Some(held) => held[rows].iter().map(|held| i16::from(*held)).collect(),
        None => vec![1; rows.len()],
    }
}

/// The values that are held.
fn there(cells: &Cells<i64>, rows: Range<usize>) -> Vec<i64> {
    rows.filter_map(|row| cells.get(row).copied()).collect()
}

/// The texts that are held, all in one piece of memory.
fn pieces(texts: &Texts, rows: Range<usize>) -> Vec<ByteArray> {
    if rows.is_empty() {
        return Vec::new();
    }
    let (begin, end) = (texts.range(rows.start).start, texts.range(rows.end - 1).end);
    let whole = Bytes::copy_from_slice(&texts.whole().as_bytes()[begin..end]);
    let held = rows.filter(|row| texts.get(*row).is_some());
    held.map(|row| {
        let own = texts.range(row);
        whole.slice(own.start - begin..own.end - begin).into()
    })
    .collect()
}

fn writing(path: &Path, error: &ParquetError) -> Error {
    Error::writing(path, std::io::Error::other(error.to_string()))
}
