//! Lower triangles in the order in which they are factored.

use crate::{
    aligned::AlignedVec,
    blocked_matrix::{Column, ROWS},
};
use nalgebra::DMatrix;

/// The lower triangle of a square matrix in panels of eight rows: each up to where its diagonal ends, column by
/// column. Beyond the matrix stands the unit matrix; what stands above the diagonal means nothing.
#[derive(Clone, Debug)]
pub struct Lower {
    size: usize,
    values: AlignedVec<f64>,
}

/// Columns of all panels before this one: each has eight more than the last.
fn columns_before(panel: usize) -> usize {
    panel * (panel + 1) / 2 * ROWS
}

impl Lower {
    /// Of so many rows of nothing but zeros.
    #[must_use]
    pub fn zeros(size: usize) -> Self {
        let panels = size.div_ceil(ROWS);
        let mut lower = Self { size, values: AlignedVec::zeros(columns_before(panels) * ROWS) };
        for index in size..panels * ROWS {
            let place = Self::place(index, index);
            lower.values[place] = 1.0;
        }
        lower
    }

    /// Of this matrix.
    #[must_use]
    pub fn of(matrix: &DMatrix<f64>) -> Self {
        let mut lower = Self::zeros(matrix.nrows());
        let (size, values) = (lower.size, matrix.as_slice());
        for panel in 0..lower.panels() {
            let first = panel * ROWS;
            let count = ROWS.min(size - first);
            let rows = &mut lower.columns_mut()[columns_before(panel)..][..first + count];
            for (column, to) in rows.iter_mut().enumerate() {
                let from = &values[column * size + first..][..count];
                let below = column.saturating_sub(first);
                to[below..count].copy_from_slice(&from[below..]);
            }
        }
        lower
    }

    /// Rows of the matrix.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Where an entry on or below the diagonal stands among [`Lower::values_mut`].
    #[must_use]
    pub fn place(row: usize, column: usize) -> usize {
        (columns_before(row / ROWS) + column) * ROWS + row % ROWS
    }

    /// The entry there, on or below the diagonal.
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.values[Self::place(row, column)]
    }

    /// All entries.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    pub(super) fn panels(&self) -> usize {
        self.size.div_ceil(ROWS)
    }

    /// Panel by panel.
    pub(super) fn columns(&self) -> &[Column] {
        self.values.as_chunks().0
    }

    pub(super) fn columns_mut(&mut self) -> &mut [Column] {
        self.values.as_chunks_mut().0
    }

    /// Row `8 panel + 0..8`, column by column, up to and with the diagonal.
    pub(super) fn panel(&self, panel: usize) -> &[Column] {
        &self.columns()[columns_before(panel)..columns_before(panel + 1)]
    }

    /// Adds to the diagonal.
    pub(super) fn add_to_diagonal(&mut self, more: impl Fn(usize) -> f64) {
        for index in 0..self.size {
            self.values[Self::place(index, index)] += more(index);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_what_is_on_and_below_the_diagonal() {
        for size in [1, 7, 8, 9, 21] {
            let matrix = DMatrix::from_fn(size, size, |row, column| (100 * row + column) as f64);
            let mut lower = Lower::of(&matrix);
            lower.add_to_diagonal(|index| index as f64);
            for row in 0..size {
                for column in 0..=row {
                    let more = if row == column { row as f64 } else { 0.0 };
                    assert_eq!(lower.get(row, column), matrix[(row, column)] + more);
                }
            }
            assert_eq!(lower.size(), size);
        }
    }
}
