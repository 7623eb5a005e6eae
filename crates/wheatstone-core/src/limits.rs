//! How much of a file is taken before it is refused: every reader asks before it takes memory.
//!
//! The limits are far beyond what measurements need, and below what fills a machine. One setting for the process moves
//! them all.

use std::{
    fmt,
    sync::atomic::{AtomicU64, Ordering},
};

/// What there may be so many of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// What is counted, in the plural.
    what: &'static str,
    most: u64,
}

const fn limit(most: u64, what: &'static str) -> Limit {
    Limit { what, most }
}

/// A model holds its data: a million points take a hundred megabytes.
pub const MODEL_BYTES: Limit = limit(1 << 30, "bytes of a model");
/// Of files that people write: a capture, a chart.
pub const SETTINGS_BYTES: Limit = limit(16 << 20, "bytes of settings");
/// Of files of other programs, which are read whole.
pub const FILE_BYTES: Limit = limit(1 << 28, "bytes of a file");
/// Of files that are read together.
pub const FILES: Limit = limit(10_000, "files at once");
/// Of a row of text.
pub const ROW_BYTES: Limit = limit(1 << 24, "bytes of a row");
/// Of a table.
pub const COLUMNS: Limit = limit(10_000, "columns");
/// Cameras of a table; each has two columns.
pub const CAMERAS: Limit = limit(1_000, "cameras");
/// Of a table: each is a pose of the chart, which takes some kilobytes where it is checked.
pub const VIEWS: Limit = limit(20_000, "views");
/// Of all that is held of a table at once: rows times columns of pixels.
pub const CELLS: Limit = limit(1 << 26, "cells of a table in memory");
/// Of a part of a table that is unpacked as a whole: programs write a megabyte or two.
pub const PART_BYTES: Limit = limit(1 << 28, "bytes of a table's part");
/// Of rows that are decoded at once; where they are longer, there are fewer of them.
pub const BATCH_BYTES: Limit = limit(1 << 22, "bytes of rows at once");
/// Along either side of a picture.
pub const PICTURE_SIDE: Limit = limit(16_384, "pixels along a side of a picture");
/// Above the largest industrial sensors sold, of 151 megapixels.
pub const PICTURE_PIXELS: Limit = limit(160_000_000, "pixels of a picture");

/// How many times larger inputs may be.
static TIMES: AtomicU64 = AtomicU64::new(1);

/// Takes inputs that are so many times larger than the limits, in this process from now on.
pub fn raise(times: u64) {
    TIMES.store(times.max(1), Ordering::Relaxed);
}

impl Limit {
    /// The most that is taken.
    #[must_use]
    pub fn most(self) -> u64 {
        self.most.saturating_mul(TIMES.load(Ordering::Relaxed))
    }

    /// That there are more, for what reads bytes and knows no file; [`Error::reading`](crate::Error::reading) recognises it.
    #[must_use]
    pub fn exceeded(self) -> std::io::Error {
        std::io::Error::other(Exceeded(self))
    }
}

/// There are more of something than are taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exceeded(pub(crate) Limit);

/// How messages of a limit end: by it they are recognised behind readers that pass on words alone.
const WORDS: &str = ", which is the limit";

/// Whether the words of an error tell of a limit.
#[must_use]
pub fn is_told_by(words: &str) -> bool {
    words.contains(WORDS)
}

impl fmt::Display for Exceeded {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        write!(to, "more than {} {}{WORDS}", self.0.most(), self.0.what)
    }
}

impl std::error::Error for Exceeded {}
