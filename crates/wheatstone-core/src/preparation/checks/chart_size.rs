//! A view whose world places have another size than the others', or stand elsewhere.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
    other_pose::GivenChart,
    stretch::{
        ANY, MOST_LEFT, RIGID, SCALES, SCALES_AND_SHIFT, SHIFT, SIZED, Shots, Stretch, adjusted,
        shots_as_told,
    },
    unit_ratios::{as_ratio, tidy},
};
use crate::geometry::{Point3, Vector3};

pub(super) struct ChartSize;

impl Fault for ChartSize {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for view in 0..evidence.views.len() {
            let (present, suspects) = (evidence.present(view), evidence.suspects(view).len());
            // One camera cannot tell size from distance.
            if suspects == 0 || present.len() < 2 {
                continue;
            }
            if evidence.has_estimated_pose(view) {
                found.extend(size_with_pose(evidence, view, &present));
            } else if suspects == present.len() {
                let sized = size(evidence, view, &present);
                found.extend(sized.or_else(|| slightly_misplaced(evidence, view, &present)));
            }
        }
        found
    }
}

/// Every place of a view changed.
pub(super) fn places(
    evidence: &Evidence,
    view: usize,
    map: impl Fn(Point3) -> Point3,
) -> Vec<Change> {
    let rows = evidence.views[view].rows.iter();
    rows.filter_map(|row| {
        let world = evidence.data.correspondences[*row].world?;
        let to = evidence.frame.world(map(evidence.frame.scaled(world)));
        Some(Change::World { row: *row, to })
    })
    .collect()
}

/// A chart's places, or its own size where its pose is estimated, which is done anew then.
fn resized(evidence: &Evidence, view: usize, stretch: &Stretch) -> Vec<Change> {
    if !evidence.has_estimated_pose(view) {
        return places(evidence, view, |place| stretch.map(place));
    }
    let [a, b] = stretch.scale;
    let scale = as_ratio(a).unwrap_or((a + b) / 2.0);
    let rows = evidence.views[view].rows.iter();
    rows.filter_map(|row| {
        let place = evidence.data.correspondences[*row].board?;
        Some(Change::Board { row: *row, to: place.map(|along| scale * along) })
    })
    .collect()
}

/// How well other places of a view explain it in all these cameras: the worst, over the good level.
pub(super) fn explained(
    evidence: &Evidence,
    view: usize,
    cameras: &[usize],
    map: &impl Fn(Point3) -> Point3,
) -> f64 {
    cameras
        .iter()
        .map(|camera| {
            evidence.explained((view, *camera), |_, (world, pixel)| Some((map(world), pixel)))
        })
        .fold(0.0, f64::max)
}

/// A lens that the formula does not describe makes a view at the end seem a little larger: its error over the
/// good level.
const STRETCHED_BY_LENS: f64 = 3.0;

/// What a less simple explanation leaves of what a simpler one does.
const CLEARLY_BETTER: f64 = 0.7;

/// Sizes that are tried: as given, and those that get mixed up.
const SIZES: [f64; 9] = [1.0, 0.1, 10.0, 1.0 / 25.4, 25.4, 0.5, 2.0, 1.0 / 2.54, 2.54];

/// What an explanation of a view leaves at most, over the good level.
fn most_left(evidence: &Evidence, view: usize, cameras: &[usize]) -> f64 {
    cameras.iter().map(|camera| evidence.most_left((view, *camera))).fold(1.0, f64::max)
}

/// The largest error of a view's cells over the good level.
fn worst(evidence: &Evidence, view: usize, cameras: &[usize]) -> f64 {
    cameras.iter().map(|camera| evidence.excess((view, *camera))).fold(0.0, f64::max)
}

/// Another size of a chart whose pose was estimated with the size given: with another pose. It is one number only that
/// the cameras do not agree on, so it must explain all of their pixels.
fn size_with_pose(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let before = worst(evidence, view, cameras);
    if before < STRETCHED_BY_LENS {
        return None;
    }
    let (shots, given) = shots_as_told(evidence, (view, cameras))?;
    let eye = evidence.seen[cameras[0]].as_ref()?.camera.centre();
    let sized = |scale: f64| {
        // As large in the first camera's picture.
        let by = (given.middle - eye) * (scale - 1.0);
        let found = adjusted(&shots, Stretch { by, ..Stretch::by_scale(given, scale) }, ANY);
        let scale = [0.5 * (found.scale[0] + found.scale[1]); 2];
        let found = adjusted(&shots, Stretch { scale, ..found }, RIGID);
        (explained(evidence, view, cameras, &|place| found.map(place)), found)
    };
    let (left, stretch) = SIZES.into_iter().map(sized).find(|(left, _)| *left <= 1.0)?;
    if left > MOST_LEFT * before || !stretch.is_sized() {
        return None;
    }
    named(evidence, view, cameras, (left, before), &stretch)
}

fn size(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let before = worst(evidence, view, cameras);
    if before < STRETCHED_BY_LENS {
        return None;
    }
    let (shots, given) = shots_as_told(evidence, (view, cameras))?;
    let start = |scale: f64| Stretch::by_scale(given, scale);
    let left_by =
        |stretch: &Stretch| explained(evidence, view, cameras, &|place| stretch.map(place));
    // A chart that only stood elsewhere is the simpler story; but for one of another size where it should be.
    let rigid = |turn: Vector3| {
        let moved = adjusted(&shots, Stretch { turn, ..start(1.0) }, RIGID);
        (if moved.is_slip() { left_by(&moved) } else { f64::INFINITY }, moved)
    };
    let most = most_left(evidence, view, cameras);
    let mut best = rigid(Vector3::zeros());
    for turn in given.other_tilts(evidence, cameras, given.middle) {
        if best.0 > most {
            let tilted = rigid(turn);
            best = if tilted.0 < best.0 { tilted } else { best };
        }
    }
    if best.0 <= most {
        // What is extrapolated looks a little larger or smaller, too.
        let clearly = if most > 1.0 { CLEARLY_BETTER } else { 1.0 };
        let sized = adjusted(&shots, start(1.0), SIZED);
        let left = left_by(&sized);
        if sized.is_sized() && !sized.is_slip() && left < clearly * best.0 {
            best = (left, sized);
        }
    }
    for scale in SIZES {
        if best.0 <= most || scale != 1.0 && evidence.is_slight(view, cameras) {
            break;
        }
        let stretch = adjusted(&shots, start(scale), ANY);
        let left = left_by(&stretch);
        if left < CLEARLY_BETTER * best.0 {
            best = (left, stretch);
        }
    }
    let (left, stretch) = best;
    if left > 0.4 * before || left > most && (left > 5.0 || left > 0.06 * before) {
        return None;
    }
    let centre = evidence.views[view].board.as_ref().map(|board| board.centre);
    let (left, stretch) = simpler((&shots, centre), (left, stretch), &left_by);
    named(evidence, view, cameras, (left, before), &stretch)
}

/// A chart that stands elsewhere by less than a slip, but by more than stages err, or by a slip that noise nearly hides,
/// though all other views are where they should be. Thresholds are by surveys of captures with stage errors.
fn slightly_misplaced(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    /// Fewer views tell a camera so badly that a sound one may seem to stand elsewhere.
    const VIEWS: usize = 7;
    /// Error of a view that stands out, over the good level.
    const OUT: f64 = 1.5;
    /// What other views may err by, of this one's error.
    const OTHERS: f64 = 0.6;
    /// What its right place leaves, of the good level: noise alone leaves a half.
    const NOISE: f64 = 0.75;
    /// Of the scene's size: ten times as much as stages err.
    const DISPLACED: f64 = 0.006;
    let before = worst(evidence, view, cameras);
    if before < OUT || evidence.views.len() < VIEWS {
        return None;
    }
    let mut others = (0..evidence.views.len()).filter(|other| *other != view);
    let most = (OTHERS * before).max(1.0);
    if others.any(|other| worst(evidence, other, &evidence.present(other)) > most) {
        return None;
    }
    let (shots, given) = shots_as_told(evidence, (view, cameras))?;
    let moved = adjusted(&shots, Stretch::by_scale(given, 1.0), RIGID);
    let left = explained(evidence, view, cameras, &|place| moved.map(place));
    // Where nothing is extrapolated the right place leaves the noise.
    let most = most_left(evidence, view, cameras);
    let is_far = before >= STRETCHED_BY_LENS && moved.by.norm() > DISPLACED || moved.is_slip();
    let is_explained = left < if most > 1.0 { most } else { NOISE };
    (is_far && is_explained).then(|| described(evidence, (view, cameras), left, &moved))
}

/// The same where a chart of another size would do that stands where it should, or is shifted in its plane, as its
/// size may count from any of its points: what is not adjusted does not err.
fn simpler(
    (shots, centre): (&Shots, Option<Point3>),
    (left, stretch): (f64, Stretch),
    left_by: &impl Fn(&Stretch) -> f64,
) -> (f64, Stretch) {
    /// The numbers that are not adjusted would follow what other views say wrongly of this one.
    const AS_WELL: f64 = 1.1;
    let [a, b] = stretch.scale;
    if !stretch.is_sized() || stretch.is_slip() || (a / b - 1.0).abs() >= 0.01 {
        return (left, stretch);
    }
    let simple = |middle: Point3, shift: &'static [usize]| {
        let given = GivenChart { middle, ..stretch.given };
        let (turn, by) = (Vector3::zeros(), Vector3::zeros());
        let free = if shift.is_empty() { SCALES } else { SCALES_AND_SHIFT };
        let sized = adjusted(shots, Stretch { given, turn, by, scale: stretch.scale }, free);
        let scale = [0.5 * (sized.scale[0] + sized.scale[1]); 2];
        let alike = adjusted(shots, Stretch { scale, ..sized }, shift);
        let own = left_by(&alike);
        (own <= AS_WELL * left).then_some((own, alike))
    };
    centre
        .and_then(|centre| simple(centre, &[]))
        .or_else(|| simple(stretch.given.middle, SHIFT))
        .unwrap_or((left, stretch))
}

/// Few views tell a camera so badly that a sound one may seem to have a pitch of its own.
fn of_pitch(evidence: &Evidence, scale: [f64; 2]) -> Severity {
    let is_near = scale.iter().all(|scale| (scale - 1.0).abs() < 0.05);
    if evidence.views.len() < 8 && is_near { Severity::Warning } else { Severity::Fatal }
}

fn named(
    evidence: &Evidence,
    view: usize,
    cameras: &[usize],
    (left, before): (f64, f64),
    stretch: &Stretch,
) -> Option<Proposal> {
    let is_clear = stretch.is_sized() || before >= 4.0 && stretch.is_slip();
    is_clear.then(|| described(evidence, (view, cameras), left, stretch))
}

/// What is wrong with a view that fits where its places are stretched so.
fn described(
    evidence: &Evidence,
    (view, cameras): (usize, &[usize]),
    left: f64,
    stretch: &Stretch,
) -> Proposal {
    let [a, b] = stretch.scale;
    let sized = stretch.is_sized();
    let alike = (a / b - 1.0).abs() < 0.01;
    let distance = stretch.by.norm() * evidence.frame.size;
    let angle = stretch.turn.norm().to_degrees();
    let unit = &evidence.data.unit;
    let (code, severity, what, freedom, fixable) = if !sized {
        if stretch.given.is_in_other_pose(evidence, cameras, (stretch.turn, stretch.by)) {
            let what = format!(
                "the chart is tilted to the other side, by {angle:.2} degrees: its given pose is the wrong one of the two in which a camera sees a flat chart nearly alike"
            );
            ("pose-two-fold", Severity::Fatal, what, Freedom::Pose, false)
        } else {
            let what = format!(
                "the chart is {distance:.3} {unit} from its given pose, rotated by {angle:.2} degrees"
            );
            ("view-misplaced", Severity::Fatal, what, Freedom::Pose, false)
        }
    } else if let Some(ratio) = as_ratio(a).filter(|_| alike) {
        let times = tidy(1.0 / ratio);
        let what = format!("the chart positions are {times} times too large: another unit");
        ("units-mixed", Severity::Fatal, what, Freedom::Scale, true)
    } else if alike {
        let what = format!("the chart's pitch is {:.4} times the given one", (a + b) / 2.0);
        ("wrong-pitch", of_pitch(evidence, [a, b]), what, Freedom::Scale, true)
    } else {
        let what = format!(
            "the chart's pitch is {a:.4} times the given one along one axis and {b:.4} times along the other"
        );
        ("wrong-pitch", of_pitch(evidence, [a, b]), what, Freedom::Scale, true)
    };
    let hint = if code == "pose-two-fold" {
        "take the other of the two solutions of the pose, or leave the pose out so that bundle adjustment finds it; tilt charts more"
    } else {
        "measure the chart and give its true size and pose, or let the program correct what it can"
    };
    let changes = if fixable { resized(evidence, view, stretch) } else { Vec::new() };
    Proposal {
        freedom,
        left,
        cells: cameras.iter().map(|camera| (view, *camera)).collect(),
        key: if fixable { format!("{:.2}", (a + b) / 2.0) } else { view.to_string() },
        figures: vec![
            ("size along rows, relative to the given one".into(), a),
            ("size along columns, relative to the given one".into(), b),
            (format!("displacement, {unit}"), distance),
            ("turn, degrees".into(), angle),
        ],
        is_estimate: fixable && code == "wrong-pitch",
        changes,
        ..Proposal::itself(code, severity, what, hint)
    }
}
