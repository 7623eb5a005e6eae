//! The grammar of tables of text: where cells and rows end, in bytes that are all there.
//!
//! It is that of RFC 4180 with the lenience of the `csv` crate, which reads tables elsewhere: rows end with
//! `\n`, `\r` or both, empty lines are none, a quote opens a cell only where it begins it, and one that is
//! left open ends with the text.

use memchr::{memchr, memchr3};
use std::{borrow::Cow, io::Write};

/// Where the cell that begins at `at` ends: at a delimiter, the end of its row, or the end of all.
pub(super) fn cell_end(bytes: &[u8], at: usize, delimiter: u8) -> usize {
    let mut at = at;
    if bytes.get(at) == Some(&b'"') {
        at += 1;
        loop {
            match memchr(b'"', &bytes[at..]) {
                None => return bytes.len(),
                Some(more) => at += more + 1,
            }
            // Two quotes stand for one.
            if bytes.get(at) != Some(&b'"') {
                break;
            }
            at += 1;
        }
    }
    let rest = &bytes[at..];
    memchr3(delimiter, b'\n', b'\r', rest).map_or(bytes.len(), |more| at + more)
}

/// What the cell between `begin` and `end` says, without quotes and the spaces around it.
pub(super) fn cell(text: &str, begin: usize, end: usize) -> Cow<'_, str> {
    let whole = &text[begin..end];
    let Some(mut rest) = whole.strip_prefix('"') else { return Cow::Borrowed(whole.trim()) };
    let mut own = String::with_capacity(whole.len());
    while let Some((before, after)) = rest.split_once('"') {
        own += before;
        match after.strip_prefix('"') {
            Some(more) => {
                own.push('"');
                rest = more;
            }
            None => {
                // Behind the closing quote all is as it stands.
                own += after;
                rest = "";
                break;
            }
        }
    }
    own += rest;
    Cow::Owned(own.trim().to_owned())
}

/// Where the last row ends that ends before the end of all, and where it is to be looked for anew when more
/// is known: at the beginning of the row that does not end. A row begins at `from`.
pub(super) fn last_end(bytes: &[u8], from: usize, delimiter: u8) -> usize {
    let (mut begin, mut at) = (from, from);
    while at < bytes.len() {
        let end = cell_end(bytes, at, delimiter);
        match bytes.get(end) {
            None => break,
            Some(byte) if *byte == delimiter => at = end + 1,
            Some(_) => {
                at = end + 1;
                begin = at;
            }
        }
    }
    begin
}

/// The cells of the row that begins at `at`, where each begins and ends.
pub(super) fn cells(
    bytes: &[u8],
    at: usize,
    delimiter: u8,
) -> impl Iterator<Item = (usize, usize)> {
    let mut next = Some(at);
    std::iter::from_fn(move || {
        let begin = next?;
        let end = cell_end(bytes, begin, delimiter);
        next = (bytes.get(end) == Some(&delimiter)).then_some(end + 1);
        Some((begin, end))
    })
}

/// Writes a cell, in quotes where it must be.
pub(super) fn push_cell(out: &mut impl Write, cell: &str, delimiter: u8) {
    let bytes = cell.as_bytes();
    // All that is written to memory fits.
    let _ = if memchr3(delimiter, b'\n', b'\r', bytes).is_none() && memchr(b'"', bytes).is_none() {
        out.write_all(bytes)
    } else {
        write!(out, "\"{}\"", cell.replace('"', "\"\""))
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_numeric::random::Random;

    /// All cells of all rows.
    fn rows(text: &str, delimiter: u8) -> Vec<Vec<String>> {
        let bytes = text.as_bytes();
        let (mut rows, mut at) = (Vec::new(), 0);
        while at < bytes.len() {
            if matches!(bytes[at], b'\n' | b'\r') {
                at += 1;
                continue;
            }
            let ends: Vec<_> = cells(bytes, at, delimiter).collect();
            rows.push(ends.iter().map(|(b, e)| cell(text, *b, *e).into_owned()).collect());
            at = ends.last().unwrap().1;
        }
        rows
    }

    #[test]
    fn rows_are_those_of_the_csv_crate() {
        let mut random = Random::new(5);
        let letters = ["a", "\"", "\"", ",", "\n", "\r", "\r\n", " ", "é", "\u{a0}"];
        for _ in 0..20_000 {
            let length = random.below(24);
            let text: String = (0..length).map(|_| letters[random.below(letters.len())]).collect();
            let theirs: Vec<Vec<String>> = csv::ReaderBuilder::new()
                .has_headers(false)
                .flexible(true)
                .trim(csv::Trim::All)
                .from_reader(text.as_bytes())
                .records()
                .map(|record| record.unwrap().iter().map(str::to_owned).collect())
                .collect();
            let ours = rows(&text, b',');
            assert_eq!(ours, theirs, "{text:?}");
            // What is written is what the csv crate writes, and a cut between rows changes nothing.
            let mut written = Vec::new();
            let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
            for row in ours.iter().filter(|row| row.len() > 1) {
                writer.write_record(row).unwrap();
                for (index, cell) in row.iter().enumerate() {
                    if index > 0 {
                        written.push(b',');
                    }
                    push_cell(&mut written, cell, b',');
                }
                written.push(b'\n');
            }
            assert_eq!(written, writer.into_inner().unwrap(), "{text:?}");
            let cut = last_end(text.as_bytes(), 0, b',');
            let mut parts = rows(&text[..cut], b',');
            parts.extend(rows(&text[cut..], b','));
            assert_eq!(parts, ours, "{text:?} cut at {cut}");
        }
    }
}
