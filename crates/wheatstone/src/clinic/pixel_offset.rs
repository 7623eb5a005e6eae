//! Pixels of a camera counted from another place in some views: from 1, or from a pixel's corner.
//!
//! So small an error hides in the fit, and bends it so that sound views look off as well. So all sets
//! of views are tried: with the fit's normal equations each costs a few products.

use super::{
    Fault,
    evidence::Evidence,
    finding::Proposal,
    pixel_units::{Measure, proposal},
    robust_camera::{Pair, Sums},
};
use nalgebra::{Matrix2, SMatrix, Vector2};

pub(super) struct PixelOffset;

impl Fault for PixelOffset {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        (0..evidence.data.cameras).flat_map(|camera| offset(evidence, camera)).collect()
    }
}

/// Pixels beyond which an error is no matter of how pixels are counted.
const GREAT: f64 = 4.0;

/// Points of a cell that are used.
const USED: usize = 80;

/// More views than this are more sets than can be tried one by one; then runs of views and single
/// ones are.
const MOST_VIEWS: usize = 12;

/// The sets of views that may be off: fewer than half of them.
fn sets(count: usize) -> Vec<Vec<usize>> {
    if count <= MOST_VIEWS {
        return (1..1_usize << count)
            .filter(|set| 2 * (set.count_ones() as usize) < count)
            .map(|set| (0..count).filter(|view| set >> view & 1 == 1).collect())
            .collect();
    }
    let runs =
        (0..count).flat_map(|first| (first..count).map(move |last| (first..=last).collect()));
    runs.filter(|run: &Vec<usize>| 2 * run.len() < count).collect()
}

/// The points of a camera by view, of the views that it saw.
fn used(evidence: &Evidence, camera: usize) -> Vec<Vec<Pair>> {
    let views = (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some());
    views
        .map(|view| {
            let pairs = &evidence.cells[view][camera].pairs;
            pairs.iter().step_by(pairs.len().div_ceil(USED).max(1)).copied().collect()
        })
        .collect()
}

fn offset(evidence: &Evidence, camera: usize) -> Vec<Proposal> {
    let Some(seen) = &evidence.seen[camera] else { return Vec::new() };
    let views: Vec<usize> =
        (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
    // Beside a great fault a small one does not show.
    if views.len() < 4 || views.iter().any(|view| evidence.cells[*view][camera].error > GREAT) {
        return Vec::new();
    }
    let pairs = used(evidence, camera);
    let sums = Sums::of(&seen.camera, &pairs);
    let Some((set, by)) = best(&sums, views.len()) else { return Vec::new() };
    let meant = by.map(|o| (o * 2.0).round() / 2.0);
    let known = meant[0] == meant[1] && [0.5, 1.0].contains(&meant[0].abs());
    // Offsets of a set are known to a few hundredths of a pixel with whole-pixel noise.
    let near = (by - meant).amax() < 0.17;
    if !known || !near || unexplained(&sums, &set, by) > 0.2 * by.norm() {
        return Vec::new();
    }
    // Where a stage errs, views are off in every camera.
    let others = (0..evidence.data.cameras).filter(|other| *other != camera);
    let most = others.filter_map(|other| {
        let seen = evidence.seen[other].as_ref()?;
        Some(unexplained(&Sums::of(&seen.camera, &used(evidence, other)), &[], Vector2::zeros()))
    });
    if most.fold(0.0, f64::max) > 0.25 * by.norm() {
        return Vec::new();
    }
    let from = if meant[0].abs() == 1.0 {
        "counted from 1 instead of 0, or the other way round"
    } else {
        "counted from the corner of the first pixel instead of its centre, or the other way round"
    };
    let what = format!("pixels are {} px off in x and y: {from}", meant[0]);
    let undo = Measure { scale: [1.0; 2], offset: meant.into(), exchanged: false };
    let figures = vec![("offset of x, px".into(), by.x), ("offset of y, px".into(), by.y)];
    set.iter()
        .map(|index| {
            let cell = (views[*index], camera);
            proposal(evidence, cell, ("pixel-offset", what.clone()), (0.5, undo), figures.clone())
        })
        .collect()
}

/// What an offset of some views takes away from the sum of squares (over the noise), and the offset.
fn gain(sums: &Sums, set: &[usize]) -> Option<(f64, Vector2<f64>)> {
    let mut slopes = SMatrix::<f64, 14, 2>::zeros();
    let (mut weight, mut errors) = (0.0, Vector2::zeros());
    for view in set {
        slopes += sums.slopes[*view];
        weight += sums.weights[*view];
        errors += sums.errors[*view];
    }
    let carried = sums.inverse * slopes;
    let matrix = Matrix2::identity() * weight - slopes.transpose() * carried;
    let right = errors - carried.transpose() * sums.gradient;
    let by = matrix.try_inverse()? * right;
    Some((by.dot(&right), by))
}

/// The set that gains most for its size, and its offset.
fn best(sums: &Sums, count: usize) -> Option<(Vec<usize>, Vector2<f64>)> {
    let mut best: Option<(f64, Vec<usize>, Vector2<f64>)> = None;
    for set in sets(count) {
        let Some((gain, by)) = gain(sums, &set) else { continue };
        // A view more must gain what chance would give it many times over.
        let worth = gain - 5.0 * set.len() as f64;
        if worth > best.as_ref().map_or(12.0, |(most, ..)| *most) {
            best = Some((worth, set, by));
        }
    }
    best.map(|(_, set, by)| (set, by))
}

/// How far views are off as wholes after an offset of some is taken away, in pixels: root mean square.
/// A stage's or a lens's errors leave about as much as they give.
fn unexplained(sums: &Sums, set: &[usize], by: Vector2<f64>) -> f64 {
    let mut gradient = sums.gradient;
    for view in set {
        gradient -= sums.slopes[*view] * by;
    }
    let step = sums.inverse * gradient;
    let mut squares = 0.0;
    for view in 0..sums.errors.len() {
        let mut left = sums.errors[view] - sums.slopes[view].transpose() * step;
        if set.contains(&view) {
            left -= by * sums.weights[view];
        }
        squares += (left / sums.weights[view].max(1e-12)).norm_squared();
    }
    (squares / sums.errors.len().max(1) as f64).sqrt()
}
