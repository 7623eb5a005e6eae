//! Rows of text: their numbers, and the text itself, which goes on as it stands.

use super::{
    columns::{Cells, Column, Columns, Texts},
    decimals::number_at,
    faults,
    layout::{LARGEST, Layout},
    records::{cell, cell_end, cells, push_cell},
    rows::{Axis, Rows},
    sheet::Sheet,
};
use memchr::{memchr, memchr_iter};
use rayon::prelude::*;
use std::{
    path::PathBuf,
    sync::{Arc, Mutex},
};
use wheatstone_core::{Error, Result};

/// What all rows of a table have in common.
#[derive(Debug)]
pub(super) struct Table {
    pub(super) path: PathBuf,
    pub(super) header: csv::StringRecord,
    pub(super) layout: Layout,
    pub(super) delimiter: u8,
    /// Memory of rows that are done with.
    pub(super) spare: Mutex<Vec<Vec<u8>>>,
}

/// Rows of a table as they were written.
#[derive(Clone, Debug)]
pub(super) struct Spelled {
    table: Arc<Table>,
    text: String,
    rows: Vec<Row>,
}

/// A row in its text.
#[derive(Clone, Copy, Debug)]
struct Row {
    begin: usize,
    end: usize,
    /// Its line in the file, counted from 1.
    line: u64,
    /// Without quotes, and without spaces around cells: it goes on as it is.
    plain: bool,
}

/// Bytes a task: some hundred rows.
const TASK: usize = 1 << 16;

/// Some rows, read.
struct Part {
    rows: Vec<Row>,
    /// x and y of each camera, NaN where it is empty.
    pixels: Vec<Vec<f64>>,
}

impl Spelled {
    /// Reads a block of whole rows that begins in this line, which is moved on.
    pub(super) fn parse(table: Arc<Table>, block: Vec<u8>, line: &mut u64) -> Result<Rows> {
        let (text, fault) = match String::from_utf8(block) {
            Ok(text) => (text, None),
            Err(error) => whole_rows(&table, error, *line),
        };
        let ranges = parts(&text, table.delimiter);
        let lines = |range: &(usize, usize)| {
            memchr_iter(b'\n', &text.as_bytes()[range.0..range.1]).count() as u64
        };
        let lines: Vec<u64> = ranges.par_iter().map(lines).collect();
        let begin_lines = lines.iter().scan(*line, |line, count| {
            let begin = *line;
            *line += count;
            Some(begin)
        });
        let tasks: Vec<_> = ranges.into_iter().zip(begin_lines).collect();
        let read = tasks.into_par_iter().map(|((begin, end), line)| {
            Reading::new(&table, &text[begin..end]).part(&text[..end], begin, line)
        });
        let read: Vec<Result<Part>> = read.collect();
        *line += lines.iter().sum::<u64>();
        let mut rows = Vec::new();
        let mut pixels = vec![Vec::new(); 2 * table.layout.pixels.len()];
        for part in read {
            let part = part?;
            rows.extend(part.rows);
            pixels.iter_mut().zip(part.pixels).for_each(|(all, own)| all.extend(own));
        }
        if let Some(fault) = fault {
            return Err(fault);
        }
        let mut axes = pixels.into_iter();
        let pair = |_: &[usize; 2]| [0, 1].map(|_| Axis::Own(axes.next().unwrap_or_default()));
        let pixels = table.layout.pixels.iter().map(pair).collect();
        Ok(Rows::of_text(Self { table, text, rows }, pixels))
    }

    pub(super) fn count(&self) -> usize {
        self.rows.len()
    }

    /// Writes a row's cells, without the end of the row.
    pub(super) fn push_row(&self, out: &mut Sheet, row: usize) {
        let row = self.rows[row];
        if row.plain {
            return out.extend(&self.text.as_bytes()[row.begin..row.end]);
        }
        let delimiter = self.table.delimiter;
        for (index, (begin, end)) in
            cells(&self.text.as_bytes()[..row.end], row.begin, delimiter).enumerate()
        {
            if index > 0 {
                out.push(delimiter);
            }
            push_cell(out, &cell(&self.text, begin, end), delimiter);
        }
    }

    /// By column: pixels and places are numbers and all else is text.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] for a place that is none.
    pub(super) fn columns(&self) -> Result<Columns> {
        enum Own {
            Numbers(Vec<Option<f64>>),
            Texts(Texts),
        }
        let layout = &self.table.layout;
        let pixels = layout.pixels.iter().flatten();
        let places = layout.world.iter().flatten().chain(layout.board.iter().flatten());
        let numbers: Vec<usize> = pixels.chain(places).copied().collect();
        let own = |column: usize| match numbers.contains(&column) {
            true => Own::Numbers(Vec::with_capacity(self.rows.len())),
            false => Own::Texts(Texts::with_capacity(self.rows.len())),
        };
        let mut all: Vec<Own> = (0..self.table.header.len()).map(own).collect();
        for row in &self.rows {
            let ends = cells(&self.text.as_bytes()[..row.end], row.begin, self.table.delimiter);
            for (index, ((begin, end), own)) in ends.zip(&mut all).enumerate() {
                let cell = cell(&self.text, begin, end);
                let cell = (!cell.is_empty()).then_some(&*cell);
                match own {
                    Own::Texts(texts) => texts.push(cell),
                    Own::Numbers(numbers) => {
                        let number = cell.map(faults::number).transpose();
                        let fault = |fault: faults::Fault| self.table.fault(fault, row.line, index);
                        numbers.push(number.map_err(fault)?);
                    }
                }
            }
        }
        let column = |own: Own| match own {
            Own::Numbers(numbers) => Column::Numbers(numbers.into_iter().collect::<Cells<f64>>()),
            Own::Texts(texts) => Column::Texts(texts),
        };
        let names = self.table.header.iter().map(str::to_owned);
        Ok(Columns { columns: names.zip(all.into_iter().map(column)).collect() })
    }
}

impl Drop for Spelled {
    fn drop(&mut self) {
        self.table.give_back(std::mem::take(&mut self.text).into_bytes());
    }
}

impl Table {
    /// Memory for text, which may have served before: the system clears what it gives anew.
    pub(super) fn memory(&self) -> Vec<u8> {
        self.spare.lock().ok().and_then(|mut spare| spare.pop()).unwrap_or_default()
    }

    fn give_back(&self, mut memory: Vec<u8>) {
        // As many as are on their way at a time.
        const MOST: usize = 8;
        memory.clear();
        if let Ok(mut spare) = self.spare.lock()
            && spare.len() < MOST
        {
            spare.push(memory);
        }
    }

    fn fault(&self, fault: faults::Fault, line: u64, column: usize) -> Error {
        fault.at(&self.path, Some(line), &self.header[column])
    }

    /// What is wrong with a row's pixels; the cameras in their order.
    fn pixel_fault(&self, cells: &[std::borrow::Cow<str>], line: u64) -> Option<Error> {
        let of_camera = |[x, y]: &[usize; 2]| {
            let fault = |fault, column: usize| Some(self.fault(fault, line, column));
            match (cells[*x].is_empty(), cells[*y].is_empty()) {
                (true, true) => None,
                (true, false) => fault(faults::half(), *x),
                (false, true) => fault(faults::half(), *y),
                (false, false) => [*x, *y].into_iter().find_map(|column| {
                    faults::number(&cells[column]).err().and_then(|own| fault(own, column))
                }),
            }
        };
        self.layout.pixels.iter().find_map(of_camera)
    }
}

/// The whole rows before bytes that are no text, and the fault of those.
fn whole_rows(
    table: &Table,
    error: std::string::FromUtf8Error,
    line: u64,
) -> (String, Option<Error>) {
    let valid = error.utf8_error().valid_up_to();
    let mut bytes = error.into_bytes();
    let end = super::records::last_end(&bytes[..valid], 0, table.delimiter);
    bytes.truncate(end);
    let lines = memchr_iter(b'\n', &bytes).count() as u64;
    let text = String::from_utf8(bytes).unwrap_or_default();
    (text, Some(faults::no_text(&table.path, Some(line + lines))))
}

/// Cuts text between rows.
fn parts(text: &str, delimiter: u8) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let quotes = memchr(b'"', bytes).is_some();
    let (mut parts, mut begin) = (Vec::new(), 0);
    while begin < bytes.len() {
        let least = (begin + TASK).min(bytes.len());
        let end = if quotes {
            let mut end = begin;
            while end < least {
                let last = cells(bytes, end, delimiter).last().map_or(end, |(_, end)| end);
                end = (last + 1).min(bytes.len());
            }
            end
        } else {
            memchr(b'\n', &bytes[least..]).map_or(bytes.len(), |more| least + more + 1)
        };
        parts.push((begin, end));
        begin = end;
    }
    parts
}

/// How a part of a block is read.
struct Reading<'a> {
    table: &'a Table,
    /// Which number of the cameras each column is.
    slots: Vec<Option<usize>>,
    /// Whether there are quotes in it.
    quotes: bool,
}

impl<'a> Reading<'a> {
    fn new(table: &'a Table, part: &str) -> Self {
        let mut slots = vec![None; table.header.len()];
        for (slot, column) in table.layout.pixels.iter().flatten().enumerate() {
            slots[*column] = Some(slot);
        }
        Self { table, slots, quotes: memchr(b'"', part.as_bytes()).is_some() }
    }

    /// Reads the rows from a place on, which begin in this line.
    fn part(&self, text: &str, begin: usize, mut line: u64) -> Result<Part> {
        // Rows are rarely shorter than this.
        let room = (text.len() - begin) / 32;
        let axes = 2 * self.table.layout.pixels.len();
        let mut part = Part {
            rows: Vec::with_capacity(room),
            pixels: (0..axes).map(|_| Vec::with_capacity(room)).collect(),
        };
        let mut at = begin;
        while let Some(byte) = text.as_bytes().get(at) {
            if matches!(byte, b'\n' | b'\r') {
                line += u64::from(*byte == b'\n');
                at += 1;
                continue;
            }
            let row = self.row(text, at, line, &mut part.pixels)?;
            part.rows.push(row);
            if self.quotes {
                line += memchr_iter(b'\n', &text.as_bytes()[at..row.end]).count() as u64;
            }
            at = row.end;
        }
        Ok(part)
    }

    /// Reads a row.
    fn row(&self, text: &str, begin: usize, line: u64, pixels: &mut [Vec<f64>]) -> Result<Row> {
        let (bytes, delimiter) = (text.as_bytes(), self.table.delimiter);
        let (mut at, mut index, mut plain, mut sound) = (begin, 0, true, true);
        let end = loop {
            let slot = self.slots.get(index).copied().flatten();
            let number = slot.and_then(|slot| Some((slot, bare_number(bytes, at, delimiter)?)));
            let end = if let Some((slot, (value, end))) = number {
                sound &= value.abs() <= LARGEST;
                pixels[slot].push(value);
                end
            } else {
                let end = cell_end(bytes, at, delimiter);
                // Most cells begin and end with a letter or digit.
                let bare = |place: usize| (b'#'..0x7F).contains(&bytes[place]);
                let clean = at == end || (bare(at) && bare(end - 1));
                plain &= clean || (cell(text, at, end).len() == end - at && bytes[at] != b'"');
                if let Some(slot) = slot {
                    let value = value(&cell(text, at, end));
                    sound &= value.is_some();
                    pixels[slot].push(value.unwrap_or(f64::NAN));
                }
                end
            };
            index += 1;
            if bytes.get(end) != Some(&delimiter) {
                break end;
            }
            at = end + 1;
        };
        if index != self.slots.len() {
            let lengths = (index as u64, self.slots.len() as u64);
            return Err(faults::unequal(&self.table.path, Some(line), lengths.0, lengths.1));
        }
        for pair in pixels.chunks_exact(2) {
            let [x, y] = [&pair[0], &pair[1]].map(|axis| axis.last().is_none_or(|v| v.is_nan()));
            sound &= x == y;
        }
        if !sound {
            let cells = cells(bytes, begin, delimiter).map(|(from, to)| cell(text, from, to));
            if let Some(fault) = self.table.pixel_fault(&cells.collect::<Vec<_>>(), line) {
                return Err(fault);
            }
        }
        let quoted = self.quotes && memchr(b'"', &bytes[begin..end]).is_some();
        Ok(Row { begin, end, line, plain: plain && !quoted })
    }
}

/// The number that is all of a cell, and where that ends: of most cells, whose end need not be looked for.
#[inline]
fn bare_number(bytes: &[u8], at: usize, delimiter: u8) -> Option<(f64, usize)> {
    let (value, end) = number_at(bytes, at)?;
    let next = bytes.get(end);
    let ends = next.is_none_or(|byte| *byte == delimiter || matches!(byte, b'\n' | b'\r'));
    ends.then_some((value, end))
}

/// A cell as a number, NaN for an empty one; none where it is no place.
fn value(cell: &str) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    cell.parse().ok().filter(|value: &f64| value.abs() <= LARGEST)
}
