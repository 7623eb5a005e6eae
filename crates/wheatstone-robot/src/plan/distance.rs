//! Distances over a raster.

use crate::map::CELL;
use wheatstone_numeric::simd::{Simd, WithSimd, on_widest};

/// From the middle of each cell to that of the nearest cell that `holds`, in centimetres; what is
/// farther than `reach` cells counts as that.
///
/// Down and up the columns first, then along the rows over the squares of those (Saito & Toriwaki
/// 1994, doi:10.1016/0031-3203(94)90133-3): exact, and the same few sums for every cell.
pub(super) fn distances(columns: usize, holds: &[bool], reach: usize) -> Vec<f32> {
    let squares = along_columns(columns, holds, reach);
    let mut found = squares.clone();
    on_widest(AlongRows { columns, squares: &squares, found: &mut found, reach });
    found
}

/// From squared distances along the columns to distances, in centimetres.
struct AlongRows<'a> {
    columns: usize,
    squares: &'a [f32],
    /// The same squares at first.
    found: &'a mut [f32],
    reach: usize,
}

impl WithSimd for AlongRows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let columns = self.columns;
        let rows = self.found.chunks_mut(columns).zip(self.squares.chunks(columns));
        for (found, squares) in rows {
            for aside in 1..self.reach.min(columns) {
                let square = (aside * aside) as f32;
                lower(&mut found[aside..], squares, square);
                lower(found, &squares[aside..], square);
            }
            for square in found {
                *square = square.sqrt() * CELL as f32;
            }
        }
    }
}

/// Lowers what is found to what others and a step aside come to, where that is less.
#[inline(always)]
fn lower(found: &mut [f32], others: &[f32], step: f32) {
    for (found, other) in found.iter_mut().zip(others) {
        let by_it = other + step;
        *found = if by_it < *found { by_it } else { *found };
    }
}

/// Squared distances along the columns.
fn along_columns(columns: usize, holds: &[bool], reach: usize) -> Vec<f32> {
    let rows = holds.len() / columns;
    let mut squares = vec![0.0; holds.len()];
    let mut sweep = |row: usize, steps: &mut [usize], first: bool| {
        let row = row * columns..(row + 1) * columns;
        let cells = holds[row.clone()].iter().zip(&mut squares[row]);
        for (steps, (holds, square)) in steps.iter_mut().zip(cells) {
            *steps = if *holds { 0 } else { (*steps + 1).min(reach) };
            let found = (*steps * *steps) as f32;
            *square = if first { found } else { found.min(*square) };
        }
    };
    let mut steps = vec![reach; columns];
    (0..rows).for_each(|row| sweep(row, &mut steps, true));
    steps.fill(reach);
    (0..rows).rev().for_each(|row| sweep(row, &mut steps, false));
    squares
}
