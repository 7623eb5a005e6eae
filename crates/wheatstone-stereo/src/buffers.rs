//! Memory that a matcher keeps from one pair to the next.
//!
//! The system hands memory out in pages that it clears one by one: a fifth of the time that the search takes in small pictures.

use std::{
    ops::{Deref, DerefMut},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Bytes that a pool keeps at most: what two threads take for pictures of 1280 x 720 pixels and 128 disparities.
const MOST_KEPT: usize = 128 << 20;

/// The memory of a matcher and of its clones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pools {
    pub(crate) bytes: Pool<u8>,
    pub(crate) floats: Pool<f32>,
}

/// All pools are alike: what they keep has no say in results.
impl PartialEq for Pools {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Eq for Pools {}

/// Vectors that nobody uses at the moment, the oldest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pool<T>(Arc<Mutex<Vec<Vec<T>>>>);

impl<T: Copy + Default> Pool<T> {
    /// A buffer that holds one value everywhere.
    pub(crate) fn filled(&self, length: usize, value: T) -> Buffer<T> {
        let mut buffer = self.any(length);
        buffer.fill(value);
        buffer
    }

    /// A buffer that holds anything, to be written before it is read.
    pub(crate) fn any(&self, length: usize) -> Buffer<T> {
        let mut values = self.take(length).unwrap_or_else(|| vec![T::default(); length]);
        values.resize(length, T::default());
        Buffer { values, pool: self.clone() }
    }

    /// The smallest vector that is large enough.
    fn take(&self, length: usize) -> Option<Vec<T>> {
        let mut kept = self.kept();
        let large = kept.iter().enumerate().filter(|(_, values)| values.capacity() >= length);
        let (smallest, _) = large.min_by_key(|(_, values)| values.capacity())?;
        Some(kept.remove(smallest))
    }

    fn give_back(&self, values: Vec<T>) {
        let mut kept = self.kept();
        kept.push(values);
        let bytes = |values: &Vec<T>| values.capacity() * size_of::<T>();
        while kept.iter().map(bytes).sum::<usize>() > MOST_KEPT {
            kept.remove(0);
        }
    }
}

impl<T> Pool<T> {
    /// A list of vectors is whole whatever happens to its users.
    fn kept(&self) -> MutexGuard<'_, Vec<Vec<T>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A vector that goes back to its pool.
#[derive(Debug)]
pub(crate) struct Buffer<T: Copy + Default> {
    values: Vec<T>,
    pool: Pool<T>,
}

impl<T: Copy + Default> Buffer<T> {
    /// Where it comes from.
    pub(crate) fn pool(&self) -> &Pool<T> {
        &self.pool
    }
}

impl<T: Copy + Default> Drop for Buffer<T> {
    fn drop(&mut self) {
        self.pool.give_back(std::mem::take(&mut self.values));
    }
}

impl<T: Copy + Default> Deref for Buffer<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values
    }
}

impl<T: Copy + Default> DerefMut for Buffer<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_come_back() {
        let pool = Pool::<f32>::default();
        let first = pool.filled(100, 1.0);
        let (large, at) = (pool.any(1000), first.as_ptr());
        drop((first, large));
        let again = pool.filled(50, 2.0);
        assert_eq!(again.as_ptr(), at);
        assert!(again.len() == 50 && again.iter().all(|value| *value == 2.0));
        drop(again);
        assert_eq!(pool.kept().len(), 2);
        assert_eq!(pool.filled(80, 3.0).iter().sum::<f32>(), 240.0);
    }

    #[test]
    fn pools_keep_no_more_than_they_may() {
        let pool = Pool::<u8>::default();
        let buffers: Vec<_> = (1..=3).map(|k| pool.any(100 * k)).collect();
        let large = pool.any(MOST_KEPT - 400);
        drop(large);
        drop(buffers);
        let mut kept: Vec<usize> = pool.kept().iter().map(Vec::capacity).collect();
        kept.sort_unstable();
        assert_eq!(kept, [100, 200, 300]);
        drop(pool.any(MOST_KEPT + 1));
        assert!(pool.kept().is_empty());
    }
}
