//! Small pieces of surface are taken away: most of them are wrong matches.
//!
//! Pixels beside each other are of one surface where their disparities differ little. Runs of a row are joined to
//! those above that they touch (union and find, Tarjan 1975, doi:10.1145/321879.321884).

use crate::field::Field;
use rayon::prelude::*;

/// Disparities of neighbours on one surface differ by this at most, in pixels.
const MOST_STEP: f32 = 1.0;

/// A run of pixels of a row on one surface, and the surface it belongs to.
struct Run {
    start: usize,
    end: usize,
    /// A run of the same surface with a smaller number, or this one.
    parent: usize,
    /// Pixels of all runs whose root this is.
    pixels: usize,
}

/// Takes away surfaces of fewer pixels than `least`. Of the others every pixel gets the natural logarithm of the number of pixels of its
/// surface.
pub(crate) fn remove(disparity: &mut Field, least: usize) -> Field {
    let mut runs: Vec<Run> = Vec::new();
    let mut rows = vec![0];
    for y in 0..disparity.height {
        add_runs(disparity.pixels(y), &mut runs);
        if y > 0 {
            let (above, same) = (disparity.pixels(y - 1), disparity.pixels(y));
            join_rows(&mut runs, [rows[y - 1], rows[y]], above, same);
        }
        rows.push(runs.len());
    }
    for number in (0..runs.len()).rev() {
        let (parent, pixels) = (runs[number].parent, runs[number].pixels);
        if parent != number {
            runs[parent].pixels += pixels;
        }
    }
    // Parents have smaller numbers: their sums of all runs are known before those of their children.
    for number in 0..runs.len() {
        runs[number].pixels = runs[runs[number].parent].pixels;
    }
    let mut surface = disparity.like(0.0);
    let both = disparity.par_pixels_mut().zip(surface.par_pixels_mut());
    both.enumerate().for_each(|(y, (pixels, surface))| {
        for run in &runs[rows[y]..rows[y + 1]] {
            if run.pixels < least {
                pixels[run.start..run.end].fill(f32::NAN);
            } else {
                surface[run.start..run.end].fill(libm::logf(run.pixels as f32));
            }
        }
    });
    surface
}

fn add_runs(row: &[f32], runs: &mut Vec<Run>) {
    let mut x = 0;
    while x < row.len() {
        let start = x;
        x += 1;
        if row[start].is_nan() {
            continue;
        }
        while x < row.len() && (row[x] - row[x - 1]).abs() <= MOST_STEP {
            x += 1;
        }
        runs.push(Run { start, end: x, parent: runs.len(), pixels: x - start });
    }
}

/// Joins the runs of a row, from the second number on, with those of the row above, from the first.
fn join_rows(runs: &mut [Run], [mut upper, mut lower]: [usize; 2], above: &[f32], same: &[f32]) {
    let first_lower = lower;
    while upper < first_lower && lower < runs.len() {
        let start = runs[upper].start.max(runs[lower].start);
        let end = runs[upper].end.min(runs[lower].end);
        if (start..end).any(|x| (above[x] - same[x]).abs() <= MOST_STEP) {
            join(runs, upper, lower);
        }
        if runs[upper].end <= runs[lower].end {
            upper += 1;
        } else {
            lower += 1;
        }
    }
}

fn join(runs: &mut [Run], a: usize, b: usize) {
    let (a, b) = (root(runs, a), root(runs, b));
    runs[a.max(b)].parent = a.min(b);
}

fn root(runs: &mut [Run], mut number: usize) -> usize {
    while runs[number].parent != number {
        let parent = runs[number].parent;
        runs[number].parent = runs[parent].parent;
        number = runs[number].parent;
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::buffers::Pool;

    #[test]
    fn takes_away_what_is_small_alone() {
        let mut disparity = Field::new(&Pool::default(), (7, 5), f32::NAN);
        // A ring of sixteen pixels around one other pixel, and two pixels that touch it in a corner only.
        let picture = ["11111..", "1...1..", "1.9.1..", "1...1..", "11111.."];
        for (y, out) in disparity.par_pixels_mut().collect::<Vec<_>>().into_iter().enumerate() {
            for (out, byte) in out.iter_mut().zip(picture[y].bytes()) {
                *out = if byte == b'.' { f32::NAN } else { f32::from(byte - b'0') };
            }
        }
        let surface = remove(&mut disparity, 16);
        assert_eq!(surface.pixels(0)[4..6], [libm::logf(16.0), 0.0]);
        assert_eq!(disparity.to_pixels().iter().filter(|v| v.is_finite()).count(), 16);
        remove(&mut disparity, 17);
        assert!(disparity.to_pixels().iter().all(|v| v.is_nan()));
    }
}
