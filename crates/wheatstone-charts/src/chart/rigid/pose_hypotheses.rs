//! The ways in which patches of marks can lie on patches of a body, and the rough camera that follows from
//! each.

use super::{body::Patch, matching::Search, view::View};
use rayon::prelude::*;
use std::collections::BTreeMap;
use wheatstone_core::geometry::{Homography, Pixel, Point3};

/// Labels that are compared in all, as the product of the patches' sizes: a third of a second.
const MOST_LOOKED_UP: usize = 8_000_000;
/// Ways to lay a patch onto another that are looked at in all.
const MOST_WAYS: usize = 600;
/// Points that are looked at to compare cameras.
const LOOKED_AT: usize = 60;
/// Share of labels that must agree.
const LEAST_OVERLAP: f64 = 0.6;

/// A way to lay the body into the picture.
pub(super) struct PoseHypothesis {
    pub(super) score: (usize, f64),
    pub(super) view: View,
    pub(super) pairs: BTreeMap<usize, usize>,
}

/// A patch of marks on a patch of the body: how many labels agree, which patches, how turned, how moved.
struct Laid {
    agreeing: usize,
    marks: usize,
    face: usize,
    turn: usize,
    offset: (i32, i32),
}

/// Every way to lay patches of marks onto patches of the body, of those in which most labels agree.
pub(super) fn ways(search: &Search, patches: &[Patch]) -> Vec<PoseHypothesis> {
    let mut laid: Vec<Laid> = Vec::new();
    let mut looked_up = 0;
    for (marks, labels) in patches.iter().enumerate() {
        // More marks on one lattice than the body has: a texture.
        if 2 * labels.len() > 3 * search.body.points.len() {
            continue;
        }
        for (face, patch) in search.body.patches.iter().enumerate() {
            for turn in 0..8 {
                looked_up += labels.len() * patch.len();
                if looked_up > MOST_LOOKED_UP {
                    break;
                }
                let offsets = offsets(&turned(labels, turn), patch).into_iter();
                laid.extend(offsets.map(|(agreeing, offset)| Laid {
                    agreeing,
                    marks,
                    face,
                    turn,
                    offset,
                }));
            }
        }
    }
    laid.sort_by_key(|laid| std::cmp::Reverse(laid.agreeing));
    laid.truncate(MOST_WAYS);
    let ways = laid.par_iter().filter_map(|laid| {
        let labels = turned(&patches[laid.marks], laid.turn);
        way(search, &labels, &search.body.patches[laid.face], laid.offset)
    });
    ways.collect()
}

/// One of the eight ways in which labels can go.
fn turned(labels: &Patch, turn: usize) -> Patch {
    let new = |(x, y): (i32, i32)| {
        let (x, y) = if turn & 1 == 1 { (y, x) } else { (x, y) };
        (if turn & 2 == 2 { -x } else { x }, if turn & 4 == 4 { -y } else { y })
    };
    labels.iter().map(|(label, mark)| (new(*label), *mark)).collect()
}

/// Lowest and highest labels.
fn bounds(patch: &Patch) -> ((i32, i32), (i32, i32)) {
    let columns = || patch.keys().map(|label| label.0);
    let rows = || patch.keys().map(|label| label.1);
    (
        (columns().min().unwrap_or(0), columns().max().unwrap_or(0)),
        (rows().min().unwrap_or(0), rows().max().unwrap_or(0)),
    )
}

/// What to add to the marks' labels so that most of them, or of the body's, agree.
fn offsets(marks: &Patch, patch: &Patch) -> Vec<(usize, (i32, i32))> {
    let ((left, right), (top, bottom)) = bounds(marks);
    let ((first, last), (upper, lower)) = bounds(patch);
    let needed = LEAST_OVERLAP * marks.len().min(patch.len()) as f64;
    // A map would be asked millions of times.
    let (wide, high) = (last - first + 1, lower - upper + 1);
    let mut filled = vec![false; (wide * high) as usize];
    for (column, row) in patch.keys() {
        filled[((row - upper) * wide + column - first) as usize] = true;
    }
    let has = |column: i32, row: i32| {
        let (column, row) = (column - first, row - upper);
        (0..wide).contains(&column)
            && (0..high).contains(&row)
            && filled[(row * wide + column) as usize]
    };
    let marks: Vec<(i32, i32)> = marks.keys().copied().collect();
    let mut kept: Vec<(usize, (i32, i32))> = Vec::new();
    for x in first - right..=last - left {
        for y in upper - bottom..=lower - top {
            let across = (right + x).min(last) - (left + x).max(first) + 1;
            let down = (bottom + y).min(lower) - (top + y).max(upper) + 1;
            if f64::from(across * down) < needed {
                continue;
            }
            let both = marks.iter().filter(|(c, r)| has(c + x, r + y)).count();
            if both as f64 >= needed {
                kept.push((both, (x, y)));
            }
        }
    }
    kept
}

/// The camera that lays these marks onto this patch, and how many of the body's points it finds marks for.
fn way(
    search: &Search,
    marks: &Patch,
    patch: &Patch,
    (x, y): (i32, i32),
) -> Option<PoseHypothesis> {
    let pairs: BTreeMap<usize, usize> = marks
        .iter()
        .filter_map(|((c, r), mark)| Some((*patch.get(&(c + x, r + y))?, *mark)))
        .collect();
    // A quarter of a hundred tells as much as all.
    let few: BTreeMap<usize, usize> =
        pairs.iter().step_by((pairs.len() / 25).max(1)).map(|(id, mark)| (*id, *mark)).collect();
    let few = search.pairs(&few);
    if search.body.flat && is_mirrored(&few) {
        return None;
    }
    let every = (search.body.points.len() / LOOKED_AT).max(1);
    let mut views = View::of_plane(&few, search.frame.0, search.frame.1);
    if few.len() >= 12 {
        views.extend(View::fit(&few, search.frame.0, search.frame.1));
    }
    let scored = views.into_iter().filter(View::is_right_handed).map(|view| {
        let score = search.score(&view, every);
        PoseHypothesis { score, view, pairs: BTreeMap::new() }
    });
    let best =
        scored.max_by(|a, b| a.score.0.cmp(&b.score.0).then(b.score.1.total_cmp(&a.score.1)))?;
    Some(PoseHypothesis { pairs, ..best })
}

/// Whether a flat body is seen from behind.
fn is_mirrored(pairs: &[(Point3, Pixel)]) -> bool {
    let flat: Vec<(Pixel, Pixel)> =
        pairs.iter().map(|(point, pixel)| (point.xy(), *pixel)).collect();
    Homography::fit(&flat).is_none_or(|map| map.0.determinant() * map.0[(2, 2)] < 0.0)
}
