//! A camera that stands elsewhere from a view on; and a single picture that was taken while the chart
//! stood elsewhere.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Freedom, Proposal, Severity},
    robust_camera::{Pair, RobustCamera},
    unsynchronised,
};

pub(super) struct CameraMoved;

/// How far above the good level a cell must be before a free pose may explain it: a pose also takes up
/// part of what lenses and stages do.
const CLEARLY: f64 = 3.0;

impl Fault for CameraMoved {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for camera in 0..evidence.data.cameras {
            found.extend(segment(evidence, camera));
            for view in 0..evidence.views.len() {
                found.extend(single(evidence, (view, camera)));
            }
        }
        found
    }
}

/// Suspicious views at one end of the list, two or more.
fn segment(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    let views: Vec<usize> =
        (0..evidence.views.len()).filter(|view| evidence.at(*view, camera).is_some()).collect();
    let suspicious = |view: &usize| evidence.cells[*view][camera].suspicious;
    let head = views.iter().take_while(|view| suspicious(view)).count();
    let tail = views.iter().rev().take_while(|view| suspicious(view)).count();
    let (first, moved) = if tail >= head {
        (views.len() - tail, &views[views.len() - tail..])
    } else {
        (head, &views[..head])
    };
    if moved.len() < 2 || moved.len() == views.len() {
        return None;
    }
    let pairs: Vec<Pair> =
        moved.iter().flat_map(|view| evidence.cells[*view][camera].pairs.iter().copied()).collect();
    let thin: Vec<Pair> = pairs.iter().step_by(pairs.len().div_ceil(200)).copied().collect();
    let there: RobustCamera = seen.camera.moved(&thin, 20);
    let left = moved
        .iter()
        .map(|view| there.median_error(&evidence.cells[*view][camera].pairs) / seen.good())
        .fold(0.0, f64::max);
    let before = moved.iter().map(|view| evidence.excess((*view, camera))).fold(0.0, f64::max);
    // The lens was fitted without these views: they may use other parts of it.
    if left > 1.5 || left > 0.4 * before || before < CLEARLY {
        return None;
    }
    let distance = (there.centre() - seen.camera.centre()).norm() * evidence.frame.size;
    let turn = there.rotation * seen.camera.rotation.transpose();
    let angle = libm::acos(((turn.trace() - 1.0) / 2.0).clamp(-1.0, 1.0)).to_degrees();
    let at = &evidence.views[views[first]].name;
    let cells: Vec<(usize, usize)> = views[first..].iter().map(|view| (*view, camera)).collect();
    Some(Proposal {
        freedom: Freedom::Pose,
        left: left.min(1.0),
        // Named by the views after the move; which part is the wrong one is the user's choice.
        cells,
        key: "segment".into(),
        code: "camera-moved",
        severity: Severity::Fatal,
        what: format!(
            "the camera stands elsewhere from view `{at}` on: moved by {distance:.3} {}, turned by {angle:.3} degrees",
            evidence.data.unit
        ),
        hint: format!(
            "fix the camera's mount and record again, or use only the views before `{at}`, or only those from it on"
        ),
        figures: vec![
            (format!("moved, {}", evidence.data.unit), distance),
            ("turned, degrees".into(), angle),
        ],
        changes: Vec::new(),
    })
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
    let what = "the picture shows the chart at another place than the other cameras saw it: taken at another instant, or the camera was knocked".to_owned();
    Some(unsynchronised::proposal(evidence, &[cell], (left, Freedom::Pose), "alone".into(), what))
}
