//! Pixels of a camera counted from another place in some views: from 1, or from a pixel's corner.
//!
//! So small an error hides in the fit, and bends it so that sound views look off as well. So all sets
//! of views are tried: with the fit's normal equations each costs a few products.

use super::{
    Fault,
    evidence::{Evidence, OF_ONE},
    finding::{Proposal, Severity},
    pairs::Pair,
    pixel_units::{Measure, proposal},
    sums::{Sums, Total},
};
use nalgebra::Vector2;

pub(super) struct PixelOffset;

impl Fault for PixelOffset {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let found: Vec<Vec<Proposal>> =
            (0..evidence.data.cameras).map(|camera| offset(evidence, camera)).collect();
        // What several cameras say of a view is the chart's doing.
        let views = |camera: usize| found[camera].iter().flat_map(|p| &p.cells).map(|cell| cell.0);
        let shared = |camera: usize| {
            let others = (0..found.len()).filter(|other| *other != camera);
            others.flat_map(views).any(|view| views(camera).any(|own| own == view))
        };
        let alone: Vec<bool> = (0..found.len()).map(|camera| !shared(camera)).collect();
        if found.iter().all(Vec::is_empty) {
            return of_all_cameras(evidence);
        }
        found.into_iter().zip(alone).filter(|(_, alone)| *alone).flat_map(|(own, _)| own).collect()
    }

    fn of_picture(&self, evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
        let by = evidence.cells[picture.0][picture.1].offset;
        let is_near = |meant: &f64| (by - Vector2::repeat(*meant)).amax() < NEAR;
        let Some(meant) = KNOWN.into_iter().find(is_near) else { return Vec::new() };
        let counted = |_, (world, pixel)| Some((world, pixel - Vector2::repeat(meant)));
        if !evidence.accepts(picture, evidence.explained(picture, counted)) {
            return Vec::new();
        }
        of_views(evidence, picture.1, &[picture.0], (meant, by))
    }
}

/// How near to a known offset that of a picture is by the camera of the other views, in pixels.
const NEAR: f64 = 0.2;

/// Pixels beyond which an error is no matter of how pixels are counted.
const GREAT: f64 = 4.0;

/// Points of a cell that are used.
const USED: usize = 80;

/// More views than this are more sets than can be tried one by one; then runs of views and single
/// ones are.
const MOST_VIEWS: usize = 12;

/// Views at which a run may begin, at most: of more views runs begin and end at every so-manieth, and the best one's
/// ends are moved then.
const MOST_BEGINNINGS: usize = 200;

/// Views that may be off together, fewer than half of all, and their sums.
fn each_set(sums: &Sums, count: usize, mut look: impl FnMut(&[usize], &Total)) {
    if count <= MOST_VIEWS {
        for set in 1..1_usize << count {
            let views: Vec<usize> = (0..count).filter(|view| set >> view & 1 == 1).collect();
            if 2 * views.len() < count {
                look(&views, &total(sums, &views));
            }
        }
        return;
    }
    let all: Vec<usize> = (0..count).collect();
    let step = count.div_ceil(MOST_BEGINNINGS);
    for first in 0..count {
        let longest = if first % step == 0 { (count - 1) / 2 } else { 1 };
        let mut total = Total::default();
        for last in first..count.min(first + longest) {
            total.add(sums, (last, 1.0));
            if first == last || (last + 1) % step == 0 {
                look(&all[first..=last], &total);
            }
        }
    }
}

/// Sums over a set of views.
fn total(sums: &Sums, set: &[usize]) -> Total {
    let mut total = Total::default();
    set.iter().for_each(|view| total.add(sums, (*view, 1.0)));
    total
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
    let found = best(&sums, views.len()).filter(|off| is_clear(evidence, camera, &sums, off));
    let found = found.or_else(|| cell_by_cell(evidence, camera, &views));
    found.map_or_else(Vec::new, |Off { set, meant, by }| {
        let set: Vec<usize> = set.iter().map(|index| views[*index]).collect();
        if let [view] = set[..]
            && !is_convincing(evidence, (view, camera), meant)
        {
            return Vec::new();
        }
        of_views(evidence, camera, &set, (meant, by))
    })
}

/// Whether an offset of one picture leaves noise by the camera of the others. Several bend that camera too.
fn is_convincing(evidence: &Evidence, picture: (usize, usize), meant: f64) -> bool {
    evidence.at(picture.0, picture.1).is_some_and(|(cell, _, other)| {
        let counted =
            cell.pairs.iter().map(|(world, pixel)| (*world, pixel - Vector2::repeat(meant)));
        let left = other.median_error(&counted.collect::<Vec<_>>());
        evidence.is_convincing(picture.1, [cell.error, left], OF_ONE)
    })
}

/// Two views or more whose pixels are off by the same in every camera, each by itself too. Charts that stood elsewhere show
/// hardly so, but who knows: it is said, and nothing is corrected.
fn of_all_cameras(evidence: &Evidence) -> Vec<Proposal> {
    let views = 0..evidence.views.len();
    let is_seen_by_all = |view: usize| evidence.present(view).len() == evidence.data.cameras;
    if evidence.data.cameras < 2 || views.len() < 4 || !views.clone().all(is_seen_by_all) {
        return Vec::new();
    }
    let of = |camera: usize| -> Option<Off> {
        let sums = Sums::of(&evidence.seen[camera].as_ref()?.camera, &used(evidence, camera));
        best(&sums, views.len()).filter(|off| {
            let known = Vector2::repeat(off.meant);
            let alone = |view: &usize| (evidence.cells[*view][camera].offset - known).amax();
            (off.by - known).amax() < 0.17 && off.set.iter().all(|view| alone(view) < 0.35)
        })
    };
    let found: Option<Vec<Off>> = (0..evidence.data.cameras).map(of).collect();
    let Some(found) = found.filter(|found| {
        let first = &found[0];
        first.set.len() > 1 && found.iter().all(|o| o.set == first.set && o.meant == first.meant)
    }) else {
        return Vec::new();
    };
    let mut said: Vec<Proposal> = found
        .iter()
        .enumerate()
        .flat_map(|(camera, off)| of_views(evidence, camera, &off.set, (off.meant, off.by)))
        .collect();
    for proposal in &mut said {
        proposal.severity = Severity::Warning;
        proposal.changes.clear();
    }
    said
}

/// Views of a camera whose pixels are off by what is meant, and by as much after the data.
pub(super) fn of_views(
    evidence: &Evidence,
    camera: usize,
    set: &[usize],
    (meant, by): (f64, Vector2<f64>),
) -> Vec<Proposal> {
    let from = if meant.abs() == 1.0 {
        "counted from 1 instead of 0, or the other way round"
    } else {
        "counted from the corner of the first pixel instead of its centre, or the other way round"
    };
    let what = format!("pixels are {meant} px off in x and y: {from}");
    let undo = Measure { scale: [1.0; 2], offset: [meant; 2], exchanged: false };
    let figures = vec![("offset of x, px".into(), by.x), ("offset of y, px".into(), by.y)];
    let of_view = |view: &usize| {
        let how = ("pixel-offset", what.clone());
        proposal(evidence, (*view, camera), how, (0.5, undo), figures.clone())
    };
    set.iter().map(of_view).collect()
}

/// What people's ways of counting differ by, in x and y alike.
pub(super) const KNOWN: [f64; 4] = [0.5, -0.5, 1.0, -1.0];

/// Nobody counts x one way and y the other: what such offsets gain is the lens's or the stage's doing,
/// and tells how much of it to expect.
const NOBODYS: f64 = -1.0;

/// Some views, the offset that people make, the offset by the data.
struct Off {
    set: Vec<usize>,
    meant: f64,
    by: Vector2<f64>,
}

/// What a known offset of some views takes away from the sum of squares (over the noise) at best, and
/// the offset by the data.
/// `along` is what y has of x's: 1, or [`NOBODYS`].
fn gain(sums: &Sums, total: &Total, along: f64) -> Option<(f64, f64, Vector2<f64>)> {
    let (matrix, right) = total.reduced(sums);
    let by = matrix.try_inverse()? * right;
    let of = |meant: f64| {
        let known = Vector2::new(meant, along * meant);
        2.0 * known.dot(&right) - (matrix * known).dot(&known)
    };
    let best = KNOWN.into_iter().max_by(|a, b| of(*a).total_cmp(&of(*b)))?;
    Some((of(best), best, by))
}

/// The set that gains most for its size.
fn best(sums: &Sums, count: usize) -> Option<Off> {
    // Lenses that the formula does not describe gain up to half as much one way as the other.
    const CLEARLY: f64 = 2.0;
    let mut best = Best::default();
    each_set(sums, count, |set, total| {
        best.look(sums, set, total);
    });
    while count > MOST_BEGINNINGS && best.moves_an_end(sums, count) {}
    let Best { found, chance } = best;
    found.filter(|(worth, _)| *worth > CLEARLY * chance).map(|(_, off)| off)
}

/// The best set so far with what it gains, and what sets gain by chance.
#[derive(Default)]
struct Best {
    found: Option<(f64, Off)>,
    chance: f64,
}

impl Best {
    /// Looks at a set; whether it is better than all before.
    fn look(&mut self, sums: &Sums, set: &[usize], total: &Total) -> bool {
        // A view more must gain what chance would give it many times over.
        const OF_A_VIEW: f64 = 5.0;
        // One in a hundred thousand by chance, for as many sets as there are.
        const LEAST_GAIN: f64 = 12.0;
        let price = OF_A_VIEW * set.len() as f64;
        if let Some((gain, ..)) = gain(sums, total, NOBODYS) {
            self.chance = self.chance.max(gain - price);
        }
        let Some((gain, meant, by)) = gain(sums, total, 1.0) else { return false };
        let worth = gain - price;
        let is_better = worth > self.found.as_ref().map_or(LEAST_GAIN, |(most, _)| *most);
        if is_better {
            self.found = Some((worth, Off { set: set.to_vec(), meant, by }));
        }
        is_better
    }

    /// Takes a view in at either end of the best run, or leaves one out, where that is better.
    fn moves_an_end(&mut self, sums: &Sums, count: usize) -> bool {
        let set = self.found.as_ref().map(|(_, off)| &off.set);
        let ends = set.and_then(|set| Some((*set.first()?, *set.last()? + 1)));
        let Some((first, end)) = ends else { return false };
        let moved =
            [(first.saturating_sub(1), end), (first, end + 1), (first + 1, end), (first, end - 1)];
        moved.into_iter().any(|(first, end)| {
            let set: Vec<usize> = (first..end.min(count)).collect();
            !set.is_empty() && 2 * set.len() < count && self.look(sums, &set, &total(sums, &set))
        })
    }
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

/// Whether the data's offset is the known one, and clearly more than what views are off otherwise, in
/// this camera and in the others.
fn is_clear(evidence: &Evidence, camera: usize, sums: &Sums, off: &Off) -> bool {
    let known = Vector2::new(off.meant, off.meant);
    // A lens that the formula does not describe bends the estimate by up to as much.
    if (off.by - known).amax() > 0.17 || unexplained(sums, &off.set, off.by) > 0.2 * known.norm() {
        return false;
    }
    // Each of the views must be off by about as much by itself, by the camera of the others.
    let views: Vec<usize> =
        (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
    let alone = |index: &usize| evidence.cells[views[*index]][camera].offset - known;
    if off.set.iter().any(|index| alone(index).amax() > 0.35) {
        return false;
    }
    // Where a stage errs, views are off in every camera.
    let others = (0..evidence.data.cameras).filter(|other| *other != camera);
    let most = others.filter_map(|other| {
        let seen = evidence.seen[other].as_ref()?;
        Some(unexplained(&Sums::of(&seen.camera, &used(evidence, other)), &[], Vector2::zeros()))
    });
    most.fold(0.0, f64::max) <= 0.25 * known.norm()
}

/// Views that the others already show to be off by a known offset, each for itself, where the view's
/// other cameras and this camera's other views are not.
fn cell_by_cell(evidence: &Evidence, camera: usize, views: &[usize]) -> Option<Off> {
    let stray = evidence.stray(camera);
    let offset = |view: usize, camera: usize| evidence.cells[view][camera].offset;
    KNOWN.into_iter().find_map(|meant| {
        let known = Vector2::new(meant, meant);
        let is_off = |view: usize| {
            let others = evidence.present(view).into_iter().filter(|other| *other != camera);
            evidence.cells[view][camera].suspicious
                && (offset(view, camera) - known).amax() < NEAR
                && others.clone().count() > 0
                && others.clone().all(|other| offset(view, other).norm() < 0.2 * known.norm())
        };
        let set: Vec<usize> = (0..views.len()).filter(|index| is_off(views[*index])).collect();
        let by = set.iter().map(|index| offset(views[*index], camera)).sum::<Vector2<f64>>()
            / set.len().max(1) as f64;
        (!set.is_empty() && 2 * set.len() < views.len() && stray < 0.15 * known.norm())
            .then_some(Off { set, meant, by })
    })
}
