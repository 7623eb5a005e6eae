//! How files are written: in blocks, and long ones by a thread of their own, past the system's memory.
//!
//! A file is synced before it gets its name, so that all of it has to reach the disk anyway. What the system
//! is given to keep until then costs a copy and pages to put it in, up to seconds a gigabyte, and all waits
//! at the end for the disk.

#[cfg(target_arch = "wasm32")]
use super::beside::AtomicWriteFile;
#[cfg(not(target_arch = "wasm32"))]
use atomic_write_file::AtomicWriteFile;
use std::{
    fs::File,
    io::{Error, ErrorKind, Result, Write},
    sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel},
    thread::JoinHandle,
};

/// Bytes that are written at once: with an eighth of it a disk took 1.1 GB/s, with half of it and more 1.5 GB/s.
const BLOCK: usize = 1 << 21;

/// Disks take memory from places and in lengths that are multiples of this, or of less.
const ALIGNED: usize = 1 << 12;

/// Shorter files are for the system to keep: they may be read again at once.
const LONG: usize = 4 * BLOCK;

/// Blocks that wait to be written, or are being written.
const WAITING: usize = 4;

/// Writes one file from its beginning on.
pub(super) struct Pen {
    block: Block,
    to: To,
    written: usize,
}

/// Who holds the file.
enum To {
    Here(AtomicWriteFile),
    Thread(Thread),
    /// It was lost with an error.
    Nobody,
}

/// A thread that writes.
struct Thread {
    sender: SyncSender<Block>,
    /// Blocks that were written, to be filled again.
    back: Receiver<Block>,
    /// Those that there are.
    blocks: usize,
    thread: JoinHandle<Result<AtomicWriteFile>>,
}

/// Bytes at an aligned place.
struct Block {
    memory: Vec<u8>,
    begin: usize,
    length: usize,
}

impl Pen {
    pub(super) fn new(file: AtomicWriteFile) -> Self {
        Self { block: Block::new(), to: To::Here(file), written: 0 }
    }

    /// Ends the file, which is not synced.
    pub(super) fn finish(mut self) -> Result<AtomicWriteFile> {
        self.pass_on()?;
        match std::mem::replace(&mut self.to, To::Nobody) {
            To::Here(file) => Ok(file),
            To::Thread(thread) => thread.finish(),
            To::Nobody => Err(lost()),
        }
    }

    /// Writes what is gathered.
    fn pass_on(&mut self) -> Result<()> {
        self.written += self.block.length;
        if let To::Here(file) = &mut self.to {
            file.write_all(self.block.filled())?;
            self.block.length = 0;
            if self.written >= LONG
                && let To::Here(file) = std::mem::replace(&mut self.to, To::Nobody)
            {
                self.to = To::Thread(Thread::begin(file));
            }
            return Ok(());
        }
        let To::Thread(thread) = &mut self.to else { return Err(lost()) };
        if thread.exchange(&mut self.block).is_some() {
            return Ok(());
        }
        match std::mem::replace(&mut self.to, To::Nobody) {
            To::Thread(thread) => Err(thread.finish().err().unwrap_or_else(lost)),
            _ => Err(lost()),
        }
    }
}

impl Write for Pen {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let count = bytes.len().min(BLOCK - self.block.length);
        self.block.free()[..count].copy_from_slice(&bytes[..count]);
        self.block.length += count;
        if self.block.length == BLOCK {
            self.pass_on()?;
        }
        Ok(count)
    }

    /// What is gathered goes on when a block is full.
    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Drop for Pen {
    /// Waits for the thread, which leaves nothing behind.
    fn drop(&mut self) {
        if let To::Thread(thread) = std::mem::replace(&mut self.to, To::Nobody) {
            drop(thread.finish());
        }
    }
}

impl Thread {
    fn begin(mut file: AtomicWriteFile) -> Self {
        let (sender, blocks) = sync_channel::<Block>(WAITING);
        let (give_back, back): (Sender<Block>, _) = channel();
        let thread = std::thread::spawn(move || {
            let mut past = past_memory(&file, true);
            for mut block in blocks {
                write(&mut file, block.filled(), &mut past)?;
                block.length = 0;
                // Nobody waits for the last ones.
                let _ = give_back.send(block);
            }
            Ok(file)
        });
        Self { sender, back, blocks: 0, thread }
    }

    /// Takes a block for an empty one; none where the thread has ended.
    fn exchange(&mut self, block: &mut Block) -> Option<()> {
        let empty = if self.blocks < WAITING {
            self.blocks += 1;
            Block::new()
        } else {
            self.back.recv().ok()?
        };
        self.sender.send(std::mem::replace(block, empty)).ok()
    }

    fn finish(self) -> Result<AtomicWriteFile> {
        let Self { sender, thread, .. } = self;
        drop(sender);
        thread.join().unwrap_or_else(|_| Err(lost()))
    }
}

impl Block {
    fn new() -> Self {
        let memory = vec![0; BLOCK + ALIGNED];
        let begin = memory.as_ptr().align_offset(ALIGNED).min(ALIGNED);
        Self { memory, begin, length: 0 }
    }

    fn filled(&self) -> &[u8] {
        &self.memory[self.begin..self.begin + self.length]
    }

    fn free(&mut self) -> &mut [u8] {
        &mut self.memory[self.begin + self.length..self.begin + BLOCK]
    }
}

/// Writes all bytes, past memory as long as that works.
fn write(file: &mut File, mut bytes: &[u8], past: &mut bool) -> Result<()> {
    while *past && !bytes.is_empty() {
        let wrote = if bytes.len().is_multiple_of(ALIGNED) { file.write(bytes) } else { Ok(0) };
        match wrote {
            Ok(count) if count > 0 => bytes = &bytes[count..],
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if error.kind() != ErrorKind::InvalidInput => return Err(error),
            // The file's end, or a disk that asks for more.
            _ => *past = past_memory(file, false),
        }
    }
    file.write_all(bytes)
}

/// Has what is written kept in memory or not; whether it is not.
#[cfg(target_os = "linux")]
fn past_memory(file: &impl std::os::fd::AsFd, past: bool) -> bool {
    use nix::fcntl::{FcntlArg, OFlag, fcntl};
    let Ok(flags) = fcntl(file, FcntlArg::F_GETFL) else { return false };
    let mut flags = OFlag::from_bits_retain(flags);
    flags.set(OFlag::O_DIRECT, past);
    fcntl(file, FcntlArg::F_SETFL(flags)).is_ok() && past
}

/// Other systems are not asked.
#[cfg(not(target_os = "linux"))]
fn past_memory(_: &File, _: bool) -> bool {
    false
}

fn lost() -> Error {
    Error::other("writing broke off")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes that tell their places.
    fn text(length: usize) -> Vec<u8> {
        (0..length as u32).flat_map(|place| (place * 7).to_le_bytes()).take(length).collect()
    }

    #[test]
    fn files_of_all_lengths_are_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        for (length, piece) in [
            (0, 1),
            (1, 1),
            (BLOCK, 4097),
            (LONG - 1, BLOCK / 3),
            (LONG, BLOCK / 3),
            (LONG + 1, 5 * BLOCK / 2),
            (LONG + BLOCK, BLOCK),
            (LONG + 5 * BLOCK + ALIGNED, 12_345),
            (LONG + 9 * BLOCK + ALIGNED + 77, LONG),
        ] {
            let text = text(length);
            let mut pen = Pen::new(AtomicWriteFile::open(&path).unwrap());
            for piece in text.chunks(piece) {
                pen.write_all(piece).unwrap();
            }
            pen.finish().unwrap().commit().unwrap();
            assert!(std::fs::read(&path).unwrap() == text, "{length} bytes in pieces of {piece}");
        }
    }

    #[test]
    fn what_is_not_finished_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        for length in [BLOCK / 2, LONG + 3 * BLOCK] {
            let mut pen = Pen::new(AtomicWriteFile::open(folder.path().join("file")).unwrap());
            pen.write_all(&text(length)).unwrap();
            drop(pen);
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        }
    }
}
