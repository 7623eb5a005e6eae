//! What is matched: two pictures, and where the right one shows what the left one shows.

use crate::{
    curves::EpipolarCurves, error::MatchError, picture::Picture, search_range::SearchRange,
};
use std::ops::Range;

/// Two pictures of one size. Without curves, what both see lies in one row.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) left: &'a Picture<'a>,
    pub(crate) right: &'a Picture<'a>,
    pub(crate) curves: Option<&'a EpipolarCurves>,
}

impl Pair<'_> {
    /// The range, if it and the curves suit the pictures.
    pub(crate) fn check(&self, range: &Range<i32>) -> Result<SearchRange, MatchError> {
        let [left, right] =
            [self.left, self.right].map(|picture| (picture.width(), picture.height()));
        if left != right {
            return Err(MatchError::Sizes { left, right });
        }
        let parsed = SearchRange::parse(range, left.0)?;
        self.curves.map_or(Ok(()), |curves| curves.check(self.left, range))?;
        Ok(parsed)
    }
}
