//! Numbers as the processor's cache has them: line by line.
//!
//! Where numbers do not begin with a line, every second register of four doubles lies across two lines and is
//! read and written twice, and of eight doubles
//! every one: a network's epochs then take 6 % longer, or not, as the heap happens to have it.

use std::ops::{Deref, DerefMut};

/// Bytes a line.
const LINE: usize = 64;

/// Asks for the memory that comes some way after these numbers, to be there when they are reached: a kernel that works
/// for long on each number of a column of many is not foreseen by the processor. Nothing is read, and it may be beyond
/// the column's end.
#[inline(always)]
pub fn ask_ahead<T>(values: &[T]) {
    /// Bytes: long enough for memory to answer, short enough for the nearest cache to keep a few columns of it, and
    /// no page, whose lines would all want the same places there as those that are worked on.
    const AHEAD: usize = 1024;
    #[cfg(target_arch = "x86_64")]
    if let Some(sse) = pulp::core_arch::x86::Sse::try_new() {
        let first = values.as_ptr().cast::<i8>().wrapping_add(AHEAD);
        for offset in (0..size_of_val(values)).step_by(LINE) {
            sse._mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(first.wrapping_add(offset));
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (AHEAD, values);
}

/// A vector that begins with a line.
#[derive(Debug, Default)]
pub struct AlignedVec<T> {
    memory: Vec<T>,
    begin: usize,
    length: usize,
}

impl<T: Copy + Default> AlignedVec<T> {
    /// So many numbers, which are 0.
    #[must_use]
    pub fn zeros(length: usize) -> Self {
        let memory = vec![T::default(); length + LINE / size_of::<T>()];
        Self { begin: begin(memory.as_ptr(), memory.len()), memory, length }
    }

    /// Makes them so many, all 0, in the same memory where it suffices.
    pub fn clear(&mut self, length: usize) {
        self.memory.clear();
        self.memory.resize(length + LINE / size_of::<T>(), T::default());
        (self.begin, self.length) = (begin(self.memory.as_ptr(), self.memory.len()), length);
    }

    /// These numbers.
    pub fn of(values: &[T]) -> Self {
        if values.is_empty() { Self::zeros(0) } else { Self::copied(values, T::default()) }
    }
}

/// The first place at which a line begins, of so many.
fn begin<T>(memory: *const T, places: usize) -> usize {
    memory.align_offset(LINE).min(places)
}

impl<T: Clone> AlignedVec<T> {
    /// These numbers; before the first line stands what means nothing.
    fn copied(values: &[T], nothing: T) -> Self {
        let room = LINE / size_of::<T>();
        let mut memory = Vec::with_capacity(values.len() + room);
        let begin = begin(memory.as_ptr(), room);
        memory.resize(begin, nothing);
        memory.extend_from_slice(values);
        Self { memory, begin, length: values.len() }
    }
}

impl<T: Clone> Clone for AlignedVec<T> {
    fn clone(&self) -> Self {
        // AlignedVec begin at other places of other memory.
        match self.memory.first() {
            Some(any) => Self::copied(self, any.clone()),
            None => Self { memory: Vec::new(), begin: 0, length: 0 },
        }
    }
}

impl<T> Deref for AlignedVec<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.memory[self.begin..self.begin + self.length]
    }
}

impl<T> DerefMut for AlignedVec<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.memory[self.begin..self.begin + self.length]
    }
}
