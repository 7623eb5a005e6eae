//! Where a table is cut: what has come to pay is made between its pieces.

/// Points at the end of which is made what has come to pay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// The number of the point that it ends before, counted from the first that was ever located.
    pub(super) end: usize,
    /// In points.
    length: usize,
    /// How often its points asked for something.
    pub(super) asked: usize,
    /// Points of the pieces before, since one in which many asked.
    quiet: usize,
}

/// Points a task: large enough to pay for handing it over, small enough to balance and to stay in a cache.
pub(super) const TASK: usize = 2048;

/// Points a piece, at least and at most. Threads wait for each other at its end.
pub(super) const PIECES: [usize; 2] = [8 * TASK, 512 * TASK];

impl Piece {
    pub(super) const FIRST: Self = Self { end: PIECES[0], length: PIECES[0], asked: 0, quiet: 0 };

    /// The next piece: a quarter of what has gone by since many points asked. Tables may be sorted by depth, so that
    /// what was made serves no longer: from there all points are worked out one by one to the piece's end.
    pub(super) fn next(&self) -> Self {
        /// Of so many points one that asks: the others cost as much as it does.
        const FEW: usize = 64;
        let asks_much = self.asked * FEW > self.length;
        let quiet = if asks_much { 0 } else { self.quiet + self.length };
        let length = (quiet / 4).clamp(PIECES[0], PIECES[1]) / TASK * TASK;
        Self { end: self.end + length, length, asked: 0, quiet }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_grow_while_no_point_asks_and_are_short_again_when_many_do() {
        let mut piece = Piece { asked: PIECES[0] / 100, ..Piece::FIRST };
        let mut gone_by = 0;
        while piece.length < PIECES[1] {
            gone_by += piece.length;
            let next = piece.next();
            assert!(next.end == gone_by + next.length && next.length.is_multiple_of(TASK));
            assert!(next.length >= piece.length && next.length <= (gone_by / 4).max(PIECES[0]));
            piece = next;
        }
        assert!(gone_by <= 5 * PIECES[1]);
        piece.asked = piece.length / 10;
        assert_eq!(piece.next().length, PIECES[0]);
    }
}
