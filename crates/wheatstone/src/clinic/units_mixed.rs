//! World places in two units: those of a view, or one column of the table.

use super::{
    Fault,
    chart_size::{explained, places},
    evidence::Evidence,
    finding::{Freedom, Proposal, Severity},
    robust_camera::Pair,
    spread::{THIN, thickness},
};
use crate::geometry::Point3;

pub(super) struct UnitsMixed;

impl Fault for UnitsMixed {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let all_miss = |view: &usize| {
            let present = evidence.present(*view);
            !present.is_empty() && evidence.suspects(*view).len() == present.len()
        };
        let views = (0..evidence.views.len()).filter(all_miss);
        views.filter_map(|view| units(evidence, view, &evidence.present(view))).collect()
    }
}

/// Units that get mixed, as ratios: decimal ones, and inches with millimetres and centimetres.
const RATIOS: [f64; 7] = [10.0, 100.0, 1000.0, 25.4, 2.54, 0.0254, 0.3048];

/// Whether a scale is one of the ratios.
pub(super) fn is_ratio(scale: f64) -> bool {
    RATIOS
        .iter()
        .any(|ratio| [*ratio, 1.0 / ratio].iter().any(|known| (scale / known - 1.0).abs() < 5e-3))
}

/// The columns that may have a unit of their own, and their names.
const COLUMNS: [([bool; 3], &str); 4] = [
    ([true, false, false], "X"),
    ([false, true, false], "Y"),
    ([false, false, true], "Z"),
    ([true, true, false], "X and Y"),
];

/// Some of a place's coordinates divided by a ratio of units.
fn in_unit(evidence: &Evidence, which: [bool; 3], ratio: f64, scaled: Point3) -> Point3 {
    let mut world = evidence.frame.world(scaled);
    for axis in 0..3 {
        if which[axis] {
            world[axis] /= ratio;
        }
    }
    evidence.frame.scaled(world)
}

/// One or two columns in another unit in all views: no camera fits, and all do once it is put right.
pub(super) fn units_throughout(evidence: &Evidence) -> Option<Proposal> {
    // In a stretched world half of the views and more agree on no camera, or on a bad one.
    let bad = |camera: usize| {
        let sound = evidence.cells.iter().filter(|view| !view[camera].suspicious).count();
        let typical = evidence.seen[camera].as_ref().map_or(f64::INFINITY, |seen| seen.typical);
        // Whole pixels leave 0.4.
        typical > 0.45 || 5 * sound <= 3 * evidence.views.len()
    };
    // A slab may be one by its unit alone.
    let thin = thickness(evidence).is_some_and(|share| share < THIN);
    if !thin && !(0..evidence.data.cameras).all(bad) {
        return None;
    }
    let cameras: Vec<usize> = (0..evidence.data.cameras).collect();
    let before: Vec<f64> = cameras
        .iter()
        .map(|camera| evidence.overall(*camera, |_, _, pair| Some(pair)))
        .collect::<Option<_>>()?;
    let mut best: Option<(f64, [bool; 3], f64, &str)> = None;
    for ratio in RATIOS.iter().flat_map(|ratio| [*ratio, 1.0 / ratio]) {
        for (which, name) in COLUMNS {
            let mut worst: f64 = 0.0;
            for camera in &cameras {
                let read = |_: usize, _: usize, (place, pixel): Pair| {
                    Some((in_unit(evidence, which, ratio, place), pixel))
                };
                let left = evidence.overall(*camera, read).unwrap_or(f64::INFINITY);
                worst = worst.max(left / before[*camera]);
                if worst > 0.2 {
                    break;
                }
            }
            if worst <= 0.2 && best.as_ref().is_none_or(|(least, ..)| worst < *least) {
                best = Some((worst, which, ratio, name));
            }
        }
    }
    let (left, which, ratio, name) = best?;
    let all: Vec<(usize, usize)> = (0..evidence.views.len())
        .flat_map(|view| cameras.iter().map(move |camera| (view, *camera)))
        .collect();
    let changes = (0..evidence.views.len())
        .flat_map(|view| places(evidence, view, |place| in_unit(evidence, which, ratio, place)));
    Some(Proposal {
        cells: all.clone(),
        also: all,
        figures: vec![("scale".into(), ratio), ("error left, of that before".into(), left)],
        changes: changes.collect(),
        ..Proposal::itself(
            "units-mixed",
            Severity::Fatal,
            format!(
                "{name} of all places are {} times what they should be beside the others: another unit",
                tidy(ratio)
            ),
            UNITS_HINT,
        )
    })
}

const UNITS_HINT: &str =
    "give all world places in one unit, or let `wheatstone check --fix OUT` scale these";

/// All coordinates of a view, or some, in another unit.
fn units(evidence: &Evidence, view: usize, cameras: &[usize]) -> Option<Proposal> {
    let columns = [([true; 3], "X, Y and Z")].into_iter().chain(COLUMNS);
    for ratio in RATIOS.iter().flat_map(|ratio| [*ratio, 1.0 / ratio]) {
        for (which, name) in columns.clone() {
            let map = |scaled: Point3| in_unit(evidence, which, ratio, scaled);
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
                hint: UNITS_HINT.into(),
                figures: vec![("scale".into(), ratio)],
                changes: places(evidence, view, map),
            });
        }
    }
    None
}

/// A ratio in as few figures as it has.
pub(super) fn tidy(ratio: f64) -> String {
    let text = format!("{ratio:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
