//! A view whose world places have another size or unit than the others', or stand elsewhere.

use super::{
    Fault,
    board::principal_axes,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
    robust_camera::{Pair, RobustCamera},
};
use crate::{
    geometry::{Point3, Pose, Vector3},
    numeric::statistics::median,
};
use nalgebra::{SMatrix, SVector};

pub(super) struct ChartSize;

/// Units that get mixed, as ratios: decimal ones, and inches with millimetres and centimetres.
const RATIOS: [f64; 7] = [10.0, 100.0, 1000.0, 25.4, 2.54, 0.0254, 0.3048];

impl Fault for ChartSize {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for view in 0..evidence.views.len() {
            let present = evidence.present(view);
            if present.is_empty() || evidence.suspects(view).len() != present.len() {
                continue;
            }
            found.extend(units(evidence, view, &present));
            // One camera cannot tell size from distance.
            if present.len() > 1 {
                found.extend(size(evidence, view, &present));
            }
        }
        found
    }
}

fn is_ratio(scale: f64) -> bool {
    RATIOS
        .iter()
        .any(|ratio| [*ratio, 1.0 / ratio].iter().any(|known| (scale / known - 1.0).abs() < 5e-3))
}

fn places(evidence: &Evidence, view: usize, map: impl Fn(Point3) -> Point3) -> Vec<Change> {
    let rows = evidence.views[view].rows.iter();
    rows.filter_map(|row| {
        let world = evidence.data.correspondences[*row].world?;
        let to = evidence.frame.world(map(evidence.frame.scaled(world)));
        Some(Change::World { row: *row, to })
    })
    .collect()
}

fn explained(
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

/// All coordinates, or one, in another unit.
fn units(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let frame = evidence.frame;
    let columns = [
        [true; 3],
        [true, false, false],
        [false, true, false],
        [false, false, true],
        [true, true, false],
    ];
    let names = ["X, Y and Z", "X", "Y", "Z", "X and Y"];
    for ratio in RATIOS.iter().flat_map(|ratio| [*ratio, 1.0 / ratio]) {
        for (which, name) in columns.iter().zip(names) {
            let map = |scaled: Point3| {
                let mut world = frame.world(scaled);
                for axis in 0..3 {
                    if which[axis] {
                        world[axis] /= ratio;
                    }
                }
                frame.scaled(world)
            };
            let left = explained(evidence, view, cameras, &map);
            if !cameras.iter().all(|camera| evidence.accepts((view, *camera), left)) {
                continue;
            }
            let what =
                format!("{name} are {} times what they should be: another unit", tidy(ratio));
            return Some(Proposal {
                freedom: Freedom::Choice,
                left,
                cells: cameras.iter().map(|camera| (view, *camera)).collect(),
                also: Vec::new(),
                key: what.clone(),
                code: "units-mixed",
                severity: Severity::Fatal,
                what,
                hint: "give all world places in one unit, or let `wheatstone check --fix OUT` scale these".into(),
                figures: vec![("scale".into(), ratio)],
                changes: places(evidence, view, map),
            });
        }
    }
    None
}

fn tidy(ratio: f64) -> String {
    let text = format!("{ratio:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// How a chart's places are to be changed: stretched in its plane about its middle, turned, moved.
#[derive(Clone, Debug)]
struct Stretch {
    middle: Point3,
    along: [Vector3; 2],
    scale: [f64; 2],
    turn: Vector3,
    by: Vector3,
}

impl Stretch {
    fn map(&self, place: Point3) -> Point3 {
        let own = place - self.middle;
        let [a, b] = [0, 1].map(|axis| own.dot(&self.along[axis]));
        let height = own - self.along[0] * a - self.along[1] * b;
        let stretched =
            self.along[0] * (a * self.scale[0]) + self.along[1] * (b * self.scale[1]) + height;
        let turn = Pose::from_rotation_vector(Vector3::zeros(), self.turn);
        self.middle + turn.rotation * stretched + self.by
    }

    fn stepped(&self, step: &SVector<f64, 8>) -> Self {
        Self {
            scale: [self.scale[0] + step[0], self.scale[1] + step[1]],
            turn: self.turn + Vector3::new(step[2], step[3], step[4]),
            by: self.by + Vector3::new(step[5], step[6], step[7]),
            ..self.clone()
        }
    }
}

/// The view's points with each camera.
type Shots<'a> = Vec<(&'a RobustCamera, Pair)>;

fn cost(shots: &Shots, stretch: &Stretch, scale: f64) -> f64 {
    let each = shots.iter().map(|(camera, (place, pixel))| {
        let square = camera.error(&(stretch.map(*place), *pixel)).norm_squared();
        libm::log1p(square / (scale * scale))
    });
    each.sum()
}

/// Adjusts a stretch to the pixels, under Cauchy's weight, by damped steps with slopes by differences.
fn adjusted(shots: &Shots, start: Stretch) -> Stretch {
    const STEP: f64 = 1e-5;
    let mut stretch = start;
    let mut damping = 1e-3;
    for _ in 0..25 {
        let errors: Vec<_> = shots
            .iter()
            .map(|(camera, (place, pixel))| camera.error(&(stretch.map(*place), *pixel)))
            .collect();
        let lengths: Vec<f64> = errors.iter().map(|error| error.norm()).collect();
        let scale = (1.2 * median(&lengths)).max(1e-3);
        let mut matrix = SMatrix::<f64, 8, 8>::zeros();
        let mut gradient = SVector::<f64, 8>::zeros();
        let moved: Vec<Stretch> = (0..8)
            .map(|index| {
                let mut step = SVector::<f64, 8>::zeros();
                step[index] = STEP;
                stretch.stepped(&step)
            })
            .collect();
        for ((camera, (place, pixel)), error) in shots.iter().zip(&errors) {
            let weight = 1.0 / (1.0 + error.norm_squared() / (scale * scale));
            let slopes: Vec<_> = moved
                .iter()
                .map(|other| (error - camera.error(&(other.map(*place), *pixel))) / STEP)
                .collect();
            for axis in 0..2 {
                let row = SVector::<f64, 8>::from_fn(|index, _| slopes[index][axis]);
                matrix.ger(weight, &row, &row, 1.0);
                gradient += row * (weight * error[axis]);
            }
        }
        let before = cost(shots, &stretch, scale);
        for index in 0..8 {
            matrix[(index, index)] *= 1.0 + damping;
        }
        let Some(factors) = matrix.cholesky() else { break };
        let next = stretch.stepped(&factors.solve(&gradient));
        let after = cost(shots, &next, scale);
        if after < before {
            stretch = next;
            damping = (damping * 0.2_f64).max(1e-9);
            if 1.0 - after / before < 1e-5 {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    stretch
}

fn size(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let mut shots: Shots = Vec::new();
    let mut all: Vec<Point3> = Vec::new();
    for camera in cameras {
        let (cell, _, other) = evidence.at(view, *camera)?;
        let step = cell.pairs.len().div_ceil(40).max(1);
        shots.extend(cell.pairs.iter().step_by(step).map(|pair| (other, *pair)));
        all.extend(cell.pairs.iter().map(|pair| pair.0));
    }
    let (middle, axes, _) = principal_axes(&all);
    let along = match &evidence.views[view].board {
        Some(board) => board.along,
        None => [axes[0], axes[1]],
    };
    let starts = [1.0, 0.1, 10.0, 1.0 / 25.4, 25.4, 0.5, 2.0, 1.0 / 2.54, 2.54];
    let mut best: Option<(f64, Stretch)> = None;
    for scale in starts {
        let start = Stretch {
            middle,
            along,
            scale: [scale; 2],
            turn: Vector3::zeros(),
            by: Vector3::zeros(),
        };
        let stretch = adjusted(&shots, start);
        let left = explained(evidence, view, cameras, &|place| stretch.map(place));
        if best.as_ref().is_none_or(|(least, _)| left < *least) {
            best = Some((left, stretch));
        }
        if best.as_ref().is_some_and(|(least, _)| *least <= 1.0) {
            break;
        }
    }
    let (left, stretch) = best?;
    let before = cameras.iter().map(|c| evidence.excess((view, *c))).fold(0.0, f64::max);
    if left > 0.4 * before || left > 1.0 && (left > 5.0 || left > 0.06 * before) {
        return None;
    }
    named(evidence, view, cameras, (left, before), &stretch)
}

fn named(
    evidence: &Evidence,
    view: usize,
    cameras: &[usize],
    (left, before): (f64, f64),
    stretch: &Stretch,
) -> Option<Proposal> {
    let [a, b] = stretch.scale;
    // A tenth of a percent is as well as one view of a chart tells its size.
    let sized = (a - 1.0).abs() > 3e-3 || (b - 1.0).abs() > 3e-3;
    // A lens that the formula does not describe makes a view at the end seem a little larger.
    if sized && before < 3.0 {
        return None;
    }
    let alike = (a / b - 1.0).abs() < 0.01;
    let distance = stretch.by.norm() * evidence.frame.size;
    let angle = stretch.turn.norm().to_degrees();
    let unit = &evidence.data.unit;
    let (code, severity, what, freedom, fixable) = if !sized {
        // Stages err by little; beyond a thirtieth of the scene's size, or two degrees, it is a slip.
        if before < 4.0 || stretch.by.norm() < 0.03 && stretch.turn.norm() < 0.03 {
            return None;
        }
        let what = format!(
            "the chart stands {distance:.3} {unit} from where the file says, turned by {angle:.2} degrees"
        );
        ("view-misplaced", Severity::Fatal, what, Freedom::Pose, false)
    } else if alike && is_ratio(a) {
        let what =
            format!("the chart's places are {} times too large: another unit", tidy(1.0 / a));
        ("units-mixed", Severity::Fatal, what, Freedom::Scale, true)
    } else if alike {
        let what = format!("the chart's pitch is {:.4} times what the file says", (a + b) / 2.0);
        ("wrong-pitch", Severity::Fatal, what, Freedom::Scale, true)
    } else {
        let what = format!(
            "the chart's pitch is {a:.4} times what the file says one way and {b:.4} times the other"
        );
        ("wrong-pitch", Severity::Fatal, what, Freedom::Scale, true)
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
        hint: "measure the chart and give its true size and place, or let `wheatstone check --fix OUT` set right what it can".into(),
        figures: vec![
            ("size along rows, of what the file says".into(), a),
            ("size along columns, of what the file says".into(), b),
            (format!("displacement, {unit}"), distance),
            ("turn, degrees".into(), angle),
        ],
        changes,
    })
}
