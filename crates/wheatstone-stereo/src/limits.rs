//! Bounds of what may be asked for.

/// The most disparities that one search may have.
pub const MOST_DISPARITIES: usize = 1024;
/// The most that a penalty can be: with the highest cost, it still fits into a byte.
pub const MOST_PENALTY: u8 = 200;
