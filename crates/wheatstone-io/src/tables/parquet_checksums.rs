//! Checksums in Parquet files, so that damage is noticed: of each page, as the format has them, and of the footer.
//!
//! Source: the Apache Parquet format. Crate `parquet` verifies the checksums of pages but writes none. For the footer
//! the format has no checksum: it is a key of the footer's metadata here, over the footer with zeros for its digits.

use super::cells::Foreign;
use bytes::Bytes;
use parquet::{
    arrow::arrow_writer::ArrowColumnChunk,
    column::page_store::{PageKey, PageStore, PageStoreArgs, PageStoreFactory},
    errors::{ParquetError, Result},
    file::metadata::KeyValue,
};
use std::{
    io::{self, Write},
    ops::Range,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

/// Bytes that checksums add to a column.
type Added = Arc<AtomicUsize>;

/// Makes stores whose pages get checksums, and keeps account of what these add to the columns of a group.
#[derive(Debug, Default)]
pub(super) struct CheckedStores(Mutex<Vec<Added>>);

/// The pages of a column: headers and data by turns.
struct CheckedStore {
    blobs: Vec<Bytes>,
    added: Added,
}

impl PageStoreFactory for CheckedStores {
    fn create(&self, _: &PageStoreArgs) -> Result<Box<dyn PageStore>> {
        let added = Added::default();
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(&added));
        Ok(Box::new(CheckedStore { blobs: Vec::new(), added }))
    }
}

impl CheckedStores {
    /// Corrects the lengths that a group's columns, in their order, say of themselves.
    pub(super) fn correct(&self, columns: &mut [ArrowColumnChunk]) -> Result<()> {
        let added = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        for (column, added) in columns.iter_mut().zip(added) {
            let (close, added) = (column.close_mut(), added.load(Ordering::Relaxed));
            let (old, more) = (close.metadata.clone(), added as i64);
            close.bytes_written += added as u64;
            close.metadata = old
                .clone()
                .into_builder()
                .set_total_compressed_size(old.compressed_size() + more)
                .set_total_uncompressed_size(old.uncompressed_size() + more)
                .build()?;
        }
        Ok(())
    }
}

impl PageStore for CheckedStore {
    fn put(&mut self, value: Bytes) -> Result<PageKey> {
        let place = self.blobs.len();
        if let Some(header) = self.blobs.last_mut().filter(|_| place % 2 == 1) {
            let checked = with_checksum(header, crc32fast::hash(&value))
                .ok_or_else(|| ParquetError::General("a page without a header".into()))?;
            self.added.fetch_add(checked.len() - header.len(), Ordering::Relaxed);
            *header = checked.into();
        }
        self.blobs.push(value);
        Ok(PageKey::new(place as u64))
    }

    fn take(&mut self, key: PageKey) -> Result<Bytes> {
        let blob = self.blobs.get_mut(key.get() as usize).map(std::mem::take);
        blob.ok_or_else(|| ParquetError::General("a page that was not written".into()))
    }
}

/// A page's header with the field that holds the checksum of its data: the fourth, after three numbers.
fn with_checksum(header: &[u8], checksum: u32) -> Option<Vec<u8>> {
    /// How Thrift's compact protocol begins the field after the last one, of 32 bits.
    const NEXT_NUMBER: u8 = 0x15;
    let mut begin = 0;
    for _ in 0..3 {
        (*header.get(begin)? == NEXT_NUMBER).then_some(())?;
        begin += 2 + header.get(begin + 1..)?.iter().position(|byte| *byte < 0x80)?;
    }
    let (before, after) = header.split_at_checked(begin)?;
    let (next, after) = after.split_first()?;
    let mut checked = before.to_vec();
    checked.push(NEXT_NUMBER);
    let signed = checksum.cast_signed();
    let mut number = ((signed << 1) ^ (signed >> 31)).cast_unsigned();
    while number >= 0x80 {
        checked.push(number as u8 | 0x80);
        number >>= 7;
    }
    checked.push(number as u8);
    // The next field's number is told by the distance from the last one.
    checked.push(next.checked_sub(0x10)?);
    checked.extend_from_slice(after);
    Some(checked)
}

/// The key of the footer's checksum.
const KEY: &str = "wheatstone:footer_crc32";

/// What stands for the checksum's digits while it is worked out.
const ZEROS: &str = "00000000";

/// Where the digits of a footer's checksum are, if it has one.
fn digits(footer: &[u8]) -> Option<Range<usize>> {
    let key = footer.windows(KEY.len()).rposition(|window| window == KEY.as_bytes())?;
    // A byte says that a text follows, one how long it is.
    let begin = key + KEY.len() + 2;
    (begin + ZEROS.len() <= footer.len()).then_some(begin..begin + ZEROS.len())
}

/// The checksum of a footer whose own digits are there.
fn of_footer(footer: &[u8], digits: &Range<usize>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&footer[..digits.start]);
    hasher.update(ZEROS.as_bytes());
    hasher.update(&footer[digits.end..]);
    format!("{:08x}", hasher.finalize())
}

/// Refuses a footer that has a checksum and is not what was written.
pub(super) fn check_footer(footer: &[u8]) -> std::result::Result<(), Foreign> {
    match digits(footer) {
        Some(digits) if footer[digits.clone()] != *of_footer(footer, &digits).as_bytes() => {
            Err("its footer is not what was written: its checksum differs".into())
        }
        _ => Ok(()),
    }
}

/// An output that holds the end of the file back until the footer's checksum is in it.
pub(super) struct CheckedOutput<W> {
    output: W,
    end: Option<Vec<u8>>,
}

impl<W: Write> CheckedOutput<W> {
    pub(super) fn new(output: W) -> Self {
        Self { output, end: None }
    }

    /// Holds back what comes from here on, and gives the footer's entry for its checksum.
    pub(super) fn hold(&mut self) -> KeyValue {
        self.end = Some(Vec::new());
        KeyValue::new(KEY.to_owned(), ZEROS.to_owned())
    }

    /// Writes what was held back.
    pub(super) fn finish(mut self) -> io::Result<W> {
        let mut end = self.end.take().unwrap_or_default();
        // The footer, its length in four bytes, the format's mark.
        if let Some((before, [length @ .., _, _, _, _])) = end.split_last_chunk_mut::<8>() {
            let length = u32::from_le_bytes(*length) as usize;
            let begin = before.len().saturating_sub(length);
            let footer = &mut before[begin..];
            if let Some(digits) = digits(footer) {
                let checksum = of_footer(footer, &digits);
                footer[digits].copy_from_slice(checksum.as_bytes());
            }
        }
        self.output.write_all(&end)?;
        Ok(self.output)
    }
}

impl<W: Write> Write for CheckedOutput<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.end {
            Some(end) => end.write(bytes),
            None => self.output.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}
