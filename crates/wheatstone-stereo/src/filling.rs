//! Disparities where none was measured.
//!
//! What one picture alone sees lies behind what hides it: a gap gets the smaller of the disparities at its two ends
//! in the row (Hirschmüller 2008, section 2.6). A row without any takes those of the nearest row.

use rayon::prelude::*;

/// Fills a map, row by row, where it has any disparity.
pub(crate) fn fill(disparity: &mut [f32], width: usize) {
    disparity.par_chunks_mut(width).for_each(fill_row);
    let is_known = |row: &[f32]| !row[0].is_nan();
    let known: Vec<usize> = disparity
        .chunks(width)
        .enumerate()
        .filter_map(|(y, row)| is_known(row).then_some(y))
        .collect();
    for y in 0..disparity.len() / width {
        let after = known.partition_point(|&row| row < y);
        let nearest = known[after.saturating_sub(1)..(after + 1).min(known.len())]
            .iter()
            .min_by_key(|row| row.abs_diff(y));
        if let Some(&row) = nearest.filter(|&&row| row != y) {
            disparity.copy_within(row * width..(row + 1) * width, y * width);
        }
    }
}

fn fill_row(row: &mut [f32]) {
    let mut start = 0;
    while start < row.len() {
        let gap = row[start..].iter().take_while(|value| value.is_nan()).count();
        let end = start + gap;
        let before = start.checked_sub(1).map(|at| row[at]);
        let after = row.get(end).copied();
        // The smaller of both, or the one there is.
        if let Some(value) = before.into_iter().chain(after).reduce(f32::min) {
            row[start..end].fill(value);
        }
        start = end + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::fill;

    #[test]
    fn gaps_lie_behind_what_is_beside_them() {
        let none = f32::NAN;
        let mut map = [none, 5.0, none, none, 2.0, none].repeat(2);
        map.extend([none; 6]);
        fill(&mut map, 6);
        assert_eq!(map, [5.0, 5.0, 2.0, 2.0, 2.0, 2.0].repeat(3));
        let mut nothing = vec![none; 6];
        fill(&mut nothing, 3);
        assert!(nothing.iter().all(|value| value.is_nan()));
    }
}
