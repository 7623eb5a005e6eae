//! Tables of text, read in blocks of whole rows.

use super::{
    faults,
    layout::Layout,
    records::{cell, cells, last_end},
    rows::Rows,
    spelled::{Spelled, Table},
};
use memchr::{memchr, memrchr, memrchr2};
use std::{
    io::Read,
    path::Path,
    sync::{
        Arc, Mutex,
        mpsc::{Receiver, sync_channel},
    },
};
use wheatstone_core::{Error, Result, storage};

/// Bytes that are read and passed on at once: enough to occupy all cores, little to hold.
const BLOCK: usize = 1 << 20;

/// No row is so long, but a table is after a quote that is left open.
const LONGEST_ROW: usize = 1 << 26;

/// Reads a points file as text, many rows at a time.
pub struct TextReader {
    table: Arc<Table>,
    source: Source,
    /// What was read and not passed on yet. A row begins with it.
    held: Vec<u8>,
    /// The line in which it begins, counted from 1.
    line: u64,
    ended: bool,
}

enum Source {
    /// Read until a block is full.
    Patient(Box<dyn Read + Send>),
    /// What comes is passed on.
    Prompt(Receiver<std::io::Result<Vec<u8>>>),
}

impl TextReader {
    /// Opens a file, or standard input for `-`; from there rows are passed on as they come where `prompt`.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] where the header does not name two cameras' pixels.
    pub fn open(path: &Path, prompt: bool) -> Result<Self> {
        if path.as_os_str() != "-" {
            return Self::new(path, Source::Patient(Box::new(storage::open(path)?)));
        }
        let (name, input) = (Path::new("standard input"), std::io::stdin());
        if prompt { Self::new(name, Source::prompt(input)) } else { Self::of(name, input) }
    }

    /// Reads from anywhere; `name` stands for it in messages.
    ///
    /// # Errors
    ///
    /// As [`TextReader::open`].
    pub fn of(name: &Path, source: impl Read + Send + 'static) -> Result<Self> {
        Self::new(name, Source::Patient(Box::new(source)))
    }

    fn new(path: &Path, source: Source) -> Result<Self> {
        let table = Table {
            path: path.into(),
            header: csv::StringRecord::new(),
            layout: Layout::default(),
            delimiter: b',',
            spare: Mutex::default(),
        };
        let (held, line) = (Vec::new(), 1);
        let mut reader = Self { table: Arc::new(table), source, held, line, ended: false };
        reader.table = Arc::new(reader.begin(path)?);
        Ok(reader)
    }

    /// Reads the header.
    fn begin(&mut self, path: &Path) -> Result<Table> {
        /// The longest line that is looked at before a file is taken for something else than a table.
        const LONGEST_HEADER: usize = 1 << 20;
        // The byte order mark that spreadsheets put first is no part of the first name.
        const MARK: &[u8] = b"\xEF\xBB\xBF";
        let (mut delimiter, mut begin) = (b',', 0);
        let end = loop {
            if self.held.starts_with(MARK) {
                self.held.drain(..MARK.len());
            }
            begin = begin
                .max(self.held.iter().take_while(|byte| matches!(byte, b'\n' | b'\r')).count());
            if let Some(line) = self.held[begin..].split_inclusive(|byte| *byte == b'\n').next() {
                let count = |d: &u8| line.iter().filter(|byte| *byte == d).count();
                delimiter = [b';', b'\t', b','].into_iter().max_by_key(count).unwrap_or(b',');
            }
            let end = cells(&self.held, begin, delimiter).last().map_or(begin, |(_, end)| end);
            if end < self.held.len() || self.held.len() >= LONGEST_HEADER || !self.read_more()? {
                break end;
            }
        };
        let Ok(text) = std::str::from_utf8(&self.held[begin..end]) else {
            return Err(faults::no_text(path, Some(1)));
        };
        let ends = cells(text.as_bytes(), 0, delimiter);
        let header: csv::StringRecord = ends.map(|(from, to)| cell(text, from, to)).collect();
        let layout = Layout::read(path, Some(1), &header)?;
        let lines = self.held[..end].iter().filter(|byte| **byte == b'\n').count();
        self.line += lines as u64;
        self.held.drain(..end);
        Ok(Table { path: path.into(), header, layout, delimiter, spare: Mutex::default() })
    }

    /// The columns' names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.table.header.iter()
    }

    /// The character between cells.
    #[must_use]
    pub fn delimiter(&self) -> u8 {
        self.table.delimiter
    }

    /// Cameras that the header names.
    #[must_use]
    pub fn cameras(&self) -> usize {
        self.table.layout.pixels.len()
    }

    /// The next rows; none at the end of the file.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], or [`Error::Malformed`] naming line, column and what was seen.
    pub fn next_rows(&mut self) -> Result<Option<Rows>> {
        loop {
            let Some(block) = self.block()? else { return Ok(None) };
            let rows = Spelled::parse(Arc::clone(&self.table), block, &mut self.line)?;
            // A block may consist of empty lines.
            if rows.count() > 0 {
                return Ok(Some(rows));
            }
        }
    }

    /// The next whole rows.
    fn block(&mut self) -> Result<Option<Vec<u8>>> {
        let delimiter = self.table.delimiter;
        // Up to here it is known where rows end.
        let mut searched = 0;
        loop {
            let full = match &self.source {
                Source::Patient(_) => self.held.len() >= BLOCK,
                Source::Prompt(_) => !self.held.is_empty(),
            };
            if self.ended || full {
                let end = if self.ended {
                    self.held.len()
                } else if memchr(b'"', &self.held).is_none() {
                    // Without line feeds, carriage returns alone end rows.
                    let last = memrchr(b'\n', &self.held);
                    last.or_else(|| memrchr2(b'\r', b'\n', &self.held)).map_or(0, |last| last + 1)
                } else {
                    searched = last_end(&self.held, searched, delimiter);
                    searched
                };
                if end > 0 {
                    let mut rest = self.table.memory();
                    rest.extend(&self.held[end..]);
                    self.held.truncate(end);
                    return Ok(Some(std::mem::replace(&mut self.held, rest)));
                }
                if self.ended {
                    return Ok(None);
                }
                if self.held.len() > LONGEST_ROW {
                    return Err(self.endless());
                }
            }
            self.read_more()?;
        }
    }

    /// Reads what comes, and waits until something does; false at the end.
    fn read_more(&mut self) -> Result<bool> {
        let before = self.held.len();
        let read = match &mut self.source {
            Source::Patient(source) => {
                self.held.reserve(BLOCK);
                source.by_ref().take(BLOCK as u64).read_to_end(&mut self.held).map(|_| ())
            }
            Source::Prompt(pieces) => take_all(pieces, &mut self.held),
        };
        read.map_err(|e| Error::reading(&self.table.path, e))?;
        self.ended = self.held.len() == before;
        Ok(!self.ended)
    }

    fn endless(&self) -> Error {
        Error::Malformed {
            path: self.table.path.clone(),
            line: Some(self.line),
            problem: format!("a row of more than {} MB", LONGEST_ROW >> 20),
            hint: "is there a quote that is left open?".into(),
        }
    }
}

impl Source {
    /// Reads ahead in a thread of its own, so that what has come is known from what has not.
    fn prompt(mut input: impl Read + Send + 'static) -> Self {
        /// What a pipe holds.
        const PIECE: usize = 1 << 16;
        let (sender, pieces) = sync_channel(BLOCK / PIECE);
        std::thread::spawn(move || {
            let mut buffer = vec![0; PIECE];
            loop {
                let read = match input.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => Ok(buffer[..count].to_vec()),
                    Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                    Err(error) => Err(error),
                };
                let failed = read.is_err();
                if sender.send(read).is_err() || failed {
                    break;
                }
            }
        });
        Self::Prompt(pieces)
    }
}

/// What has come, and if nothing has, the next that comes; nothing at the end.
fn take_all(
    pieces: &Receiver<std::io::Result<Vec<u8>>>,
    held: &mut Vec<u8>,
) -> std::io::Result<()> {
    let Ok(first) = pieces.recv() else { return Ok(()) };
    held.extend(first?);
    while held.len() < BLOCK
        && let Ok(next) = pieces.try_recv()
    {
        held.extend(next?);
    }
    Ok(())
}
