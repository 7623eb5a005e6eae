//! The ground about every pixel: how far each differs from the mean of a window around it.

use crate::imaging::GrayImage;

/// Half a side of the window whose mean parts dark from bright: a window of 33 pixels holds dots of
/// 26 with ground around them; larger dots are found in smaller pictures.
const HALF_WINDOW: usize = 16;
/// Share of the window's standard deviation by which a patch differs from its mean. A third keeps dots
/// apart at the ground's side where they fill half of it, and pale ones in where they fill a twentieth.
const DEVIATION: f64 = 0.35;
/// Sums over the rows about one row, from which those over a window follow.
pub(super) struct Window<'a> {
    image: &'a GrayImage,
    /// Of each column's values, and of their squares.
    columns: [Vec<f64>; 2],
    /// The same of all columns to the left.
    sums: [Vec<f64>; 2],
    rows: usize,
}

impl<'a> Window<'a> {
    pub(super) fn new(image: &'a GrayImage) -> Self {
        let columns = [vec![0.0; image.width()], vec![0.0; image.width()]];
        let sums = [vec![0.0; image.width() + 1], vec![0.0; image.width() + 1]];
        let mut own = Self { image, columns, sums, rows: 0 };
        (0..HALF_WINDOW.min(image.height())).for_each(|row| own.add(row, 1.0));
        own
    }

    fn add(&mut self, row: usize, sign: f64) {
        let [values, squares] = &mut self.columns;
        for ((sum, square), value) in values.iter_mut().zip(squares).zip(self.image.row(row)) {
            let value = f64::from(*value);
            *sum += sign * value;
            *square += sign * value * value;
        }
    }

    /// From the row before to this one.
    pub(super) fn move_to(&mut self, row: usize) {
        let last = self.image.height() - 1;
        if row + HALF_WINDOW <= last {
            self.add(row + HALF_WINDOW, 1.0);
        }
        if row > HALF_WINDOW {
            self.add(row - HALF_WINDOW - 1, -1.0);
        }
        for (sums, columns) in self.sums.iter_mut().zip(&self.columns) {
            let mut sum = 0.0;
            for (left, column) in sums[1..].iter_mut().zip(columns) {
                sum += column;
                *left = sum;
            }
        }
        self.rows = (row + HALF_WINDOW).min(last) - row.saturating_sub(HALF_WINDOW) + 1;
    }

    /// How far each pixel of the row is from the mean about it, and 0 where that is no more than its
    /// ground varies.
    pub(super) fn differences(&self, row: usize, least: f64, out: &mut [f32]) {
        let width = out.len();
        let values = self.image.row(row);
        let [sums, squares] = &self.sums;
        let difference = |value: f32, sum: f64, square: f64, share: f64| {
            let mean = sum * share;
            let variance = square * share - mean * mean;
            let difference = f64::from(value) - mean;
            let most = (least * least).max(DEVIATION * DEVIATION * variance);
            if difference * difference > most { difference as f32 } else { 0.0 }
        };
        let at_side = |x: usize| {
            let (left, right) = (x.saturating_sub(HALF_WINDOW), (x + HALF_WINDOW + 1).min(width));
            let share = 1.0 / ((right - left) * self.rows) as f64;
            difference(values[x], sums[right] - sums[left], squares[right] - squares[left], share)
        };
        let inside = HALF_WINDOW..width.saturating_sub(HALF_WINDOW).max(HALF_WINDOW);
        for x in (0..inside.start.min(width)).chain(inside.end.min(width)..width) {
            out[x] = at_side(x);
        }
        // The same in the middle, where windows have one width, without a branch: twelve million pixels.
        let across = 2 * HALF_WINDOW + 1;
        let share = 1.0 / (across * self.rows) as f64;
        if width > 2 * HALF_WINDOW {
            let ends = sums.iter().zip(squares).zip(sums[across..].iter().zip(&squares[across..]));
            let middle = values[inside.clone()].iter().zip(ends);
            for (out, (value, ((low, low_square), (high, high_square)))) in
                out[inside].iter_mut().zip(middle)
            {
                *out = difference(*value, high - low, high_square - low_square, share);
            }
        }
    }
}
