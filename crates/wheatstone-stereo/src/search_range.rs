//! Disparities among which the match of a pixel is searched.

use crate::{error::MatchError, limits::MOST_DISPARITIES, registers::LANES};
use std::ops::Range;

/// A range that was checked against the pictures' width.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchRange {
    /// The smallest disparity.
    pub(crate) first: i32,
    /// How many there are.
    pub(crate) count: usize,
    /// The same, filled up to whole registers.
    pub(crate) slots: usize,
}

impl SearchRange {
    pub(crate) fn parse(range: &Range<i32>, width: usize) -> Result<Self, MatchError> {
        let (first, end) = (range.start, range.end);
        let count = usize::try_from(i64::from(end) - i64::from(first)).unwrap_or(0);
        if count == 0 || count > MOST_DISPARITIES {
            return Err(MatchError::Range { first, end });
        }
        let widest = i64::try_from(width).unwrap_or(i64::MAX);
        if i64::from(first) >= widest || i64::from(end) <= 1 - widest {
            return Err(MatchError::OutsidePicture { first, end, width });
        }
        Ok(Self { first, count, slots: count.next_multiple_of(LANES) })
    }

    /// Half a pixel beyond the first and the last disparity.
    pub(crate) fn bounds(&self) -> (f32, f32) {
        let last = self.first + self.count as i32 - 1;
        (self.first as f32 - 0.5, last as f32 + 0.5)
    }

    /// Which disparities of this range lead from a pixel of the left picture to one of the right.
    #[inline(always)]
    pub(crate) fn inside(&self, x: usize, width: usize) -> Range<usize> {
        // The pixel on the right is x - first - index, and 0 <= it < width.
        let last = x as i64 - i64::from(self.first);
        let from = (last + 1 - width as i64).clamp(0, self.count as i64);
        let to = (last + 1).clamp(from, self.count as i64);
        from as usize..to as usize
    }
}
