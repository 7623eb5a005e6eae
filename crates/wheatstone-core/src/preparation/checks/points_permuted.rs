//! Points of a view whose pixels belong to other points of the same view, in no order that a board
//! has.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
    views::LEAST,
};
use wheatstone_numeric::statistics::median;

pub(super) struct PointsPermuted;

impl Fault for PointsPermuted {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for view in 0..evidence.views.len() {
            for camera in evidence.present(view) {
                found.extend(permuted(evidence, (view, camera)));
            }
        }
        found
    }

    fn of_picture(&self, evidence: &Evidence, picture: (usize, usize)) -> Vec<Proposal> {
        permuted(evidence, picture).into_iter().collect()
    }
}

fn permuted(evidence: &Evidence, cell: (usize, usize)) -> Option<Proposal> {
    let (points, seen, other) = evidence.at(cell.0, cell.1)?;
    let expected: Vec<_> = points.pairs.iter().map(|(world, _)| other.project(*world)).collect();
    let known: Vec<_> = expected.iter().flatten().copied().collect();
    let gaps: Vec<f64> = known
        .iter()
        .enumerate()
        .step_by(known.len().div_ceil(40).max(1))
        .map(|(own, place)| {
            let others = known.iter().enumerate().filter(|(index, _)| *index != own);
            others.map(|(_, p)| (p - place).norm()).fold(f64::INFINITY, f64::min)
        })
        .collect();
    // A pixel is another point's where it is much nearer to it than neighbours are to each other.
    let near = (0.25 * median(&gaps)).min(4.0 * seen.good() + 0.5);
    let mut own: Vec<Option<usize>> = (0..points.pairs.len()).map(Some).collect();
    let (mut wrong, mut others) = (0_usize, 0_usize);
    let mut left = Vec::new();
    for (index, (_, pixel)) in points.pairs.iter().enumerate() {
        let Some(at) = expected[index] else { continue };
        if (pixel - at).norm() <= 0.5 * median(&gaps) {
            continue;
        }
        wrong += 1;
        own[index] = None;
        let distance = |place: usize| expected[place].map_or(f64::INFINITY, |p| (p - pixel).norm());
        let nearest = (0..expected.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)))?;
        if distance(nearest) <= near {
            others += 1;
            own[index] = Some(nearest);
            left.push(distance(nearest));
        }
    }
    // Gross errors hit another point's place by chance only: rarely, and never nearly all of them.
    let by_chance = std::f64::consts::PI * near * near / median(&gaps).powi(2).max(1e-9);
    let enough = wrong >= LEAST.min(points.pairs.len() / 2).max(4);
    if !enough || (others as f64) < (0.75_f64).max(4.0 * by_chance) * wrong as f64 {
        return None;
    }
    Some(proposal(evidence, cell, &own, (wrong, median(&left) / seen.good())))
}

/// Pixels go to the points that they belong to; those that are no point's are left out.
fn proposal(
    evidence: &Evidence,
    cell: (usize, usize),
    own: &[Option<usize>],
    (wrong, left): (usize, f64),
) -> Proposal {
    let points = &evidence.cells[cell.0][cell.1];
    let mut pixels = vec![None; own.len()];
    for (from, to) in own.iter().enumerate() {
        if let Some(to) = to {
            pixels[*to] = Some(points.pairs[from].1);
        }
    }
    let changes = points
        .rows
        .iter()
        .zip(pixels)
        .map(|(row, to)| Change::Pixel { row: *row, camera: cell.1, to })
        .collect();
    Proposal {
        freedom: Freedom::Order,
        left: left.min(1.0),
        cells: vec![cell],
        figures: vec![("points with another point's pixel".into(), wrong as f64)],
        changes,
        // Which point some pixels belong to was not to be told.
        is_estimate: own.contains(&None),
        ..Proposal::itself(
            "points-permuted",
            Severity::Fatal,
            format!(
                "{wrong} of {} points carry pixels of other points of the view",
                points.pairs.len()
            ),
            "list the points of every picture in the order of the chart, or let them be reordered",
        )
    }
}
