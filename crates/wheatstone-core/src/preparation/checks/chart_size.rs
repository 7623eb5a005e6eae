//! A view whose world places have another size than the others', or stand elsewhere.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
    other_pose::GivenChart,
    pairs::Pair,
    robust_camera::RobustCamera,
    unit_ratios::{is_ratio, tidy},
};
use crate::geometry::{Point3, Pose, Vector3};
use nalgebra::{SMatrix, SVector, Vector2};
use wheatstone_numeric::{
    levenberg_marquardt::{Damping, Patience, Problem, search},
    progress::Silent,
    statistics::median,
};

pub(super) struct ChartSize;

impl Fault for ChartSize {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for view in 0..evidence.views.len() {
            let present = evidence.present(view);
            if present.is_empty() || evidence.suspects(view).len() != present.len() {
                continue;
            }
            // One camera cannot tell size from distance.
            if present.len() > 1 {
                found.extend(size(evidence, view, &present));
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

/// How a chart's places are to be changed: stretched in its plane about its middle, turned, moved.
#[derive(Clone, Debug)]
struct Stretch {
    given: GivenChart,
    scale: [f64; 2],
    turn: Vector3,
    by: Vector3,
}

impl Stretch {
    fn map(&self, place: Point3) -> Point3 {
        let GivenChart { middle, along, .. } = self.given;
        let own = place - middle;
        let [a, b] = along.map(|side| own.dot(&side));
        let height = own - along[0] * a - along[1] * b;
        let [by_a, by_b] = self.scale;
        // Points off the plane belong to the same body.
        let stretched =
            along[0] * (a * by_a) + along[1] * (b * by_b) + height * (by_a * by_b).abs().sqrt();
        let turn = Pose::from_rotation_vector(Vector3::zeros(), self.turn);
        middle + turn.rotation * stretched + self.by
    }

    /// Stages err by little; beyond a thirtieth of the scene's size, or two degrees, it is a slip.
    fn is_slip(&self) -> bool {
        self.by.norm() >= 0.03 || self.turn.norm() >= 0.03
    }

    /// A tenth of a percent is as well as one view of a chart tells its size.
    fn is_sized(&self) -> bool {
        self.scale.iter().any(|scale| (scale - 1.0).abs() > 3e-3)
    }

    fn stepped(&self, step: &SVector<f64, 8>) -> Self {
        let [right, down] = self.given.along;
        Self {
            scale: [self.scale[0] + step[0], self.scale[1] + step[1]],
            turn: self.turn + Vector3::new(step[2], step[3], step[4]),
            by: self.by + right * step[5] + down * step[6] + right.cross(&down) * step[7],
            ..self.clone()
        }
    }
}

/// The view's points with each camera.
type Shots<'a> = Vec<(&'a RobustCamera, Pair)>;

/// Numbers of a stretch: the scales, the turn, the move along the sides and across; and those that a hypothesis adjusts.
const RIGID: &[usize] = &[2, 3, 4, 5, 6, 7];
const SCALES: &[usize] = &[0, 1];
const SHIFT: &[usize] = &[5, 6];
const SCALES_AND_SHIFT: &[usize] = &[0, 1, 5, 6];
const SIZED: &[usize] = &[0, 1, 5, 6, 7];
const ANY: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7];

/// Adjusts these numbers of a stretch to the pixels.
fn adjusted(shots: &Shots, start: Stretch, free: &'static [usize]) -> Stretch {
    const PATIENCE: Patience = Patience { steps: 25, least_gain: 1e-5 };
    let how = (PATIENCE, Damping::marquardt(1e-3));
    let found = search(&Stretching { shots, free }, start.clone(), how, &Silent);
    found.ok().flatten().map_or(start, |found| found.state)
}

/// A stretch found from pixels, under Cauchy's weight.
struct Stretching<'a> {
    shots: &'a Shots<'a>,
    free: &'static [usize],
}

struct Equations {
    errors: Vec<Vector2<f64>>,
    scale: f64,
    matrix: SMatrix<f64, 8, 8>,
    gradient: SVector<f64, 8>,
}

impl Equations {
    /// What Cauchy's weight makes least, for errors of this scale.
    fn cost(&self, scale: f64) -> f64 {
        let of = |error: &Vector2<f64>| libm::log1p(error.norm_squared() / (scale * scale));
        0.5 * scale * scale * self.errors.iter().map(of).sum::<f64>()
    }
}

impl Stretching<'_> {
    fn errors(&self, stretch: &Stretch) -> Vec<Vector2<f64>> {
        let of = |(camera, (place, pixel)): &(&RobustCamera, Pair)| {
            camera.error(&(stretch.map(*place), *pixel))
        };
        self.shots.iter().map(of).collect()
    }
}

impl Problem for Stretching<'_> {
    type State = Stretch;
    type Equations = Equations;
    type Step = SVector<f64, 8>;

    /// Slopes are differences.
    fn linearise(&self, stretch: &Stretch) -> Option<Equations> {
        const STEP: f64 = 1e-5;
        let errors = self.errors(stretch);
        let lengths: Vec<f64> = errors.iter().map(|error| error.norm()).collect();
        let scale = (1.2 * median(&lengths)).max(1e-3);
        let ahead = |index: usize| {
            let mut step = SVector::<f64, 8>::zeros();
            step[index] = STEP;
            self.errors(&stretch.stepped(&step))
        };
        let moved: Vec<(usize, Vec<Vector2<f64>>)> =
            self.free.iter().map(|k| (*k, ahead(*k))).collect();
        let mut matrix = SMatrix::<f64, 8, 8>::zeros();
        let mut gradient = SVector::<f64, 8>::zeros();
        for (row, error) in errors.iter().enumerate() {
            let weight = 1.0 / (1.0 + error.norm_squared() / (scale * scale));
            for axis in 0..2 {
                let mut slopes = SVector::<f64, 8>::zeros();
                for (index, moved) in &moved {
                    slopes[*index] = (error[axis] - moved[row][axis]) / STEP;
                }
                matrix.ger(weight, &slopes, &slopes, 1.0);
                gradient += slopes * (weight * error[axis]);
            }
        }
        Some(Equations { errors, scale, matrix, gradient })
    }

    fn step(&self, equations: &Equations, damping: f64) -> Option<(SVector<f64, 8>, f64)> {
        let Equations { matrix, gradient, .. } = equations;
        let diagonal = matrix.diagonal();
        let held = diagonal.map(|value| if value > 0.0 { damping * value } else { 1.0 });
        let step = (matrix + SMatrix::from_diagonal(&held)).cholesky()?.solve(gradient);
        Some((step, 0.5 * (step.dot(gradient) + step.dot(&held.component_mul(&step)))))
    }

    fn moved(&self, stretch: &Stretch, step: &SVector<f64, 8>) -> Stretch {
        stretch.stepped(step)
    }

    fn cost(&self, equations: &Equations) -> f64 {
        equations.cost(equations.scale)
    }

    fn gain(&self, before: &Equations, after: &Equations) -> f64 {
        before.cost(before.scale) - after.cost(before.scale)
    }
}

/// A lens that the formula does not describe makes a view at the end seem a little larger: its error over the
/// good level.
const STRETCHED_BY_LENS: f64 = 3.0;

fn size(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let before = cameras.iter().map(|c| evidence.excess((view, *c))).fold(0.0, f64::max);
    if before < STRETCHED_BY_LENS {
        return None;
    }
    let mut shots: Shots = Vec::new();
    let mut all: Vec<Point3> = Vec::new();
    for camera in cameras {
        let (cell, _, other) = evidence.at(view, *camera)?;
        let step = cell.pairs.len().div_ceil(40).max(1);
        shots.extend(cell.pairs.iter().step_by(step).map(|pair| (other, *pair)));
        all.extend(cell.pairs.iter().map(|pair| pair.0));
    }
    let given = GivenChart::of(&all, evidence.views[view].board.as_ref().map(|board| board.along));
    let start = |scale: f64| Stretch {
        given,
        scale: [scale; 2],
        turn: Vector3::zeros(),
        by: Vector3::zeros(),
    };
    let left_by =
        |stretch: &Stretch| explained(evidence, view, cameras, &|place| stretch.map(place));
    // A chart that only stood elsewhere is the simpler story; but for one of another size where it should be.
    let rigid = |turn: Vector3| {
        let moved = adjusted(&shots, Stretch { turn, ..start(1.0) }, RIGID);
        (if moved.is_slip() { left_by(&moved) } else { f64::INFINITY }, moved)
    };
    let mut best = rigid(Vector3::zeros());
    for turn in given.other_tilts(evidence, cameras, given.middle) {
        if best.0 > 1.0 {
            let tilted = rigid(turn);
            best = if tilted.0 < best.0 { tilted } else { best };
        }
    }
    if best.0 <= 1.0 {
        let sized = adjusted(&shots, start(1.0), SIZED);
        let left = left_by(&sized);
        if sized.is_sized() && !sized.is_slip() && left < best.0 {
            best = (left, sized);
        }
    }
    for scale in [1.0, 0.1, 10.0, 1.0 / 25.4, 25.4, 0.5, 2.0, 1.0 / 2.54, 2.54] {
        if best.0 <= 1.0 || scale != 1.0 && evidence.is_slight(view, cameras) {
            break;
        }
        let stretch = adjusted(&shots, start(scale), ANY);
        let left = left_by(&stretch);
        if left < 0.7 * best.0 {
            best = (left, stretch);
        }
    }
    let (left, stretch) = best;
    if left > 0.4 * before || left > 1.0 && (left > 5.0 || left > 0.06 * before) {
        return None;
    }
    let centre = evidence.views[view].board.as_ref().map(|board| board.centre);
    let (left, stretch) = simpler((&shots, centre), (left, stretch), &left_by);
    named(evidence, view, cameras, (left, before), &stretch)
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
    let [a, b] = stretch.scale;
    let sized = stretch.is_sized();
    let alike = (a / b - 1.0).abs() < 0.01;
    let distance = stretch.by.norm() * evidence.frame.size;
    let angle = stretch.turn.norm().to_degrees();
    let unit = &evidence.data.unit;
    let (code, severity, what, freedom, fixable) = if !sized {
        if before < 4.0 || !stretch.is_slip() {
            return None;
        }
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
    } else if alike && is_ratio(a) {
        let what =
            format!("the chart positions are {} times too large: another unit", tidy(1.0 / a));
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
    let changes =
        if fixable { places(evidence, view, |place| stretch.map(place)) } else { Vec::new() };
    Some(Proposal {
        freedom,
        left,
        cells: cameras.iter().map(|camera| (view, *camera)).collect(),
        also: Vec::new(),
        key: if fixable { format!("{:.2}", (a + b) / 2.0) } else { view.to_string() },
        code,
        severity,
        what,
        hint: hint.into(),
        figures: vec![
            ("size along rows, relative to the given one".into(), a),
            ("size along columns, relative to the given one".into(), b),
            (format!("displacement, {unit}"), distance),
            ("turn, degrees".into(), angle),
        ],
        is_estimate: fixable && code == "wrong-pitch",
        changes,
    })
}
