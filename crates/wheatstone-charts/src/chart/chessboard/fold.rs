//! Boards that meet at an edge, as two walls of a corner do, and grow into one lattice: cut where it is bent. Boards
//! are cut between squares, so that the lattice goes on over the edge only where that is a line of it.

use super::seed::Labels;
use nalgebra::Vector2;
use wheatstone_numeric::statistics::median;

/// Jump of the lattice's second difference at a line, in steps, from which on the line may be a fold: two
/// photographed walls at a right angle have 0.44 to 0.51, flat boards up to 0.02, and 0.12 at the rim of a
/// full-circle fisheye.
const LEAST_JUMP: f64 = 0.15;
/// The same, in those of the lines elsewhere: lenses, tilt and wavy paper bend edges everywhere.
const MOST_SMOOTH: f64 = 4.0;
/// Places of a line that must tell of a fold.
const LEAST_TELLING: usize = 3;
/// Lines of a part: fewer are what grew over a board's edge.
const LEAST_LINES: i32 = 2;

/// The flat parts of a lattice, the largest first. Corners on a fold belong to none: their squares lie on two
/// planes, and no saddle is where these meet.
pub(in crate::chart) fn parts(labels: Labels) -> Vec<Labels> {
    let mut whole = vec![labels];
    let mut flat: Vec<Labels> = Vec::new();
    while let Some(part) = whole.pop() {
        match [true, false].into_iter().find_map(|columns| cut(&part, columns)) {
            Some(both) => whole.extend(both),
            None => flat.push(part),
        }
    }
    flat.sort_by_key(|part| std::cmp::Reverse(part.len()));
    flat
}

/// The two sides of the sharpest fold along the columns, or the rows, if there is one.
fn cut(labels: &Labels, columns: bool) -> Option<[Labels; 2]> {
    let number = |label: &(i32, i32)| if columns { label.0 } else { label.1 };
    let (first, last) = (labels.keys().map(number).min()?, labels.keys().map(number).max()?);
    let jumps: Vec<(i32, f64)> =
        (first..=last).filter_map(|line| Some((line, jump(labels, columns, line)?))).collect();
    let (fold, most) = *jumps.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    // It shows half as much in the lines beside it.
    let elsewhere: Vec<f64> =
        jumps.iter().filter(|(line, _)| (line - fold).abs() > 1).map(|(_, jump)| *jump).collect();
    if most < LEAST_JUMP || elsewhere.len() < 2 || most < MOST_SMOOTH * median(&elsewhere) {
        return None;
    }
    if fold - first < LEAST_LINES || last - fold < LEAST_LINES {
        return None;
    }
    let side = |keep: &dyn Fn(i32) -> bool| -> Labels {
        labels.iter().filter(|(label, _)| keep(number(label))).map(|(l, at)| (*l, *at)).collect()
    };
    Some([side(&|line| line < fold), side(&|line| line > fold)])
}

/// By how much the second difference across a line is not what those beside it make expect, in steps; the
/// middle of the line's places.
fn jump(labels: &Labels, columns: bool, line: i32) -> Option<f64> {
    let curvature = |label: (i32, i32), along: i32| -> Option<(Vector2<f64>, f64)> {
        let at = |steps: i32| {
            let steps = steps + along;
            let place =
                if columns { (label.0 + steps, label.1) } else { (label.0, label.1 + steps) };
            labels.get(&place).map(|at| at.coords)
        };
        let (before, here, after) = (at(-1)?, at(0)?, at(1)?);
        Some((after - 2.0 * here + before, (after - before).norm() / 2.0))
    };
    let on = |label: &&(i32, i32)| line == if columns { label.0 } else { label.1 };
    let told: Vec<f64> = labels
        .keys()
        .filter(on)
        .filter_map(|label| {
            let (own, step) = curvature(*label, 0)?;
            let around = (curvature(*label, -1)?.0 + curvature(*label, 1)?.0) / 2.0;
            Some((own - around).norm() / step)
        })
        .collect();
    (told.len() >= LEAST_TELLING).then(|| median(&told))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wheatstone_core::geometry::Pixel;

    /// Two walls that come towards the camera from an edge at column `fold`, under a strong barrel lens.
    fn walls(fold: f64) -> Labels {
        let mut labels = Labels::new();
        for column in 0..14 {
            for row in 0..8 {
                let (along, down) = (f64::from(column) - fold, f64::from(row) - 2.2);
                let (x, z) = (along * libm::cos(0.7), 12.0 - along.abs() * libm::sin(0.7));
                let (x, y) = (x / z, down / z);
                let curvature = 400.0 / (1.0 + 0.3 * (x * x + y * y));
                labels.insert(
                    (column, row),
                    Pixel::new(500.0 + curvature * x, 400.0 + curvature * y),
                );
            }
        }
        labels
    }

    #[test]
    fn walls_are_parted_at_their_edge_and_boards_are_not() {
        let columns = |part: &Labels| {
            let all = part.keys().map(|label| label.0);
            (all.clone().min().unwrap(), all.max().unwrap())
        };
        // Corners on the edge belong to neither.
        let cut = |walls: Labels| parts(walls).iter().map(columns).collect::<Vec<_>>();
        assert_eq!(cut(walls(8.0)), [(0, 7), (9, 13)]);
        assert_eq!(cut(walls(5.0)), [(6, 13), (0, 4)]);
        // Straight on, there is a tilted board.
        let board = walls(20.0);
        assert_eq!(parts(board.clone()), [board]);
    }
}
