//! Labels of the chart's points mixed up as a whole: the board turned, mirrored, transposed, listed in
//! another order.

use super::{
    Fault,
    board::{Board, Mixing},
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
};
use crate::geometry::Point3;

pub(super) struct BoardOrder;

impl Fault for BoardOrder {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let suspicious = evidence.suspicious().into_iter();
        together(evidence, suspicious.flat_map(|cell| each_mixing(evidence, cell)).collect())
    }

    fn of_picture(&self, evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
        each_mixing(evidence, picture).into_iter().map(|mixed| mixed.proposal).collect()
    }
}

/// Every way in which a picture's labels may be mixed up.
fn each_mixing(evidence: &Evidence, cell: (usize, usize)) -> Vec<Mixed> {
    let mut found = Vec::new();
    for board in boards(evidence, cell.0) {
        found
            .extend(Mixing::all().into_iter().filter_map(|how| mixed(evidence, cell, &board, how)));
    }
    let others = [reversed, axes_exchanged].map(|how| how(evidence, cell));
    found.extend(others.into_iter().flatten().map(Mixed::of_labels));
    found
}

/// The view's board; and where other views show more of the chart, every way in which it may go on.
fn boards(evidence: &Evidence, view: usize) -> Vec<Board> {
    // A few rows may be out of the picture; where many are, the lattice says little.
    const MOST_MISSING: usize = 3;
    let Some(own) = &evidence.views[view].board else { return Vec::new() };
    let missing = [0, 1].map(|axis| {
        let alike = evidence
            .views
            .iter()
            .filter_map(|other| other.board.as_ref())
            .filter(|other| (other.pitch[axis] / own.pitch[axis] - 1.0).abs() < 0.01);
        let most = alike.map(|other| other.counts[axis]).max().unwrap_or(0);
        most.saturating_sub(own.counts[axis]).min(MOST_MISSING)
    });
    let mut all = vec![own.clone()];
    if missing == [0, 0] {
        return all;
    }
    for before_first in 0..=missing[0] {
        for before_second in 0..=missing[1] {
            let mut board = own.clone();
            for (axis, before) in [before_first, before_second].into_iter().enumerate() {
                let shift = (missing[axis] as f64 / 2.0 - before as f64) * own.pitch[axis];
                board.centre += own.along[axis] * shift;
                board.counts[axis] += missing[axis];
            }
            all.push(board);
        }
    }
    all
}

/// Labels of a picture mixed up.
#[derive(Clone)]
struct Mixed {
    proposal: Proposal,
    /// Where all points of the view really are, if it is so in every camera; `None` where not all are told.
    places: Option<Vec<Change>>,
}

impl Mixed {
    fn of_labels(proposal: Proposal) -> Self {
        Self { proposal, places: None }
    }
}

/// What a mixing is called, and in words.
pub(super) fn naming(how: Mixing) -> (&'static str, String) {
    match how {
        Mixing::Turned(2) => (
            "board-turned",
            "the board was read rotated by 180 degrees (its points in reversed order)".into(),
        ),
        Mixing::Turned(quarters) => (
            "board-turned",
            format!("the board was read rotated by {} degrees", u16::from(quarters) * 90),
        ),
        Mixing::Reversed(0) => ("board-mirrored", "the order within each row is reversed".into()),
        Mixing::Reversed(_) => ("board-mirrored", "the order of the rows is reversed".into()),
        Mixing::Transposed(_) | Mixing::AntiTransposed => {
            ("rows-columns-swapped", "rows and columns of the board are exchanged".into())
        }
        Mixing::Relisted(_) => (
            "rows-columns-swapped",
            "the points are listed column by column, the labels row by row (rows and columns exchanged)".into(),
        ),
        Mixing::Shifted(_) => {
            ("board-shifted", "the points are labelled one column or row off".into())
        }
    }
}

fn mixed(evidence: &Evidence, cell: (usize, usize), board: &Board, how: Mixing) -> Option<Mixed> {
    let left =
        evidence.explained(cell, |_, (world, pixel)| Some((board.mixed(world, how)?, pixel)));
    if !evidence.accepts(cell, left) {
        return None;
    }
    let places = |world: Point3| board.mixed(world, how);
    let (code, what) = naming(how);
    let changes = relabelled(evidence, cell, places);
    let place = |row: &usize| {
        let world = evidence.frame.scaled(evidence.data.correspondences[*row].world?);
        Some(Change::World { row: *row, to: evidence.frame.world(places(world)?) })
    };
    Some(Mixed {
        proposal: proposal(cell, left, code, (format!("{how:?}"), what), changes),
        places: evidence.views[cell.0].rows.iter().map(place).collect(),
    })
}

fn proposal(
    cell: (usize, usize),
    left: f64,
    code: &'static str,
    (key, what): (String, String),
    changes: Vec<Change>,
) -> Proposal {
    Proposal {
        freedom: Freedom::Choice,
        left,
        cells: vec![cell],
        key,
        changes,
        ..Proposal::itself(
            code,
            Severity::Fatal,
            what,
            "read the board in the same order in every picture, or let the labels be corrected",
        )
    }
}

/// Pixels of a cell moved to the rows whose places they really belong to; lost where no row has the
/// place.
pub(super) fn relabelled(
    evidence: &Evidence,
    (view, camera): (usize, usize),
    place: impl Fn(Point3) -> Option<Point3>,
) -> Vec<Change> {
    let rows = &evidence.views[view].rows;
    let known: Vec<(usize, Point3)> = rows
        .iter()
        .filter_map(|row| {
            Some((*row, evidence.frame.scaled(evidence.data.correspondences[*row].world?)))
        })
        .collect();
    let cell = &evidence.cells[view][camera];
    let mut pixels = vec![None; known.len()];
    for (world, pixel) in &cell.pairs {
        let Some(real) = place(*world) else { continue };
        let nearest = (0..known.len())
            .min_by(|a, b| (known[*a].1 - real).norm().total_cmp(&(known[*b].1 - real).norm()));
        if let Some(index) = nearest {
            let tolerance = 0.3 * neighbour_distance(&known, index);
            if (known[index].1 - real).norm() < tolerance {
                pixels[index] = Some(*pixel);
            }
        }
    }
    known.iter().zip(pixels).map(|((row, _), to)| Change::Pixel { row: *row, camera, to }).collect()
}

fn neighbour_distance(known: &[(usize, Point3)], own: usize) -> f64 {
    let others = known.iter().enumerate().filter(|(index, _)| *index != own);
    others.map(|(_, (_, place))| (place - known[own].1).norm()).fold(f64::INFINITY, f64::min)
}

/// The list of points that the camera saw, from its end.
fn reversed(evidence: &Evidence, cell: (usize, usize)) -> Option<Proposal> {
    let pairs = &evidence.cells[cell.0][cell.1].pairs;
    let last = pairs.len().checked_sub(1)?;
    let left = evidence.explained(cell, |index, (_, pixel)| Some((pairs[last - index].0, pixel)));
    if !evidence.accepts(cell, left) {
        return None;
    }
    let place = |world: Point3| {
        let own = pairs.iter().position(|(place, _)| *place == world)?;
        Some(pairs[last - own].0)
    };
    // Where the whole lattice is there this is half a turn: one name for both.
    let half = Mixing::Turned(2);
    let (code, what) = naming(half);
    let changes = relabelled(evidence, cell, place);
    Some(proposal(cell, left, code, (format!("{half:?}"), what), changes))
}

/// World axes exchanged in the view.
fn axes_exchanged(evidence: &Evidence, cell: (usize, usize)) -> Option<Proposal> {
    let frame = &evidence.frame;
    for (a, b, names) in [(0, 1, "X and Y"), (0, 2, "X and Z"), (1, 2, "Y and Z")] {
        let exchanged = |world: Point3| {
            let mut place = frame.world(world);
            place.coords.swap_rows(a, b);
            frame.scaled(place)
        };
        let left = evidence.explained(cell, |_, (world, pixel)| Some((exchanged(world), pixel)));
        if evidence.accepts(cell, left) {
            let what = format!("the columns {names} are exchanged (rows and columns of the board)");
            let rows = &evidence.cells[cell.0][cell.1].rows;
            let change = |row: &usize| {
                let mut to = evidence.data.correspondences[*row].world?;
                to.coords.swap_rows(a, b);
                Some(Change::World { row: *row, to })
            };
            let changes = rows.iter().filter_map(change).collect();
            return Some(proposal(
                cell,
                left,
                "rows-columns-swapped",
                (names.into(), what),
                changes,
            ));
        }
    }
    None
}

/// The same mixing in all cameras of a view is one fault: then it is the view's places that are wrong, and they are
/// changed where changed labels would lose points.
fn together(evidence: &Evidence, found: Vec<Mixed>) -> Vec<Proposal> {
    let mut all: Vec<Proposal> = Vec::new();
    for view in 0..evidence.views.len() {
        let here: Vec<&Mixed> = found.iter().filter(|m| m.proposal.cells[0].0 == view).collect();
        let present = evidence.present(view);
        for one in here.iter().map(|m| &m.proposal) {
            let mut same: Vec<&Mixed> = Vec::new();
            for other in &here {
                let alike = other.proposal.key == one.key && other.proposal.code == one.code;
                if alike && same.iter().all(|m| m.proposal.cells != other.proposal.cells) {
                    same.push(other);
                }
            }
            if same.len() != present.len() || present.len() == 1 {
                all.push(one.clone());
            } else if same[0].proposal.cells == one.cells {
                all.push(joined(evidence, &same));
            }
        }
    }
    all
}

/// One fault of a view from those of its cameras.
fn joined(evidence: &Evidence, same: &[&Mixed]) -> Proposal {
    let proposals = || same.iter().map(|m| &m.proposal);
    let changes: Vec<Change> = proposals().flat_map(|p| p.changes.clone()).collect();
    let is_kept = |change: &&Change| matches!(change, Change::Pixel { to: Some(_), .. });
    let cells: Vec<(usize, usize)> = proposals().flat_map(|p| p.cells.clone()).collect();
    let seen: usize =
        cells.iter().map(|(view, camera)| evidence.cells[*view][*camera].rows.len()).sum();
    let loses = changes.iter().filter(is_kept).count() < seen;
    let places = same[0].places.clone().filter(|_| loses);
    Proposal {
        cells,
        changes: places.unwrap_or(changes),
        left: proposals().map(|p| p.left).fold(0.0, f64::max),
        ..same[0].proposal.clone()
    }
}
