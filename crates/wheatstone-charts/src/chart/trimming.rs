//! Grids that are larger than the chart, cut to its size.

use std::collections::BTreeMap;

/// Drops the sparsest outer rows and columns of what is larger than `size`, both ways round: a thing
/// beside the board can look like a point of it. Fuller ones stay, for then the board is larger. `filled` is
/// the share of a board's labels that have a point.
pub(super) fn trim<V>(
    labels: &mut BTreeMap<(i32, i32), V>,
    (columns, rows): (usize, usize),
    filled: f64,
) {
    loop {
        let bounds = |pick: fn(&(i32, i32)) -> i32| {
            let all = labels.keys().map(pick);
            all.clone().min().zip(all.max())
        };
        let (Some((left, right)), Some((top, bottom))) = (bounds(|l| l.0), bounds(|l| l.1)) else {
            return;
        };
        let (width, height) = ((right - left + 1) as usize, (bottom - top + 1) as usize);
        if width.max(height) <= columns.max(rows) && width.min(height) <= columns.min(rows) {
            return;
        }
        let on = |column: bool, line: i32| {
            move |label: &(i32, i32)| if column { label.0 == line } else { label.1 == line }
        };
        let sides = [(true, left), (true, right), (false, top), (false, bottom)];
        let share = |(column, line): (bool, i32)| {
            let count = labels.keys().filter(|label| on(column, line)(label)).count();
            count as f64 / if column { height as f64 } else { width as f64 }
        };
        let Some(sparsest) = sides.into_iter().min_by(|a, b| share(*a).total_cmp(&share(*b)))
        else {
            return;
        };
        // A side of the board that is mostly hidden still shows more than a third of its corners.
        if share(sparsest) > 0.34 * filled {
            return;
        }
        labels.retain(|label, _| !on(sparsest.0, sparsest.1)(label));
    }
}
