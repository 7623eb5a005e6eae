//! Text that is written and thrown away again and again, in the same memory.

use std::io::Write;

/// Text up to `end`; what lies beyond is room that is already there.
#[derive(Clone, Debug, Default)]
pub(super) struct Sheet {
    bytes: Vec<u8>,
    end: usize,
}

/// The text of rows: pieces of whole rows, one after the other. Whoever writes again and again keeps it, and
/// spares the memory.
#[derive(Clone, Debug, Default)]
pub struct Pieces {
    sheets: Vec<Sheet>,
    used: usize,
}

/// Room for a number: sign, point and 21 digits, and what is written beyond and thrown away.
const NUMBER: usize = 40;

impl Sheet {
    /// Begins anew, with room for so many bytes.
    pub(super) fn begin(&mut self, room: usize) {
        self.end = 0;
        self.ensure(room);
    }

    /// What is written on it.
    pub(super) fn text(&self) -> &[u8] {
        &self.bytes[..self.end]
    }

    #[inline]
    fn ensure(&mut self, more: usize) {
        if self.bytes.len() - self.end < more {
            self.grow(more);
        }
    }

    #[cold]
    fn grow(&mut self, more: usize) {
        self.bytes.resize((self.end + more).max(self.bytes.len() + self.bytes.len() / 2), 0);
    }

    /// Adds a byte.
    #[inline]
    pub(super) fn push(&mut self, byte: u8) {
        self.ensure(1);
        self.bytes[self.end] = byte;
        self.end += 1;
    }

    /// Adds a text of any length.
    #[inline]
    pub(super) fn extend(&mut self, text: &[u8]) {
        self.ensure(text.len());
        self.bytes[self.end..self.end + text.len()].copy_from_slice(text);
        self.end += text.len();
    }

    /// Room for a number, of which what is written counts when it is [advanced over](Sheet::advance).
    #[inline]
    pub(super) fn room(&mut self) -> &mut [u8] {
        self.ensure(NUMBER);
        &mut self.bytes[self.end..self.end + NUMBER]
    }

    /// So much of the room was taken.
    #[inline]
    pub(super) fn advance(&mut self, length: usize) {
        self.end += length.min(NUMBER);
    }
}

impl Write for Sheet {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Pieces {
    /// So many sheets to be written anew.
    pub(super) fn begin(&mut self, count: usize) -> &mut [Sheet] {
        self.sheets.resize_with(count.max(self.sheets.len()), Sheet::default);
        self.used = count;
        &mut self.sheets[..count]
    }

    /// The pieces.
    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.sheets[..self.used].iter().map(Sheet::text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_stands_there_whatever_its_lengths() {
        let text: Vec<u8> = (b'a'..=b'z').collect();
        let (mut sheet, mut expected) = (Sheet::default(), Vec::new());
        for _ in 0..2 {
            sheet.begin(3);
            expected.clear();
            for length in 0..=24 {
                sheet.room()[..length].copy_from_slice(&text[..length]);
                sheet.advance(length);
                sheet.push(b',');
                sheet.extend(&text[..length]);
                expected.extend(&text[..length]);
                expected.push(b',');
                expected.extend(&text[..length]);
            }
            assert_eq!(sheet.text(), expected);
        }
    }
}
