//! A source of text in whole lines, which remembers enough of them to tell the line of a row.

use super::head;
use std::io::{Read, Result};
use wheatstone_core::limits;

/// Bytes that are asked for at once.
const CHUNK: usize = 1 << 18;

/// Gives whole lines only, as many as have come: what a slow producer has written goes on before it ends.
pub(super) struct Lines {
    source: Box<dyn Read + Send>,
    /// What was read and not given on before.
    held: Vec<u8>,
    /// How much of it is whole lines, and how much of those was given.
    whole: usize,
    given: usize,
    /// Where `held` begins in the text.
    begin: u64,
    ended: bool,
    /// What was given since a row ended.
    of_row: u64,
    /// Line feeds before `held`.
    feeds: u64,
    /// Whether comments are looked at: the head was read.
    watches: bool,
    /// Comments below the head that say a unit, with their lines.
    late: Vec<(u64, String)>,
}

impl Lines {
    pub(super) fn new(source: Box<dyn Read + Send>) -> Self {
        Self {
            source,
            held: Vec::new(),
            whole: 0,
            given: 0,
            begin: 0,
            ended: false,
            of_row: 0,
            feeds: 0,
            watches: false,
            late: Vec::new(),
        }
    }

    /// The first lines, as many as `enough` asks for of those that have come; without the byte order mark
    /// that spreadsheets put first.
    pub(super) fn first(&mut self, enough: impl Fn(&[u8]) -> bool) -> Result<&[u8]> {
        const MARK: &[u8] = b"\xEF\xBB\xBF";
        loop {
            self.read_more()?;
            if self.held.starts_with(MARK) {
                self.held.drain(..MARK.len());
                self.whole = self.whole.saturating_sub(MARK.len());
            }
            if self.ended || enough(&self.held[..self.whole]) {
                return Ok(&self.held[..self.whole]);
            }
        }
    }

    /// Looks from now on for comments that say a unit, below so many bytes of those that came first.
    pub(super) fn watch_below(&mut self, head: usize) {
        self.watches = true;
        self.look_from(head);
    }

    /// Comments below the head that say a unit, with their lines; each once.
    pub(super) fn late_units(&mut self) -> Vec<(u64, String)> {
        std::mem::take(&mut self.late)
    }

    fn look_from(&mut self, place: usize) {
        let (before, fresh) = self.held[..self.whole].split_at(place.min(self.whole));
        if !fresh.contains(&b'#') {
            return;
        }
        let mut line = self.feeds + feeds(before) + 1;
        for text in head::split(fresh) {
            if let Some(unit) = head::said_unit(text) {
                self.late.push((line, unit));
            }
            line += u64::from(text.ends_with(b"\n"));
        }
    }

    /// Says that a row has ended.
    pub(super) fn end_row(&mut self) {
        self.of_row = 0;
    }

    /// Whether all that came was given on and read to this byte: more has to be waited for.
    pub(super) fn waits(&self, read: u64) -> bool {
        // Behind a carriage return a line feed may be left.
        !self.ended && self.given == self.whole && self.begin + self.given as u64 <= read + 1
    }

    /// Whether the byte before this place is a line feed; of what was given last.
    pub(super) fn ends_line(&self, place: u64) -> bool {
        let index = place.checked_sub(self.begin + 1).and_then(|index| usize::try_from(index).ok());
        index.is_some_and(|index| self.held.get(index) == Some(&b'\n'))
    }

    /// Reads until there is a whole line more.
    fn read_more(&mut self) -> Result<()> {
        loop {
            let before = self.held.len();
            self.held.resize(before + CHUNK, 0);
            let read = self.source.read(&mut self.held[before..]);
            self.held.truncate(before + read.as_ref().copied().unwrap_or(0));
            match read {
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                read => self.ended = read? == 0,
            }
            let last = self.held[before..].iter().rposition(|byte| *byte == b'\n');
            if self.ended {
                self.whole = self.held.len();
                return Ok(());
            }
            if let Some(last) = last {
                self.whole = before + last + 1;
                return Ok(());
            }
            if self.held.len() as u64 > limits::ROW_BYTES.most() {
                return Err(limits::ROW_BYTES.exceeded());
            }
        }
    }
}

fn feeds(text: &[u8]) -> u64 {
    text.iter().filter(|byte| **byte == b'\n').count() as u64
}

impl Read for Lines {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        if self.given == self.whole && !self.ended {
            self.feeds += feeds(&self.held[..self.whole]);
            self.held.drain(..self.whole);
            self.begin += self.whole as u64;
            (self.whole, self.given) = (0, 0);
            self.read_more()?;
            if self.watches {
                self.look_from(0);
            }
        }
        let count = into.len().min(self.whole - self.given);
        into[..count].copy_from_slice(&self.held[self.given..self.given + count]);
        self.given += count;
        self.of_row += count as u64;
        // A quotation mark that is never closed makes a row of many lines.
        if self.of_row > limits::ROW_BYTES.most() {
            return Err(limits::ROW_BYTES.exceeded());
        }
        Ok(count)
    }
}
