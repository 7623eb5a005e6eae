//! What is alike in all views of a camera, so that the camera takes it up: mirrored pictures or frames,
//! boards read turned or transposed in every picture. Found by comparing the cameras.

use super::{
    Fault,
    board::Mixing,
    board_order::{naming, relabelled},
    camera_evidence::CameraEvidence,
    coverage::{THIN, pixel_box, thickness},
    evidence::{Cell, Evidence},
    finding::{Proposal, Severity},
    pairs::{Pair, sides},
    unsynchronised::overall_figures,
};
use crate::geometry::Point3;

pub(super) struct Handedness;

impl Fault for Handedness {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        let mut told = vec![false; evidence.data.cameras];
        for (camera, told) in told.iter_mut().enumerate() {
            if let Some(proposal) = relabelled_throughout(evidence, camera) {
                *told = true;
                found.push(proposal);
            }
        }
        if found.len() > 1
            && told.iter().all(|told| *told)
            && found.iter().all(|one| one.what == found[0].what)
        {
            found.iter_mut().for_each(|one| one.hint = OF_ALL.into());
        }
        // In a slab or on a plane near and far cannot be told apart.
        if thickness(evidence).is_some_and(|share| share >= THIN) {
            found.extend(mirrored(evidence, &told));
        }
        found.extend(rolled(evidence, &told));
        found
    }
}

/// What is alike in all cameras is the poses' doing.
const OF_ALL: &str = "give the poses of the chart as it is read, from the corner at id 0 (of a chessboard one whose square is light), or let the labels be corrected";

fn everywhere(evidence: &Evidence, camera: usize) -> Vec<(usize, usize)> {
    (0..evidence.views.len()).map(|view| (view, camera)).collect()
}

/// The share of its error that a camera is left with at most when labels are read rightly.
const EXPLAINED: f64 = 0.2;

/// A camera whose views do not agree as the labels are, and agree well when all are read otherwise.
fn relabelled_throughout(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let own = evidence.seen[camera].as_ref()?;
    let others: Vec<&CameraEvidence> = evidence
        .seen
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != camera)
        .filter_map(|(_, seen)| seen.as_ref())
        .collect();
    let best = others.iter().map(|seen| seen.typical).fold(f64::INFINITY, f64::min);
    // Lenses differ; a camera that errs several times as much as another has another reason.
    let agreeing = evidence.cells.iter().filter(|view| !view[camera].suspicious).count();
    let disagrees = evidence.is_lost(camera) || 4 * agreeing < 3 * evidence.views.len();
    if !disagrees && !errs_beyond_lenses(evidence, camera) {
        return None;
    }
    // Labels so wrong that no camera fits at all leave the sound views' error.
    let plain = evidence.overall(camera, None, |_, _, pair| Some(pair)).unwrap_or(own.typical);
    let before = plain.min(evidence.mean_error(camera));
    if EXPLAINED * before < evidence.floor() {
        return None;
    }
    let mut found: Option<(f64, Mixing)> = None;
    for how in Mixing::all() {
        let mixed = |view: usize, _: usize, (world, pixel): Pair| {
            let board = evidence.views[view].board.as_ref()?;
            Some((board.mixed(world, how)?, pixel))
        };
        if is_taken_up(evidence, camera, mixed) {
            continue;
        }
        let Some(left) = evidence.overall(camera, None, mixed) else { continue };
        // Read rightly it is about as good as the best of the others.
        if left < EXPLAINED * before
            && left < 4.0 * best + 0.5
            && found.is_none_or(|(least, _)| left < 0.7 * least)
        {
            found = Some((left, how));
        }
    }
    let (left, how) = found?;
    let (code, what) = naming(how);
    let changes = (0..evidence.views.len()).flat_map(|view| {
        let board = evidence.views[view].board.clone();
        relabelled(evidence, (view, camera), |world| board.as_ref()?.mixed(world, how))
    });
    Some(Proposal {
        cells: everywhere(evidence, camera),
        also: everywhere(evidence, camera),
        figures: overall_figures(before, left),
        changes: changes.collect(),
        ..Proposal::itself(
            code,
            Severity::Fatal,
            what,
            "read the board in the same order in every camera, or let the labels be corrected",
        )
    })
}

/// Whether a camera errs by more of its picture than any optics: then all views are bad alike, and none stands out.
fn errs_beyond_lenses(evidence: &Evidence, camera: usize) -> bool {
    /// Of the shorter side of its points' box. The worst optics that were simulated leave 0.011.
    const BEYOND: f64 = 0.02;
    let pairs: Vec<Pair> =
        evidence.cells.iter().flat_map(|view| view[camera].pairs.iter().copied()).collect();
    let [width, height] = sides(&pairs);
    let typical = evidence.seen[camera].as_ref().map_or(0.0, |seen| seen.typical);
    typical > BEYOND * width.min(height)
}

/// Whether places that are read in some way are those that were, moved as one body, or its mirror image: a camera
/// takes that up, and its error stays as it is.
fn is_taken_up(
    evidence: &Evidence,
    camera: usize,
    read: impl Fn(usize, usize, Pair) -> Option<Pair>,
) -> bool {
    /// Points a view: a body of a few hundred points in all.
    const TRIED: usize = 14;
    /// In sizes of the scene: thousandths of a pixel.
    const ALIKE: f64 = 1e-6;
    let cells = evidence.cells.iter().map(|view| &view[camera].pairs).enumerate();
    let moved = cells.flat_map(|(view, pairs)| {
        let step = pairs.len().div_ceil(TRIED).max(1);
        let read = &read;
        (0..pairs.len()).step_by(step).map(move |index| {
            let (to, _) = read(view, index, pairs[index])?;
            Some((pairs[index].0, to))
        })
    });
    let Some(moved) = moved.collect::<Option<Vec<(Point3, Point3)>>>() else { return false };
    let alike = |(a, to_a): &(Point3, Point3), (b, to_b): &(Point3, Point3)| {
        ((a - b).norm() - (to_a - to_b).norm()).abs() < ALIKE
    };
    let mut places = moved.iter().enumerate();
    places.all(|(index, one)| moved[..index].iter().all(|other| alike(one, other)))
}

/// Points of the sound views, thinned out.
fn sound(evidence: &Evidence, camera: usize) -> Vec<Pair> {
    let cells = evidence.cells.iter().map(|view| &view[camera]).filter(|cell| !cell.suspicious);
    let pairs = |cell: &Cell| -> Vec<Pair> {
        cell.pairs.iter().step_by(cell.pairs.len().div_ceil(20).max(1)).copied().collect()
    };
    cells.flat_map(pairs).collect()
}

/// Mirrored cameras: all, then the frame is left-handed or v points up; some, then those.
fn mirrored(evidence: &Evidence, told: &[bool]) -> Vec<Proposal> {
    let certain = |camera: &usize| {
        evidence.seen[*camera].as_ref().is_some_and(|seen| {
            let pairs = sound(evidence, *camera);
            seen.camera.tells_near_from_far(&pairs)
        })
    };
    let fitted: Vec<usize> = (0..told.len()).filter(certain).collect();
    let is =
        |camera: &usize| evidence.seen[*camera].as_ref().is_some_and(|s| s.camera.is_mirrored());
    let mirrored: Vec<usize> = fitted.iter().copied().filter(is).collect();
    if mirrored.is_empty() {
        return Vec::new();
    }
    let negative = |camera: &usize| pixel_box(evidence.data, *camera).is_some_and(|b| b[3] <= 0.0);
    if mirrored.len() == fitted.len() {
        let up = mirrored.iter().all(negative);
        let (code, what) = if up {
            (
                "v-axis-up",
                "y of the pixels points up in all cameras: all are negative, and every camera sees a mirrored world",
            )
        } else {
            (
                "mirrored-frame",
                "every camera sees a mirrored world: X, Y, Z are left-handed, or y of the pixels points up (or x to the left) in all cameras",
            )
        };
        let hint = "points will be located in the same mirrored frame; change the sign of one world axis (or of y) if rotations or shapes matter";
        return vec![Proposal::itself(code, Severity::Warning, what.into(), hint)];
    }
    // With as many mirrored as not, a right-handed world is the usual one.
    let odd: Vec<usize> = if 2 * mirrored.len() <= fitted.len() {
        mirrored.clone()
    } else {
        fitted.iter().copied().filter(|camera| !mirrored.contains(camera)).collect()
    };
    let look = if 2 * odd.len() == fitted.len() {
        "look at one picture of each camera, for where X, Y, Z are left-handed, or a board's x and y exchanged, it is the cameras not named"
    } else {
        "look at one picture of this camera"
    };
    let hint = format!(
        "if only the pixel axes differ, this is harmless as long as `locate` gets the same pixels; if the labels are wrong, the points will be too: {look}"
    );
    let reference = fitted.iter().copied().find(|camera| !odd.contains(camera));
    let each = odd
        .into_iter()
        .filter(|camera| !told[*camera])
        .filter_map(|camera| one_mirrored(evidence, (camera, reference?), &hint));
    each.collect()
}

fn one_mirrored(
    evidence: &Evidence,
    (camera, reference): (usize, usize),
    hint: &str,
) -> Option<Proposal> {
    let own = evidence.seen[camera].as_ref()?.camera.rotation();
    let other = evidence.seen[reference].as_ref()?.camera.rotation();
    let between = own * other.transpose();
    let (right, down) = (between[(0, 0)], between[(1, 1)]);
    let (code, what) = if right.abs() + down.abs() < 1.0 {
        (
            "rows-columns-swapped",
            "the camera sees the board transposed: rows and columns are exchanged in every picture, or x and y of its pixels",
        )
    } else if right > down {
        (
            "v-axis-up",
            "the camera sees a world mirrored top to bottom: y of its pixels points up, or the order of the rows is reversed in every picture",
        )
    } else {
        (
            "picture-mirrored",
            "the camera sees a world mirrored left to right: x of its pixels points to the left, or the order within each row is reversed in every picture",
        )
    };
    Some(Proposal {
        cells: everywhere(evidence, camera),
        ..Proposal::itself(code, Severity::Warning, what.into(), hint)
    })
}

/// Cameras that lie on their side or stand on their head by the others' measure.
fn rolled(evidence: &Evidence, told: &[bool]) -> Vec<Proposal> {
    let upright = |camera: usize| {
        let seen = evidence.seen[camera].as_ref()?;
        let board = evidence.views.iter().find_map(|view| view.board.as_ref())?;
        // How far its x runs along the chart's columns.
        Some(seen.camera.rotation().row(0).transpose().dot(&board.along[0]))
    };
    let known: Vec<(usize, f64)> =
        (0..told.len()).filter_map(|camera| Some((camera, upright(camera)?))).collect();
    let Some((reference, _)) = known.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for (camera, _) in known {
        let (Some(own), Some(other)) = (&evidence.seen[camera], &evidence.seen[reference]) else {
            continue;
        };
        if told[camera] || own.camera.is_mirrored() != other.camera.is_mirrored() {
            continue;
        }
        let between = own.camera.rotation() * other.camera.rotation().transpose();
        let angle =
            libm::atan2(between[(1, 0)] - between[(0, 1)], between[(0, 0)] + between[(1, 1)]);
        if angle.abs() < 1.0 {
            continue;
        }
        let degrees = (angle.to_degrees() / 90.0).round() * 90.0;
        let quarters = ((degrees / 90.0).round() as i32).rem_euclid(4) as u8;
        // Either of the two may be the one that is read wrong.
        let mut either = [camera, reference].into_iter();
        let Some(turned) = either.find_map(|one| tells_apart(evidence, one, quarters)) else {
            continue;
        };
        let what = format!(
            "the board was read rotated by {degrees:.0} degrees in every picture, or the camera is mounted that way"
        );
        found.push(Proposal {
            cells: everywhere(evidence, camera),
            figures: vec![("roll against the other cameras, degrees".into(), angle.to_degrees()), ("median error with labels turned, px".into(), turned)],
            ..Proposal::itself("board-turned", Severity::Warning, what, "look at one picture of this camera: if it shows the scene upright, its labels are wrong and so will points be")
        });
    }
    found
}

/// Whether labels turned back fit as well, so that they may be what is wrong; their error then. Where
/// charts are tilted only one of the two fits.
fn tells_apart(evidence: &Evidence, camera: usize, quarters: u8) -> Option<f64> {
    let plain = evidence.overall(camera, None, |_, _, pair| Some(pair))?;
    let turned = [quarters, (4 - quarters) % 4].into_iter().filter_map(|quarters| {
        evidence.overall(camera, None, |view, _, (world, pixel)| {
            let board = evidence.views[view].board.as_ref()?;
            Some((board.mixed(world, Mixing::Turned(quarters))?, pixel))
        })
    });
    let turned = turned.fold(f64::INFINITY, f64::min);
    (turned < 2.0 * plain + 0.1).then_some(turned)
}
