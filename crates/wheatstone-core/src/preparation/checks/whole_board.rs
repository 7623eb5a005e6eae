//! The whole lattice of a chart of which a view shows a part: labels are mixed up on the chart, not on
//! what is seen of it.

use super::{board::Board, frame::Frame, views::View};
use crate::{dataset::Dataset, geometry::Point3};
use wheatstone_numeric::statistics::median;

/// Gives every view's board the counts and the middle of the whole chart, where names or the other
/// views tell them.
pub(super) fn complete(views: &mut [View], data: &Dataset, frame: &Frame) {
    let number = |row: usize| data.correspondences[row].id.as_ref()?.parse::<i64>().ok();
    let numbers: Vec<i64> =
        views.iter().flat_map(|view| view.rows.iter().filter_map(|row| number(*row))).collect();
    let (first, last) = (numbers.iter().min().copied(), numbers.iter().max().copied());
    let total: usize = views.iter().map(|view| view.rows.len()).sum();
    if let (Some(first), Some(last), true) = (first, last, numbers.len() == total) {
        for view in views.iter_mut() {
            let named: Vec<(i64, Point3)> = view
                .rows
                .iter()
                .filter_map(|row| {
                    let place = data.correspondences[*row].world?;
                    Some((number(*row)? - first, frame.scaled(place)))
                })
                .collect();
            if let Some(whole) =
                view.board.as_ref().and_then(|b| by_number(b, &named, last - first))
            {
                view.board = Some(whole);
            }
        }
    } else {
        by_union(views);
    }
}

/// Numbers run along rows: then their steps tell how long a row is, and the last how many there are.
fn by_number(board: &Board, named: &[(i64, Point3)], last: i64) -> Option<Board> {
    let label = |place: &Point3| {
        [0, 1].map(|axis| {
            let half = (board.counts[axis] as f64 - 1.0) / 2.0;
            ((place - board.centre).dot(&board.along[axis]) / board.pitch[axis] + half).round()
                as i64
        })
    };
    let labels: Vec<([i64; 2], i64)> =
        named.iter().map(|(number, place)| (label(place), *number)).collect();
    let step = |axis: usize| {
        let mut found = Vec::new();
        for (own, number) in &labels {
            let mut next = *own;
            next[axis] += 1;
            if let Some((_, other)) = labels.iter().find(|(label, _)| *label == next) {
                found.push((other - number) as f64);
            }
        }
        (!found.is_empty()).then(|| median(&found).round() as i64)
    };
    let steps = [step(0)?, step(1)?];
    // Which axis do rows run along?
    let (within, across) = if steps[0].abs() == 1 { (0, 1) } else { (1, 0) };
    let columns = steps[across].abs();
    if steps[within].abs() != 1 || columns < 2 {
        return None;
    }
    let ([own_a, own_b], number) = labels.first().copied()?;
    let fits = |([a, b], other): &([i64; 2], i64)| {
        *other == number + steps[0] * (a - own_a) + steps[1] * (b - own_b)
    };
    if 10 * labels.iter().filter(|l| fits(l)).count() < 9 * labels.len() {
        return None;
    }
    let rows = last / columns + 1;
    let mut whole = board.clone();
    whole.counts[within] = usize::try_from(columns).ok()?;
    whole.counts[across] = usize::try_from(rows).ok()?;
    // Where this point is in the whole lattice, counted along the board's axes.
    let along = |axis: usize, index: i64, count: i64| {
        if steps[axis] > 0 { index } else { count - 1 - index }
    };
    let mut index = [0; 2];
    index[within] = along(within, number % columns, columns);
    index[across] = along(across, number / columns, rows);
    let place = named.first()?.1;
    let own = label(&place);
    for axis in 0..2 {
        // Lattice places in steps from the view's own first label.
        let middle =
            (whole.counts[axis] as f64 - 1.0) / 2.0 - index[axis] as f64 + own[axis] as f64;
        let half = (board.counts[axis] as f64 - 1.0) / 2.0;
        whole.centre += board.along[axis] * ((middle - half) * board.pitch[axis]);
    }
    Some(whole)
}

/// A stage moves a chart along a line: all views together show where it ends.
fn by_union(views: &mut [View]) {
    let boards: Vec<&Board> = views.iter().filter_map(|view| view.board.as_ref()).collect();
    let Some(largest) = boards.iter().max_by_key(|b| b.counts[0] * b.counts[1]).copied().cloned()
    else {
        return;
    };
    let alike = |board: &Board| {
        (0..2).all(|axis| {
            let offset = (board.centre - largest.centre).dot(&largest.along[axis])
                / largest.pitch[axis]
                + (board.counts[axis] as f64 - largest.counts[axis] as f64) / 2.0;
            (board.along[axis] - largest.along[axis]).norm() < 1e-3
                && (board.pitch[axis] / largest.pitch[axis] - 1.0).abs() < 1e-3
                && (offset - offset.round()).abs() < 0.05
        })
    };
    let ends = |axis: usize| {
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for board in views.iter().filter_map(|view| view.board.as_ref()).filter(|b| alike(b)) {
            let middle = board.centre.coords.dot(&largest.along[axis]);
            let half = (board.counts[axis] as f64 - 1.0) / 2.0 * board.pitch[axis];
            ends = [ends[0].min(middle - half), ends[1].max(middle + half)];
        }
        ends
    };
    let both = [ends(0), ends(1)];
    for board in views.iter_mut().filter_map(|view| view.board.as_mut()).filter(|b| alike(b)) {
        for (axis, [low, high]) in both.into_iter().enumerate() {
            let middle = board.centre.coords.dot(&largest.along[axis]);
            board.centre += largest.along[axis] * ((low + high) / 2.0 - middle);
            board.counts[axis] = ((high - low) / largest.pitch[axis]).round() as usize + 1;
        }
    }
}
