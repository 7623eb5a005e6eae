//! Lengths that a Parquet file says of its parts are checked before memory is taken for them.
//!
//! Source: the Apache Parquet format; Thrift's compact protocol, in which its footer is written.

use super::{cells::Foreign, parquet_checksums};
use bytes::Bytes;
use parquet::{
    arrow::arrow_reader::ArrowReaderMetadata,
    errors::ParquetError,
    file::reader::{ChunkReader, Length},
};
use wheatstone_core::limits;

/// The footer's length in bytes, and the magic word.
const END: u64 = 8;

/// Structures within each other, in a footer, at most.
const DEEPEST: usize = 32;

/// Fields of a structure by their numbers; others are passed over.
type Fields = &'static [(i64, Type)];

/// What the format says that a field holds.
#[derive(Clone, Copy)]
enum Type {
    Truth,
    Byte,
    /// Of 16, 32 or 64 bits, all written alike; enumerations too.
    Whole,
    Double,
    Text,
    List(&'static Type),
    Structure(Fields),
    /// One of several structures.
    Union(Fields),
}

use Type::{Byte, Double, List, Structure, Text, Truth, Union, Whole};

const FOOTER: Fields = &[
    (1, Whole),
    (2, List(&Structure(SCHEMA_ELEMENT))),
    (3, Whole),
    (4, List(&Structure(ROW_GROUP))),
    (5, List(&Structure(KEY_VALUE))),
    (6, Text),
    (7, List(&Union(&[]))),
    (9, Text),
];
const SCHEMA_ELEMENT: Fields = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Text),
    (5, Whole),
    (6, Whole),
    (7, Whole),
    (8, Whole),
    (9, Whole),
    (10, Union(LOGICAL_TYPE)),
];
const LOGICAL_TYPE: Fields = &[
    (5, Structure(&[(1, Whole), (2, Whole)])),
    (7, Structure(TIME)),
    (8, Structure(TIME)),
    (10, Structure(&[(1, Byte), (2, Truth)])),
    (16, Structure(&[(1, Byte)])),
    (17, Structure(&[(1, Text)])),
    (18, Structure(&[(1, Text), (2, Whole)])),
];
const TIME: Fields = &[(1, Truth), (2, Union(&[]))];
const KEY_VALUE: Fields = &[(1, Text), (2, Text)];
const ROW_GROUP: Fields = &[
    (1, List(&Structure(COLUMN))),
    (2, Whole),
    (3, Whole),
    (4, List(&Structure(&[(1, Whole), (2, Truth), (3, Truth)]))),
    (5, Whole),
    (6, Whole),
    (7, Whole),
];
const COLUMN: Fields = &[
    (1, Text),
    (2, Whole),
    (3, Structure(COLUMN_METADATA)),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Whole),
];
const COLUMN_METADATA: Fields = &[
    (1, Whole),
    (2, List(&Whole)),
    (3, List(&Text)),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Whole),
    (8, List(&Structure(KEY_VALUE))),
    (9, Whole),
    (10, Whole),
    (11, Whole),
    (12, Structure(STATISTICS)),
    (13, List(&Structure(&[(1, Whole), (2, Whole), (3, Whole)]))),
    (14, Whole),
    (15, Whole),
    (16, Structure(&[(1, Whole), (2, List(&Whole)), (3, List(&Whole))])),
    (17, Structure(&[(1, Structure(BOX)), (2, List(&Whole))])),
];
const STATISTICS: Fields =
    &[(1, Text), (2, Text), (3, Whole), (4, Whole), (5, Text), (6, Text), (7, Truth), (8, Truth)];
const BOX: Fields = &[
    (1, Double),
    (2, Double),
    (3, Double),
    (4, Double),
    (5, Double),
    (6, Double),
    (7, Double),
    (8, Double),
];

const PAGE_HEADER: Fields = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Structure(&[(1, Whole), (2, Whole), (3, Whole), (4, Whole), (5, Structure(STATISTICS))])),
    (6, Structure(&[])),
    (7, Structure(&[(1, Whole), (2, Whole), (3, Truth)])),
    (8, Structure(DATA_PAGE_2)),
];
const DATA_PAGE_2: Fields = &[
    (1, Whole),
    (2, Whole),
    (3, Whole),
    (4, Whole),
    (5, Whole),
    (6, Whole),
    (7, Truth),
    (8, Structure(STATISTICS)),
];

impl Type {
    /// Whether a value of this kind, as its protocol counts kinds, is one.
    fn is(self, kind: u8) -> bool {
        match self {
            Truth => matches!(kind, 1 | 2),
            Byte => kind == 3,
            Whole => (4..=6).contains(&kind),
            Double => kind == 7,
            Text => kind == 8,
            List(_) => kind == 9,
            Structure(_) | Union(_) => kind == 12,
        }
    }
}

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
pub(super) struct CheckedPages<F>(pub(super) F);

/// Bytes in which a page's header ends as a rule, and in which it must end: statistics may hold long texts.
const HEADER_BYTES: [u64; 2] = [1 << 10, 1 << 22];

/// Refuses a part that would unpack to more bytes than are held at once.
fn refuse_beyond(bytes: u64) -> Result<(), ParquetError> {
    let limit = limits::PART_BYTES;
    if bytes <= limit.most() { Ok(()) } else { Err(ParquetError::from(limit.exceeded())) }
}

impl<F: ChunkReader> CheckedPages<F> {
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
                let left = self.0.len().saturating_sub(place);
                let bytes = self.0.get_bytes(place, HEADER_BYTES[0].min(left) as usize)?;
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
        self.0.len()
    }
}

impl<F: ChunkReader> ChunkReader for CheckedPages<F> {
    type T = F::T;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let left = self.0.len().saturating_sub(start);
        for most in HEADER_BYTES {
            let bytes = self.0.get_bytes(start, most.min(left) as usize)?;
            let mut walk = Walk::of(&bytes);
            if walk.structure((Some(PAGE_HEADER), false), 0).is_some() {
                // Each value of a dictionary takes a byte or more; memory is taken for all of them at once.
                let [size, values] = [(2, 2), (7, 1)].map(|(outer, own)| walk.found(outer, own));
                if values.is_some_and(|values| !(0..=size.unwrap_or(0)).contains(&values)) {
                    break;
                }
                refuse_beyond(size.and_then(|size| u64::try_from(size).ok()).unwrap_or(0))?;
                return self.0.get_read(start);
            }
        }
        Err(ParquetError::General("a page's header is damaged".into()))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        self.0.get_bytes(start, length)
    }
}

/// A walk through values of Thrift's compact protocol.
struct Walk<'a> {
    rest: &'a [u8],
    too_long: bool,
    /// The outermost field that is being read.
    field: i64,
    /// Whole numbers of the outermost structure and of those in it: outer field, own field, value.
    numbers: Vec<(i64, i64, i64)>,
}

impl<'a> Walk<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, too_long: false, field: 0, numbers: Vec::new() }
    }

    fn found(&self, outer: i64, own: i64) -> Option<i64> {
        let found = self.numbers.iter().rfind(|number| (number.0, number.1) == (outer, own));
        found.map(|number| number.2)
    }

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

    /// A structure; of a union all fields are structures.
    fn structure(
        &mut self,
        (fields, is_union): (Option<Fields>, bool),
        depth: usize,
    ) -> Option<()> {
        let mut number: i64 = 0;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            // Fields stand in order; a number of its own is written for what no format of a footer has.
            number += i64::from(head >> 4);
            if head >> 4 == 0 {
                return None;
            }
            let kind = head & 0x0F;
            let known = fields.and_then(|all| all.iter().find(|field| field.0 == number));
            let wanted = known.map(|field| field.1).or(is_union.then_some(Structure(&[])));
            // The field's kind says what a truth value is.
            wanted.is_none_or(|wanted| wanted.is(kind)).then_some(())?;
            let outer = if depth == 0 { number } else { self.field };
            if depth == 0 {
                self.field = number;
            }
            match kind {
                1 | 2 => {}
                4..=6 => {
                    let zigzag = self.number()?;
                    if depth < 2 {
                        let value = i64::try_from(zigzag >> 1).ok()? ^ -i64::from(zigzag & 1 == 1);
                        self.numbers.push((outer, number, value));
                    }
                }
                _ => self.value((kind, wanted), depth + 1)?,
            }
        }
    }

    fn value(&mut self, (kind, wanted): (u8, Option<Type>), depth: usize) -> Option<()> {
        wanted.is_none_or(|wanted| wanted.is(kind)).then_some(())?;
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
                let member = match wanted {
                    Some(List(member)) => Some(*member),
                    _ => None,
                };
                // Truth values stand in no list of the format; the reader takes no bytes for them.
                if count > 0 && matches!(head & 0x0F, 1 | 2) {
                    return None;
                }
                let mut members = 0..self.members(count)?;
                members.try_for_each(|_| self.value((head & 0x0F, member), depth + 1))
            }
            12 if depth < DEEPEST => {
                let fields = match wanted {
                    Some(Structure(fields)) => (Some(fields), false),
                    Some(Union(fields)) => (Some(fields), true),
                    _ => (None, false),
                };
                self.structure(fields, depth)
            }
            // Maps are in no footer.
            _ => None,
        }
    }
}
