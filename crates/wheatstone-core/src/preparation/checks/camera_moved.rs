//! A camera that stands elsewhere from a view on; and a single picture that was taken while the chart
//! stood elsewhere.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Freedom, Proposal, Severity},
    pairs::Pair,
    robust_camera::RobustCamera,
    unsynchronised,
};
use wheatstone_numeric::statistics::mean;

pub(super) struct CameraMoved;

/// How far above the good level a cell must be before a free pose may explain it: a pose also takes up
/// part of what lenses and stages do.
const CLEARLY: f64 = 3.0;

/// Points of a cell that are used: more take time only.
const USED: usize = 14;

impl Fault for CameraMoved {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for camera in 0..evidence.data.cameras {
            if let Some(moved) = from_a_view_on(evidence, camera) {
                found.push(moved);
                continue;
            }
            for view in 0..evidence.views.len() {
                found.extend(single(evidence, (view, camera)));
            }
        }
        found
    }
}

/// A camera with one lens and two places, and how well it does.
struct Halves {
    /// Mean over the views of the median error.
    error: f64,
    before: RobustCamera,
    after: RobustCamera,
}

/// One lens, one place for the views before `at` and one for those from it on.
fn halves(start: &RobustCamera, views: &[Vec<Pair>], at: usize, thorough: bool) -> Halves {
    let join = |part: &[Vec<Pair>]| -> Vec<Pair> { part.iter().flatten().copied().collect() };
    let (first, second) = (join(&views[..at]), join(&views[at..]));
    let lens = start.without_field();
    // The lens is told best by the part with more views.
    let lens = match (thorough, 2 * at >= views.len()) {
        (false, _) => lens,
        (true, true) => lens.refined(&first, 12),
        (true, false) => lens.refined(&second, 12),
    };
    let steps = if thorough { 20 } else { 4 };
    let (before, after) = (lens.moved(&first, steps), lens.moved(&second, steps));
    let errors: Vec<f64> = views
        .iter()
        .enumerate()
        .map(
            |(view, pairs)| {
                if view < at { before.median_error(pairs) } else { after.median_error(pairs) }
            },
        )
        .collect();
    Halves { error: mean(&errors), before, after }
}

/// Where views are best parted in two: the place with the least error. Of many places some are tried
/// first, then those about the best of them: the error rises with the distance from where a camera moved.
fn parting(views: usize, error: impl Fn(usize) -> f64) -> Option<usize> {
    const TRIED: usize = 12;
    // Both parts need two views, or anything could be a move.
    let places = 2..views.saturating_sub(1);
    let step = places.len().div_ceil(TRIED).max(1);
    let best = |places: &mut dyn Iterator<Item = usize>| {
        places.map(|at| (at, error(at))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
    };
    let coarse = best(&mut places.clone().step_by(step))?;
    let near = places.filter(|at| at.abs_diff(coarse) < step);
    if step == 1 { Some(coarse) } else { best(&mut { near }) }
}

fn from_a_view_on(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    let views: Vec<usize> =
        (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
    if views.len() < 4 {
        return None;
    }
    let pairs: Vec<Vec<Pair>> = views
        .iter()
        .map(|view| {
            let pairs = &evidence.cells[*view][camera].pairs;
            pairs.iter().step_by(pairs.len().div_ceil(USED).max(1)).copied().collect()
        })
        .collect();
    let all: Vec<Pair> = pairs.iter().flatten().copied().collect();
    let one = seen.camera.without_field().refined(&all, 8);
    let whole = mean(&pairs.iter().map(|view| one.median_error(view)).collect::<Vec<_>>());
    let error = |at: usize| {
        let both = [&seen.camera, &one].map(|start| halves(start, &pairs, at, false).error);
        both[0].min(both[1])
    };
    let at = parting(views.len(), error)?;
    let found = [&seen.camera, &one]
        .map(|start| halves(start, &pairs, at, true))
        .into_iter()
        .min_by(|a, b| a.error.total_cmp(&b.error))?;
    let sound = whole.min(evidence.mean_error(camera));
    if found.error > 0.45 * sound || !alone(evidence, camera, (sound, found.error)) {
        return None;
    }
    Some(proposal(evidence, (camera, &views, at), (whole, &found)))
}

/// Whether the camera errs clearly more than every other, and is about as good as they are once it may
/// move. Where charts stand off their places all cameras err alike, and two places of a camera take up
/// part of that.
fn alone(evidence: &Evidence, camera: usize, (whole, error): (f64, f64)) -> bool {
    let others = evidence.seen.iter().enumerate().filter(|(other, _)| *other != camera);
    let known: Vec<(usize, f64)> =
        others.filter_map(|(other, seen)| Some((other, seen.as_ref()?.typical))).collect();
    let most = known.iter().map(|(_, typical)| *typical).fold(0.0, f64::max);
    let mean = known.iter().map(|(other, _)| evidence.mean_error(*other)).fold(0.0, f64::max);
    // Two places take up a part of what stages and lenses do, but leave the rest: only where nearly all is
    // gone may something be left.
    let left = if error < 0.35 * whole { 3.0 } else { 1.3 };
    (whole > 1.6 * most || evidence.mean_error(camera) > 1.6 * mean)
        && error <= left * most.max(0.05)
}

fn proposal(
    evidence: &Evidence,
    (camera, views, at): (usize, &[usize], usize),
    (whole, found): (f64, &Halves),
) -> Proposal {
    let distance = (found.after.centre() - found.before.centre()).norm() * evidence.frame.size;
    let turn = found.after.rotation() * found.before.rotation().transpose();
    let angle = libm::acos(((turn.trace() - 1.0) / 2.0).clamp(-1.0, 1.0)).to_degrees();
    let name = &evidence.views[views[at]].name;
    let mut figures = unsynchronised::overall_figures(whole, found.error);
    figures.push((format!("moved, {}", evidence.data.unit), distance));
    figures.push(("turned, degrees".into(), angle));
    Proposal {
        freedom: Freedom::Scale,
        // Simpler explanations of slight errors come first.
        left: 0.9,
        cells: views[at..].iter().map(|view| (*view, camera)).collect(),
        also: views.iter().map(|view| (*view, camera)).collect(),
        key: "segment".into(),
        code: "camera-moved",
        severity: Severity::Fatal,
        what: format!(
            "the camera moved before view `{name}`: by {distance:.3} {}, rotated by {angle:.3} degrees",
            evidence.data.unit
        ),
        hint: format!(
            "fix the camera's mount and record again, or use only the views before `{name}`, or only those from it on"
        ),
        figures,
        changes: Vec::new(),
    }
}

/// One picture that fits from another place, while the other cameras' pictures of the view fit.
fn single(evidence: &Evidence, cell: (usize, usize)) -> Option<Proposal> {
    let (view, camera) = cell;
    let (points, seen, other) = evidence.at(view, camera)?;
    if evidence.suspects(view) != [camera] || evidence.excess(cell) < CLEARLY {
        return None;
    }
    let there = other.moved(&points.pairs, 20);
    let left = there.median_error(&points.pairs) / seen.good();
    if left > 1.0 || left > 0.3 * evidence.excess(cell) {
        return None;
    }
    let what = "the picture shows the chart at another pose than the other cameras do: it was taken at another instant, or the camera was moved".to_owned();
    Some(unsynchronised::proposal(
        evidence,
        &[cell],
        (left, Freedom::Pose),
        format!("alone {view}"),
        what,
    ))
}
