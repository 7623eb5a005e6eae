//! Distances over a raster.

use crate::robot::map::CELL;

/// Distances are measured so far and no farther, in cells: to where nearness costs nothing any more.
const REACH: usize = 16;

/// From the middle of each cell to that of the nearest cell that `holds`, in centimetres; what is
/// farther than 32 cm counts as that.
///
/// Down and up the columns first, then along the rows over the squares of those (Rosenfeld & Pfaltz
/// 1966, doi:10.1145/321356.321357; exact, as squares add).
pub(super) fn distances(columns: usize, holds: &[bool]) -> Vec<f32> {
    let mut squares = vec![(REACH * REACH) as f32; holds.len()];
    let upwards = (0..holds.len() / columns).rev();
    sweep(columns, holds, &mut squares, 0..holds.len() / columns);
    sweep(columns, holds, &mut squares, upwards);
    let mut found = squares.clone();
    for (found, squares) in found.chunks_mut(columns).zip(squares.chunks(columns)) {
        for aside in 1..REACH.min(columns) {
            let square = (aside * aside) as f32;
            for (found, other) in found[aside..].iter_mut().zip(squares) {
                *found = found.min(other + square);
            }
            for (found, other) in found.iter_mut().zip(&squares[aside..]) {
                *found = found.min(other + square);
            }
        }
        for square in found {
            *square = square.sqrt() * CELL as f32;
        }
    }
    found
}

/// Squared distances along the columns, from the rows already passed.
fn sweep(columns: usize, holds: &[bool], squares: &mut [f32], rows: impl Iterator<Item = usize>) {
    let mut steps = vec![REACH; columns];
    for row in rows {
        let row = row * columns..(row + 1) * columns;
        for ((steps, holds), square) in
            steps.iter_mut().zip(&holds[row.clone()]).zip(&mut squares[row])
        {
            *steps = if *holds { 0 } else { (*steps + 1).min(REACH) };
            *square = square.min((*steps * *steps) as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::Random;

    #[test]
    fn distances_are_those_to_the_nearest_of_all() {
        let (columns, rows) = (40, 30);
        let mut random = Random::new(3);
        let holds: Vec<bool> = (0..columns * rows).map(|_| random.below(150) == 0).collect();
        let found = distances(columns, &holds);
        for (at, found) in found.iter().enumerate() {
            let nearest = (0..holds.len()).filter(|&other| holds[other]).map(|other| {
                let across = (other % columns).abs_diff(at % columns);
                let along = (other / columns).abs_diff(at / columns);
                ((across * across + along * along) as f32).sqrt() * CELL as f32
            });
            let nearest = nearest.fold(REACH as f32 * CELL as f32, f32::min);
            assert!((found - nearest).abs() < 1e-4, "{at}: {found} {nearest}");
        }
    }
}
