//! Points that are said to lie so far away that no camera can tell where it would see them.
//!
//! A camera fitted to the other points predicts their pixels within nothing: it may accuse none of them. But two
//! pixels determine a place: points whose pixels are neighbours in all cameras are neighbours in the world.

use crate::{
    dataset::Dataset,
    geometry::{Pixel, Point3},
};
use std::collections::BTreeSet;

/// Neighbours in the pixels of all cameras that a place is compared with.
const NEIGHBOURS: usize = 8;

/// A place is wrong if it is farther from that of the nearest neighbour by so many times than the others are. Points whose
/// pixels are neighbours may lie in charts one behind the other, several pitches apart; nearer faults are left to the
/// cameras.
const TIMES: f64 = 5.0;

/// The same for a place that a camera accuses already: the question is only whether the others have bent themselves to it.
const TIMES_ACCUSED: f64 = 2.0;

/// The rows that lie elsewhere than their pixels' neighbours, among those that cameras accuse and those that a camera is
/// `unsure` of. One camera may accuse a row, and another have bent itself to a point that stands alone at its edge.
pub(super) fn misplaced(
    data: &Dataset,
    accused: &BTreeSet<usize>,
    unsure: &BTreeSet<usize>,
) -> BTreeSet<usize> {
    let is_sound = |row: &usize| !accused.contains(row) && !unsure.contains(row);
    let sound: Vec<usize> = (0..data.correspondences.len()).filter(is_sound).collect();
    let times = |row: &usize| if accused.contains(row) { TIMES_ACCUSED } else { TIMES };
    let suspects = accused.union(unsure).copied();
    suspects.filter(|row| is_misplaced(data, *row, &sound, times(row))).collect()
}

fn is_misplaced(data: &Dataset, row: usize, sound: &[usize], times: f64) -> bool {
    let own = &data.correspondences[row];
    let Some(place) = own.world.filter(|_| own.seen_by() >= 2) else { return false };
    let mut near: Vec<(f64, &[Option<Pixel>], Point3)> = sound
        .iter()
        .filter_map(|other| {
            let other = &data.correspondences[*other];
            Some((apart(&own.pixels, &other.pixels)?, &*other.pixels, other.world?))
        })
        .collect();
    if near.len() < NEIGHBOURS {
        return false;
    }
    near.select_nth_unstable_by(NEIGHBOURS - 1, |a, b| a.0.total_cmp(&b.0));
    near.truncate(NEIGHBOURS);
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (nearest, pixels, middle) = near[0];
    let reach = near.iter().filter_map(|other| apart(pixels, other.1)).fold(0.0, f64::max);
    let spread = near.iter().map(|other| (other.2 - middle).norm()).fold(0.0, f64::max);
    // Beyond its neighbours it is extrapolated, and may be anywhere.
    nearest < reach && (place - middle).norm() > times * spread
}

/// How far pixels are from others in all cameras that saw the first; `None` where one did not see the others.
fn apart(own: &[Option<Pixel>], other: &[Option<Pixel>]) -> Option<f64> {
    let mut square = 0.0;
    for (own, other) in own.iter().zip(other) {
        if let Some(own) = own {
            square += (own - (*other)?).norm_squared();
        }
    }
    Some(square.sqrt())
}
