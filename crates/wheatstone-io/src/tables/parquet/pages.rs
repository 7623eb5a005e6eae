//! Pages of columns put together by hand, without compression: numbers plain, a few words by their places
//! in a dictionary. A memory copy of numbers and a bit or two a word is what they cost.
//!
//! The layout is that of the Parquet format: <https://parquet.apache.org/docs/file-format/data-pages/>, its
//! headers in Thrift's compact protocol.

use super::super::columns::{Cells, Column, Words};
use parquet::{
    basic::{Compression, Encoding},
    errors::Result,
    file::{metadata::ColumnChunkMetaData, statistics::Statistics},
    schema::types::ColumnDescPtr,
};
use pulp::bytemuck::cast_slice;
use std::{ops::Range, sync::Arc};

/// The pages of one column in a group of rows: their own bytes, and numbers that stay in their columns until
/// they are written.
#[derive(Default)]
pub(super) struct Pages {
    bytes: Vec<u8>,
    /// After so many bytes come these numbers.
    numbers: Vec<(usize, Arc<Column>, Range<usize>)>,
    /// Length of the dictionary's page, which comes first.
    dictionary: usize,
    rows: usize,
    nulls: usize,
}

// Codes of the format (`parquet.thrift`).
const DATA_PAGE: i32 = 0;
const DICTIONARY_PAGE: i32 = 2;
const PLAIN: i32 = 0;
const RLE: i32 = 3;
const RLE_DICTIONARY: i32 = 8;

impl Pages {
    /// Adds a page with some rows of a column; of no other kinds than these two.
    pub(super) fn add(&mut self, column: &Arc<Column>, rows: Range<usize>) {
        self.rows += rows.len();
        match &**column {
            Column::Numbers(cells) if cells.held().is_none() && cfg!(target_endian = "little") => {
                let mut head = Vec::new();
                all_held(&mut head, rows.len());
                self.page(rows.len(), PLAIN, head.len() + 8 * rows.len());
                self.bytes.extend(head);
                self.numbers.push((self.bytes.len(), Arc::clone(column), rows));
            }
            Column::Numbers(cells) => self.add_numbers(cells, rows),
            Column::Words(words) => self.add_words(words, rows),
            Column::Integers(_) | Column::Texts(_) => {}
        }
    }

    fn add_numbers(&mut self, cells: &Cells<f64>, rows: Range<usize>) {
        let values = &cells.values()[rows.clone()];
        let held: Vec<u8> =
            rows.clone().map(|row| u8::from(cells.held().is_none_or(|held| held[row]))).collect();
        let mut head = Vec::new();
        let count = some_held(&mut head, &held);
        self.nulls += rows.len() - count;
        self.page(rows.len(), PLAIN, head.len() + 8 * count);
        self.bytes.extend(head);
        let there = values.iter().zip(&held).filter(|(_, held)| **held == 1);
        self.bytes.extend(there.flat_map(|(value, _)| value.to_le_bytes()));
    }

    fn add_words(&mut self, words: &Words, rows: Range<usize>) {
        if self.dictionary == 0 {
            let mut entries = Vec::new();
            for word in words.words {
                entries.extend((word.len() as u32).to_le_bytes());
                entries.extend(word.bytes());
            }
            let count = words.words.len();
            header(&mut self.bytes, DICTIONARY_PAGE, entries.len(), &[count as i32, PLAIN]);
            self.bytes.extend(entries);
            self.dictionary = self.bytes.len();
        }
        let places = &words.places[rows.clone()];
        let held: Vec<u8> = places.iter().map(|place| u8::from(*place > 0)).collect();
        let there: Vec<u8> = places.iter().filter_map(|place| place.checked_sub(1)).collect();
        self.nulls += rows.len() - there.len();
        let mut page = Vec::new();
        some_held(&mut page, &held);
        let last = words.words.len().saturating_sub(1);
        let width = (usize::BITS - last.leading_zeros()).max(1) as u8;
        page.push(width);
        hybrid(&mut page, width, &there);
        self.page(rows.len(), RLE_DICTIONARY, page.len());
        self.bytes.extend(page);
    }

    /// The header of a data page.
    fn page(&mut self, rows: usize, encoding: i32, length: usize) {
        header(&mut self.bytes, DATA_PAGE, length, &[rows as i32, encoding, RLE, RLE]);
    }

    /// What the file's end says of this column; offsets are those in `bytes`.
    pub(super) fn close(&self, descriptor: ColumnDescPtr) -> Result<ColumnChunkMetaData> {
        let length = self.length() as i64;
        let values = match self.dictionary {
            0 => vec![Encoding::PLAIN, Encoding::RLE],
            _ => vec![Encoding::PLAIN, Encoding::RLE, Encoding::RLE_DICTIONARY],
        };
        let nulls = Some(self.nulls as u64);
        let statistics = match self.dictionary {
            0 => Statistics::double(None, None, None, nulls, false),
            _ => Statistics::byte_array(None, None, None, nulls, false),
        };
        ColumnChunkMetaData::builder(descriptor)
            .set_compression(Compression::UNCOMPRESSED)
            .set_encodings(values)
            .set_num_values(self.rows as i64)
            .set_total_compressed_size(length)
            .set_total_uncompressed_size(length)
            .set_data_page_offset(self.dictionary as i64)
            .set_dictionary_page_offset((self.dictionary > 0).then_some(0))
            .set_statistics(statistics)
            .build()
    }

    /// Bytes of all pages.
    pub(super) fn length(&self) -> usize {
        let numbers: usize = self.numbers.iter().map(|(_, _, rows)| 8 * rows.len()).sum();
        self.bytes.len() + numbers
    }

    /// The bytes of all pages, piece by piece.
    pub(super) fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        let ends = self.numbers.iter().map(|(end, ..)| *end);
        let begins = std::iter::once(0).chain(ends.clone());
        let own = begins.zip(ends.chain([self.bytes.len()]));
        let numbers = self.numbers.iter().map(|(_, column, rows)| match &**column {
            Column::Numbers(cells) => cast_slice(&cells.values()[rows.clone()]),
            _ => &[],
        });
        let own = own.map(|(begin, end)| &self.bytes[begin..end]);
        own.zip(numbers.chain([&[][..]])).flat_map(|(own, numbers)| [own, numbers])
    }

    /// Begins anew, in the same memory.
    pub(super) fn clear(&mut self) {
        self.bytes.clear();
        self.numbers.clear();
        (self.dictionary, self.rows, self.nulls) = (0, 0, 0);
    }
}

/// A page's header: its kind, its length, and the numbers of its kind.
fn header(bytes: &mut Vec<u8>, kind: i32, length: usize, own: &[i32]) {
    // A field's number is told by its distance from the one before, in the high half of a byte; the low
    // half is its type: 5 a whole number, 12 a structure.
    let number = |bytes: &mut Vec<u8>, value: i32| {
        bytes.push(0x15);
        varint(bytes, ((value << 1) ^ (value >> 31)) as u32 as u64);
    };
    for value in [kind, length as i32, length as i32] {
        number(bytes, value);
    }
    // The structure for data is field 5 and that for dictionaries field 7, after 3.
    bytes.push(if kind == DATA_PAGE { 0x2C } else { 0x4C });
    own.iter().for_each(|value| number(bytes, *value));
    bytes.extend([0, 0]);
}

/// Seven bits a byte, low ones first, the eighth bit where more follow.
fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// The levels of a page in which all rows hold something.
fn all_held(bytes: &mut Vec<u8>, rows: usize) {
    let begin = bytes.len();
    bytes.extend([0; 4]);
    repeated(bytes, 1, rows);
    close_levels(bytes, begin);
}

/// The levels of a page in which rows hold something (1) or not (0); how many do.
fn some_held(bytes: &mut Vec<u8>, held: &[u8]) -> usize {
    let begin = bytes.len();
    bytes.extend([0; 4]);
    hybrid(bytes, 1, held);
    close_levels(bytes, begin);
    held.iter().map(|held| usize::from(*held)).sum()
}

/// Levels begin with their length.
fn close_levels(bytes: &mut [u8], begin: usize) {
    let length = (bytes.len() - begin - 4) as u32;
    bytes[begin..begin + 4].copy_from_slice(&length.to_le_bytes());
}

/// One value so many times.
fn repeated(bytes: &mut Vec<u8>, value: u8, times: usize) {
    if times > 0 {
        varint(bytes, (times as u64) << 1);
        bytes.push(value);
    }
}

/// Values of `width` bits, in runs of one value and packed ones (`RLE`).
fn hybrid(bytes: &mut Vec<u8>, width: u8, values: &[u8]) {
    // 63 groups of eight: the most that the one byte before a packed run can tell.
    const PACKED: usize = 63 * 8;
    let (mut value, mut times) = (0, 0);
    for part in values.chunks(PACKED) {
        let same = part.iter().fold(true, |same, other| same & (*other == part[0]));
        if same && (times == 0 || value == part[0]) {
            (value, times) = (part[0], times + part.len());
            continue;
        }
        repeated(bytes, value, times);
        times = 0;
        if same {
            (value, times) = (part[0], part.len());
            continue;
        }
        varint(bytes, ((part.len().div_ceil(8) as u64) << 1) | 1);
        for group in part.chunks(8) {
            let packed =
                group.iter().rev().fold(0_u64, |all, one| (all << width) | u64::from(*one));
            bytes.extend(&packed.to_le_bytes()[..usize::from(width)]);
        }
    }
    repeated(bytes, value, times);
}
