//! Tables that pass through a verb: rows in, rows with more columns out, as text or Parquet by the file's
//! extension, some at a time. Reading and writing have a thread each, beside that of the verb.

use crate::failure::{Failure, Outcome};
use std::{
    io::Write,
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};
use wheatstone::{
    Error,
    storage::Output,
    tables::{
        Cells, Column, Columns, ColumnsReader, ColumnsWriter, Pieces, Rows, TextReader,
        header_line, is_parquet,
    },
};

/// Parts of a table that wait between two threads: enough that neither waits for the other's slower ones.
const WAITING: usize = 4;

/// Where rows come from.
pub(crate) enum Input {
    Text(TextReader),
    Parquet(Box<ColumnsReader>),
}

impl Input {
    /// Of a file, or standard input for `-`, from where rows are passed on as they come if `prompt`.
    pub(crate) fn open(path: &Path, prompt: bool) -> Outcome<Self> {
        if is_parquet(path) {
            return Ok(Self::Parquet(Box::new(ColumnsReader::open(path)?)));
        }
        Ok(Self::Text(TextReader::open(path, prompt)?))
    }

    pub(crate) fn cameras(&self) -> usize {
        match self {
            Self::Text(reader) => reader.cameras(),
            Self::Parquet(reader) => reader.cameras(),
        }
    }

    /// The columns' names.
    pub(crate) fn names(&self) -> Vec<String> {
        match self {
            Self::Text(reader) => reader.names().map(str::to_owned).collect(),
            Self::Parquet(reader) => reader.names().map(str::to_owned).collect(),
        }
    }

    /// The character between cells that suits the input.
    pub(crate) fn delimiter(&self) -> u8 {
        match self {
            Self::Text(reader) => reader.delimiter(),
            Self::Parquet(_) => b',',
        }
    }

    /// Reads in a thread of its own, which ends with the rows, with the first error, or when nobody
    /// listens any more. It is not waited for: it may itself wait for a producer.
    pub(crate) fn start(mut self) -> Receiver<Outcome<Rows>> {
        keep_memory();
        let (sender, rows) = sync_channel(WAITING);
        std::thread::spawn(move || {
            while let Some(next) = self.next().transpose() {
                let failed = next.is_err();
                if sender.send(next).is_err() || failed {
                    break;
                }
            }
        });
        rows
    }

    /// The next rows; none at the end.
    fn next(&mut self) -> Outcome<Option<Rows>> {
        // Cells of a table that are held at once, and rows at most: some megabytes, of which a few lie
        // between the threads.
        const CELLS: usize = 1 << 19;
        const ROWS: usize = 1 << 16;
        Ok(match self {
            Self::Text(reader) => reader.next_rows()?,
            Self::Parquet(reader) => {
                let columns = reader.names().count().max(1);
                reader.next_rows((CELLS / columns).clamp(1, ROWS))?
            }
        })
    }
}

/// Has memory kept that was used once. The GNU C library else gives parts of a table back to the system, which
/// clears them page by page each time; it keeps blocks up to the size of the largest that was ever freed.
fn keep_memory() {
    const LARGE: usize = 24 << 20;
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGE)));
}

/// Where rows go.
pub(crate) struct Sink {
    /// Those of the columns that pass through, then those of the added ones.
    names: Vec<String>,
    delimiter: u8,
    to: To,
    /// Name for messages; none for standard output.
    path: Option<PathBuf>,
    /// Text, in memory that is used again.
    pieces: Pieces,
}

enum To {
    Standard,
    Text(Output),
    /// Begun with the first rows, which tell the kinds of the columns.
    Parquet(Option<Output>, Option<Box<ColumnsWriter<Output>>>),
}

/// Rows on their way to a thread that writes, with what was found out of them, until nothing more is to come.
pub(crate) struct Writing<F> {
    sender: Option<SyncSender<(Rows, F)>>,
    thread: Option<JoinHandle<Outcome<Sink>>>,
}

impl Sink {
    /// To a file, or standard output for `-`.
    pub(crate) fn create(path: &Path, names: Vec<String>, delimiter: u8) -> Outcome<Self> {
        if is_parquet(path) {
            let to = To::Parquet(Some(Output::create(path)?), None);
            let (path, pieces) = (Some(path.into()), Pieces::default());
            return Ok(Self { names, delimiter, to, path, pieces });
        }
        let standard = path.as_os_str() == "-";
        let to = if standard { To::Standard } else { To::Text(Output::create(path)?) };
        let path = (!standard).then(|| path.to_path_buf());
        let mut sink = Self { names, delimiter, to, path, pieces: Pieces::default() };
        let line = header_line(sink.names.iter().map(String::as_str), delimiter);
        sink.put(&line)?;
        Ok(sink)
    }

    /// Writes in a thread of its own, where `added` makes columns of what was found.
    pub(crate) fn start<F: Send + 'static>(
        mut self,
        added: impl Fn(&Rows, F) -> Vec<Column> + Send + 'static,
    ) -> Writing<F> {
        let (sender, located) = sync_channel(WAITING);
        let thread = std::thread::spawn(move || {
            for (rows, found) in located {
                let added = added(&rows, found);
                self.write(rows, added)?;
            }
            Ok(self)
        });
        Writing { sender: Some(sender), thread: Some(thread) }
    }

    /// Rows that passed through, with what is added to them, as many columns as were named.
    fn write(&mut self, rows: Rows, added: Vec<Column>) -> Outcome {
        let To::Parquet(output, writer) = &mut self.to else {
            let mut pieces = std::mem::take(&mut self.pieces);
            rows.write(&added, self.delimiter, &mut pieces);
            for piece in pieces.iter() {
                self.put(piece)?;
            }
            self.pieces = pieces;
            return Ok(());
        };
        let mut columns = rows.into_columns()?;
        columns.columns.extend(added.into_iter().map(|column| (String::new(), column)));
        for ((own, _), name) in columns.columns.iter_mut().zip(&self.names) {
            own.clone_from(name);
        }
        if let Some(output) = output.take() {
            let path = self.path.as_deref().unwrap_or(Path::new("-"));
            *writer = Some(Box::new(ColumnsWriter::new(path, output, &columns)?));
        }
        match writer {
            Some(writer) => Ok(writer.write(columns)?),
            None => Ok(()),
        }
    }

    /// Writes text, whole lines of it.
    fn put(&mut self, text: &[u8]) -> Outcome {
        match &mut self.to {
            To::Standard => std::io::stdout().write_all(text).map_err(Failure::Output),
            To::Text(output) => output.write_all(text).map_err(|source| {
                let path = self.path.clone().unwrap_or_default();
                Error::Io { action: "write", path, source }.into()
            }),
            To::Parquet(..) => Ok(()),
        }
    }

    /// Puts the file in its place.
    pub(crate) fn finish(self) -> Outcome {
        match self.to {
            To::Standard => std::io::stdout().flush().map_err(Failure::Output),
            To::Text(output) => Ok(output.commit()?),
            To::Parquet(_, Some(writer)) => Ok(writer.finish()?.commit()?),
            To::Parquet(output, None) => {
                // No rows: all columns are empty ones of numbers.
                let Some(output) = output else { return Ok(()) };
                let none = Column::Numbers(Cells::whole(Vec::new()));
                let empty = |name: &String| (name.clone(), none.clone());
                let like = Columns { columns: self.names.iter().map(empty).collect() };
                let path = self.path.as_deref().unwrap_or(Path::new("-"));
                Ok(ColumnsWriter::new(path, output, &like)?.finish()?.commit()?)
            }
        }
    }
}

impl<F> Writing<F> {
    /// Hands rows over. False where the thread has ended, which [`Writing::finish`] then tells of.
    pub(crate) fn write(&self, rows: Rows, found: F) -> bool {
        self.sender.as_ref().is_some_and(|sender| sender.send((rows, found)).is_ok())
    }

    /// Waits until all is written, and puts the file in its place.
    pub(crate) fn finish(mut self) -> Outcome {
        match self.end() {
            Some(sink) => sink?.finish(),
            None => Err(Failure::Output(std::io::Error::other("the thread that writes broke off"))),
        }
    }

    /// Waits for the thread; none where it has broken off, and has said why.
    fn end(&mut self) -> Option<Outcome<Sink>> {
        drop(self.sender.take());
        self.thread.take()?.join().ok()
    }
}

impl<F> Drop for Writing<F> {
    /// What is not finished leaves nothing behind.
    fn drop(&mut self) {
        drop(self.end());
    }
}
