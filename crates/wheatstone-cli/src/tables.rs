//! Tables that pass through a verb: rows in, rows with more columns out, some at a time. Reading and writing
//! have a thread each, beside that of the verb.

use crate::failure::{Failure, Outcome};
use std::{
    io::Write,
    path::Path,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};
use wheatstone::{
    Error,
    storage::Output,
    tables::{ArrayRef, Rows, TableReader, TableStyle, TableWriter},
};

/// Parts of a table that wait between two threads: enough that neither waits for the other's slower ones.
const WAITING: usize = 4;

/// Reads in a thread of its own, which ends with the rows, with the first error, or when nobody listens any
/// more. It is not waited for: it may itself wait for a producer.
pub(crate) fn start(mut reader: TableReader) -> Receiver<Outcome<Rows>> {
    let (sender, rows) = sync_channel(WAITING);
    std::thread::spawn(move || {
        while let Some(next) = reader.next_rows().transpose() {
            let failed = next.is_err();
            if sender.send(next.map_err(Into::into)).is_err() || failed {
                break;
            }
        }
    });
    rows
}

/// Where rows go.
pub(crate) struct Sink {
    writer: TableWriter<Target>,
    standard: bool,
}

enum Target {
    Standard(std::io::Stdout),
    File(Output),
}

/// Rows on their way to a thread that writes, with what was found out of them, until nothing more is to come.
pub(crate) struct Writing<F> {
    sender: Option<SyncSender<(Rows, F)>>,
    thread: Option<JoinHandle<Outcome<Sink>>>,
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self {
            Self::Standard(output) => output.write(bytes),
            Self::File(output) => output.write(bytes),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match self {
            Self::Standard(output) => output.flush(),
            Self::File(output) => output.flush(),
        }
    }
}

impl Sink {
    /// To a file, or standard output for `-`, with columns of these names.
    pub(crate) fn create(path: &Path, names: Vec<String>, style: TableStyle) -> Outcome<Self> {
        let standard = path.as_os_str() == "-";
        let target = if standard {
            Target::Standard(std::io::stdout())
        } else {
            Target::File(Output::create(path)?)
        };
        let writer = TableWriter::new(path, target, names, style);
        Ok(Self { writer: writer.map_err(|e| failure(e, standard))?, standard })
    }

    /// Writes in a thread of its own, where `added` makes columns of what was found.
    pub(crate) fn start<F: Send + 'static>(
        mut self,
        added: impl Fn(&Rows, F) -> Vec<ArrayRef> + Send + 'static,
    ) -> Writing<F> {
        let (sender, located) = sync_channel(WAITING);
        let thread = std::thread::spawn(move || {
            for (rows, found) in located {
                let added = added(&rows, found);
                self.writer.write(&rows, &added).map_err(|e| failure(e, self.standard))?;
            }
            Ok(self)
        });
        Writing { sender: Some(sender), thread: Some(thread) }
    }

    /// Puts the file in its place.
    fn finish(self) -> Outcome {
        match self.writer.finish().map_err(|e| failure(e, self.standard))? {
            Target::Standard(mut output) => output.flush().map_err(Failure::Output),
            Target::File(output) => Ok(output.commit()?),
        }
    }
}

/// What went wrong with standard output is told as such: whoever reads it may have seen enough.
fn failure(error: Error, standard: bool) -> Failure {
    match error {
        Error::Io { action: "write", source, .. } if standard => Failure::Output(source),
        other => other.into(),
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
            None => Err(Failure::Output(std::io::Error::other("the writing thread ended early"))),
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
