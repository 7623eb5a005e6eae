//! Points as Parquet, written in groups of rows.

use super::{
    super::columns::{Cells, Column, Columns, Texts},
    pages::Pages,
};
use crate::{Error, Result};
use bytes::Bytes;
use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical},
    column::writer::{
        ColumnCloseResult, ColumnWriter, get_column_writer, get_typed_column_writer_mut,
    },
    data_type::{ByteArray, ByteArrayType, Int64Type},
    errors::ParquetError,
    file::{
        properties::{EnabledStatistics, WriterProperties, WriterPropertiesPtr},
        reader::{ChunkReader, Length},
        writer::{SerializedFileWriter, SerializedPageWriter, TrackedWrite},
    },
    schema::types::{ColumnDescPtr, Type},
};
use rayon::prelude::*;
use std::{
    io::{Read, Write, empty},
    ops::Range,
    path::{Path, PathBuf},
    sync::Arc,
};

/// Rows that are written together: large enough to read by column, some megabytes to hold.
const GROUP: usize = 1 << 17;

/// Most rows of a page: half a megabyte of numbers, as other writers have it.
const PAGE: usize = 1 << 16;

/// Writes columns, some rows at a time, the columns at once.
pub struct ColumnsWriter<W: Write + Send> {
    path: PathBuf,
    file: SerializedFileWriter<W>,
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
        let file = SerializedFileWriter::new(sink, Arc::new(schema), Arc::new(properties.build()));
        let file = file.map_err(|e| writing(path, &e))?;
        let chunk = |(_, column): &(String, Column)| match column {
            Column::Numbers(_) | Column::Words(_) => Chunk::Pages(Pages::default()),
            Column::Integers(_) | Column::Texts(_) => Chunk::Cells(Vec::new()),
        };
        let chunks = like.columns.iter().map(chunk).collect();
        Ok(Self { path: path.into(), file, chunks, rows: 0 })
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
        self.rows = 0;
        let Self { file, chunks, path, .. } = self;
        let properties = Arc::clone(file.properties());
        let descriptors = file.schema_descr().columns().to_vec();
        let ended = chunks.par_iter().zip(descriptors).map(|(chunk, descriptor)| match chunk {
            Chunk::Pages(pages) => Ok((None, pages.close(descriptor)?)),
            Chunk::Cells(cells) => {
                packed(cells, descriptor, &properties).map(|(bytes, closed)| (Some(bytes), closed))
            }
        });
        let write = || {
            let ended: Vec<(Option<Vec<u8>>, ColumnCloseResult)> =
                ended.collect::<Result<_, ParquetError>>()?;
            let mut group = file.next_row_group()?;
            for ((own, closed), chunk) in ended.into_iter().zip(&*chunks) {
                let written = match (&own, chunk) {
                    (Some(own), _) => Written::Bytes(own),
                    (None, Chunk::Pages(pages)) => Written::Pages(pages),
                    (None, Chunk::Cells(_)) => continue,
                };
                group.append_column(&written, closed)?;
            }
            group.close()
        };
        write().map_err(|e: ParquetError| writing(path, &e))?;
        for chunk in &mut self.chunks {
            match chunk {
                Chunk::Pages(pages) => pages.clear(),
                Chunk::Cells(cells) => cells.clear(),
            }
        }
        Ok(())
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

/// A column's pages in memory, as something to copy from.
enum Written<'a> {
    Bytes(&'a [u8]),
    Pages(&'a Pages),
}

impl Length for Written<'_> {
    fn len(&self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::Pages(pages) => pages.length() as u64,
        }
    }
}

impl<'a> ChunkReader for Written<'a> {
    type T = Box<dyn Read + 'a>;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let pieces: Vec<&'a [u8]> = match self {
            Self::Bytes(bytes) => vec![bytes],
            Self::Pages(pages) => pages.pieces().collect(),
        };
        let (mut all, mut left): (Self::T, _) = (Box::new(empty()), start);
        for piece in pieces {
            let skipped = left.min(piece.len() as u64);
            left -= skipped;
            all = Box::new(all.chain(&piece[skipped as usize..]));
        }
        Ok(all)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        let mut bytes = Vec::with_capacity(length.min(self.len() as usize));
        self.get_read(start)?.take(length as u64).read_to_end(&mut bytes)?;
        Ok(bytes.into())
    }
}

/// The pages of whole numbers or text, compressed.
fn packed(
    cells: &[(Arc<Column>, Range<usize>)],
    descriptor: ColumnDescPtr,
    properties: &WriterPropertiesPtr,
) -> Result<(Vec<u8>, ColumnCloseResult), ParquetError> {
    let mut sink = TrackedWrite::new(Vec::new());
    let pages = Box::new(SerializedPageWriter::new(&mut sink));
    let mut writer = get_column_writer(descriptor, Arc::clone(properties), pages);
    for (column, rows) in cells {
        add(&mut writer, column, rows.clone())?;
    }
    let closed = writer.close()?;
    Ok((sink.into_inner()?, closed))
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
