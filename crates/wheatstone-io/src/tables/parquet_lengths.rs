//! Lengths that a Parquet file says of its parts are checked before memory is taken for them.
//!
//! Source: the Apache Parquet format.

use super::{
    cells::Foreign,
    parquet_checksums,
    thrift::{FOOTER, PAGE_HEADER, Walk},
};
use bytes::Bytes;
use flate2::read::MultiGzDecoder;
use parquet::{
    arrow::arrow_reader::ArrowReaderMetadata,
    basic::Compression,
    errors::ParquetError,
    file::reader::{ChunkReader, Length},
};
use std::{
    io::{self, Read},
    ops::Range,
};
use wheatstone_core::limits;

/// The footer's length in bytes, and the magic word.
const END: u64 = 8;

/// Refuses a footer with lists of more members than it has bytes, and one whose fields are of other types than the
/// format says: the reader goes by their numbers alone, and would take anything for the length of a list.
pub(super) fn check_footer(file: &impl ChunkReader) -> Result<(), Foreign> {
    let Some(end) = file.len().checked_sub(END) else { return Ok(()) };
    let last = file.get_bytes(end, END as usize)?;
    let Some((length, _)) = last.split_first_chunk::<4>() else { return Ok(()) };
    let length = u32::from_le_bytes(*length);
    let Some(begin) = end.checked_sub(u64::from(length)) else { return Ok(()) };
    let footer = file.get_bytes(begin, length as usize)?;
    parquet_checksums::check_footer(&footer)?;
    let mut walk = Walk::of(&footer);
    match walk.structure((Some(FOOTER), false), 0) {
        _ if walk.too_long => Err("a list with more members than the file has bytes".into()),
        None => Err("its footer is damaged".into()),
        Some(()) => Ok(()),
    }
}

/// Refuses columns that lie beyond the file's end.
pub(super) fn check_columns(metadata: &ArrowReaderMetadata, size: u64) -> Result<(), Foreign> {
    for column in metadata.metadata().row_groups().iter().flat_map(|group| group.columns()) {
        let (begin, length) = column.byte_range();
        if begin.checked_add(length).is_none_or(|end| end > size) {
            return Err(ParquetError::EOF("a column is longer than the file".into()).into());
        }
    }
    Ok(())
}

/// A file whose page headers are checked before they are read: the reader streams nothing else.
pub(super) struct CheckedPages<F> {
    file: F,
    /// Columns whose pages the reader unpacks without an end, and how they are packed.
    unbounded: Vec<(Range<u64>, Compression)>,
}

/// How many times smaller LZ4 makes anything, at most.
const LZ4_RATIO: u64 = 255;

/// Bytes in which a page's header ends as a rule, and in which it must end: statistics may hold long texts.
const HEADER_BYTES: [u64; 2] = [1 << 10, 1 << 22];

/// Refuses a part that would unpack to more bytes than are held at once.
fn refuse_beyond(bytes: u64) -> Result<(), ParquetError> {
    let limit = limits::PART_BYTES;
    if bytes <= limit.most() { Ok(()) } else { Err(ParquetError::from(limit.exceeded())) }
}

impl<F: ChunkReader> CheckedPages<F> {
    pub(super) fn new(file: F, metadata: &ArrowReaderMetadata) -> Self {
        let columns = metadata.metadata().row_groups().iter().flat_map(|group| group.columns());
        let unbounded = columns.filter_map(|column| {
            let (begin, length) = column.byte_range();
            let is_bounded =
                !matches!(column.compression(), Compression::GZIP(_) | Compression::LZ4);
            (!is_bounded).then(|| (begin..begin + length, column.compression()))
        });
        let unbounded = unbounded.collect();
        Self { file, unbounded }
    }

    /// Refuses a page that unpacks to more bytes than its header says: the reader notices when it has taken memory
    /// for all of them. Here they are unpacked and dropped.
    fn check_unpacked(&self, start: u64, header: u64, walk: &Walk) -> Result<(), ParquetError> {
        let place = |(range, _): &&(Range<u64>, _)| range.contains(&start);
        let Some((_, packing)) = self.unbounded.iter().find(place) else { return Ok(()) };
        let number = |outer, own| u64::try_from(walk.found(outer, own).unwrap_or(0)).unwrap_or(0);
        let (unpacked, packed) = (number(2, 2), number(3, 3));
        if *packing == Compression::LZ4 {
            return refuse_beyond(packed.saturating_mul(LZ4_RATIO));
        }
        // What says which values there are is not packed, in pages of the second kind.
        let levels = number(8, 5).saturating_add(number(8, 6));
        let length = usize::try_from(packed.saturating_sub(levels)).unwrap_or(usize::MAX);
        let begin = start.saturating_add(header).saturating_add(levels);
        let bytes = self.file.get_bytes(begin, length)?;
        let mut bounded = MultiGzDecoder::new(&bytes[..]).take(unpacked + 1);
        // What cannot be unpacked is refused by the reader.
        match io::copy(&mut bounded, &mut io::sink()) {
            Ok(found) if found > unpacked => {
                Err(ParquetError::General("a page is larger than its header says".into()))
            }
            _ => Ok(()),
        }
    }

    /// How many rows can be decoded at once, at most so many: each may hold the longest text of a dictionary, which is
    /// no longer than the dictionary; other columns have what their bytes come to by row.
    pub(super) fn rows_at_once(
        &self,
        metadata: &ArrowReaderMetadata,
        most: usize,
    ) -> Result<usize, ParquetError> {
        let mut longest = 0;
        for group in metadata.metadata().row_groups() {
            let mut of_group = 0;
            for column in group.columns() {
                let by_row = column.uncompressed_size() / group.num_rows().max(1);
                of_group += u64::try_from(by_row).unwrap_or(0);
                let Some(place) = column.dictionary_page_offset() else { continue };
                let place = u64::try_from(place).unwrap_or(0);
                let left = self.file.len().saturating_sub(place);
                let bytes = self.file.get_bytes(place, HEADER_BYTES[0].min(left) as usize)?;
                let mut walk = Walk::of(&bytes);
                // What is no header is refused when its page is read.
                if walk.structure((Some(PAGE_HEADER), false), 0).is_some() {
                    let size = walk.found(2, 2).and_then(|size| u64::try_from(size).ok());
                    of_group += size.unwrap_or(0);
                }
            }
            longest = of_group.max(longest);
        }
        refuse_beyond(longest)?;
        let rows = limits::BATCH_BYTES.most() / longest.max(1);
        Ok(usize::try_from(rows).map_or(most, |rows| rows.clamp(1, most)))
    }
}

impl<F: ChunkReader> Length for CheckedPages<F> {
    fn len(&self) -> u64 {
        self.file.len()
    }
}

impl<F: ChunkReader> ChunkReader for CheckedPages<F> {
    type T = F::T;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let left = self.file.len().saturating_sub(start);
        for most in HEADER_BYTES {
            let bytes = self.file.get_bytes(start, most.min(left) as usize)?;
            let mut walk = Walk::of(&bytes);
            if walk.structure((Some(PAGE_HEADER), false), 0).is_some() {
                // Each value of a dictionary takes a byte or more; memory is taken for all of them at once.
                let [size, values] = [(2, 2), (7, 1)].map(|(outer, own)| walk.found(outer, own));
                if values.is_some_and(|values| !(0..=size.unwrap_or(0)).contains(&values)) {
                    break;
                }
                refuse_beyond(size.and_then(|size| u64::try_from(size).ok()).unwrap_or(0))?;
                self.check_unpacked(start, (bytes.len() - walk.rest.len()) as u64, &walk)?;
                return self.file.get_read(start);
            }
        }
        Err(ParquetError::General("a page's header is damaged".into()))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        self.file.get_bytes(start, length)
    }
}
