//! Lengths that a Parquet file says of its parts, before memory is taken for them.
//!
//! Source: the Apache Parquet format; Thrift's compact protocol, in which its footer is written.

use super::cells::Foreign;
use parquet::{
    arrow::arrow_reader::ParquetRecordBatchReaderBuilder, errors::ParquetError,
    file::reader::ChunkReader,
};

/// The footer's length in bytes, and the magic word.
const END: u64 = 8;

/// Structures within each other, in a footer, at most.
const DEEPEST: usize = 32;

/// Refuses a footer with lists of more members than it has bytes. What is wrong otherwise is left to the reader.
pub(super) fn check_footer(file: &impl ChunkReader) -> Result<(), Foreign> {
    let Some(end) = file.len().checked_sub(END) else { return Ok(()) };
    let last = file.get_bytes(end, END as usize)?;
    let Some((length, _)) = last.split_first_chunk::<4>() else { return Ok(()) };
    let length = u32::from_le_bytes(*length);
    let Some(begin) = end.checked_sub(u64::from(length)) else { return Ok(()) };
    let footer = file.get_bytes(begin, length as usize)?;
    let mut walk = Walk { rest: &footer, too_long: false };
    // Where it stops short, the reader says why.
    let _ = walk.structure(0);
    if walk.too_long {
        Err("a list with more members than the file has bytes".into())
    } else {
        Ok(())
    }
}

/// Refuses columns that lie beyond the file's end.
pub(super) fn check_columns<F: ChunkReader + 'static>(
    builder: &ParquetRecordBatchReaderBuilder<F>,
    size: u64,
) -> Result<(), Foreign> {
    for column in builder.metadata().row_groups().iter().flat_map(|group| group.columns()) {
        let (begin, length) = column.byte_range();
        if begin.checked_add(length).is_none_or(|end| end > size) {
            return Err(ParquetError::EOF("a column is longer than the file".into()).into());
        }
    }
    Ok(())
}

/// A walk through values of Thrift's compact protocol.
struct Walk<'a> {
    rest: &'a [u8],
    too_long: bool,
}

impl Walk<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*first)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.rest = self.rest.get(count..)?;
        Some(())
    }

    /// A number, seven bits a byte.
    fn number(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// So many members, each of at least a byte.
    fn members(&mut self, count: u64) -> Option<u64> {
        self.too_long |= count > self.rest.len() as u64;
        (!self.too_long).then_some(count)
    }

    fn structure(&mut self, depth: usize) -> Option<()> {
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            if head >> 4 == 0 {
                self.number()?;
            }
            // The field's kind says what a truth value is.
            if !matches!(head & 0x0F, 1 | 2) {
                self.value(head & 0x0F, depth + 1)?;
            }
        }
    }

    fn value(&mut self, kind: u8, depth: usize) -> Option<()> {
        match kind {
            1..=3 => self.skip(1),
            4..=6 => self.number().map(drop),
            7 => self.skip(8),
            8 => {
                let length = self.number()?;
                self.skip(usize::try_from(length).ok()?)
            }
            9 | 10 if depth < DEEPEST => {
                let head = self.byte()?;
                let count = if head >> 4 == 15 { self.number()? } else { u64::from(head >> 4) };
                (0..self.members(count)?).try_for_each(|_| self.value(head & 0x0F, depth + 1))
            }
            12 if depth < DEEPEST => self.structure(depth),
            // Maps are in no footer.
            _ => None,
        }
    }
}
