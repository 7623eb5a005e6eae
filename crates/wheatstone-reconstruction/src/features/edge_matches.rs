//! Edges of the first picture found again in the second one, along epipolar curves.
//!
//! An edge by itself looks like many others. What decides is its neighbours along the edge: they lie on one surface, so
//! that they are found at about the same place along their curves.

use super::{
    edges::{Edge, Edges},
    epipolar_curve::EpipolarCurve,
};
use rayon::prelude::*;
use wheatstone_core::geometry::Pixel;

/// A place where the curve of an edge cuts one of the second picture that looks like it.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// How far along the curve: the number of a place, and how far it is to the next.
    pub along: f64,
    /// In the second picture.
    pub other: Pixel,
    /// How unlike they are, 0 for alike.
    pub unlike: f32,
}

/// Every so many pixels along an edge one is matched.
const EVERY: isize = 4;

/// Curves that run along an edge do not tell where they cut it: the least cosine between the edge's
/// gradient and the curve.
pub const LEAST_CROSSING: f64 = 0.3;

/// Finds edges of one picture in the other; `None` where an edge is not found, or could be one of several. `curve` says
/// where the second picture shows a pixel of the first one.
#[must_use]
pub fn match_edges(
    curve: &(impl Fn(Pixel) -> EpipolarCurve + Sync),
    sampled: &[Edge],
    second: &Edges,
) -> Vec<Option<Candidate>> {
    let found: Vec<Vec<Candidate>> = sampled
        .par_iter()
        .map(|edge| {
            let curve = curve(edge.at);
            let crossing = curve.direction().map_or(0.0, |way| edge.towards_light.dot(&way).abs());
            if crossing < LEAST_CROSSING { Vec::new() } else { candidates(edge, second, &curve) }
        })
        .collect();
    let neighbours = EdgeNeighbours::of(sampled);
    let settle = |index: usize| {
        let beside: Vec<&[Candidate]> =
            neighbours.of_edge[index].iter().map(|other| &found[*other][..]).collect();
        settled(&found[index], &beside)
    };
    let mut matched: Vec<Option<Candidate>> =
        (0..sampled.len()).into_par_iter().map(settle).collect();
    for chain in &neighbours.chains {
        straighten(chain, sampled, &mut matched);
    }
    matched
}

/// Whether an edge is one of those that stand for the others.
#[must_use]
pub fn is_sampled(edge: &Edge) -> bool {
    let along_rows = edge.towards_light.y.abs() > edge.towards_light.x.abs();
    let place = if along_rows { edge.at.x } else { edge.at.y };
    (place.round() as isize).rem_euclid(EVERY) == 0
}

/// Neighbours along a chain see the same surface.
fn near(one: &Edge, other: &Edge) -> bool {
    const NEAR: f64 = 22.0;
    (one.at - other.at).norm_squared() < NEAR * NEAR
}

/// Which edges belong together.
pub struct EdgeNeighbours {
    /// Edges by the chain that they belong to.
    pub chains: Vec<Vec<usize>>,
    /// Of each edge, those near it on its chain.
    pub of_edge: Vec<Vec<usize>>,
}

impl EdgeNeighbours {
    /// Of these edges.
    #[must_use]
    pub fn of(sampled: &[Edge]) -> Self {
        let chains = by_chain(sampled);
        let beside = |index: usize| -> Vec<usize> {
            let edge = sampled[index];
            let near = |other: &usize| *other != index && near(&sampled[*other], &edge);
            chains[edge.chain as usize].iter().copied().filter(near).collect()
        };
        let of_edge = (0..sampled.len()).into_par_iter().map(beside).collect();
        Self { chains, of_edge }
    }
}

fn by_chain(edges: &[Edge]) -> Vec<Vec<usize>> {
    let count = edges.iter().map(|edge| edge.chain as usize + 1).max().unwrap_or(0);
    let mut chains = vec![Vec::new(); count];
    for (index, edge) in edges.iter().enumerate() {
        chains[edge.chain as usize].push(index);
    }
    chains
}

/// Where the curve of an edge cuts edges of the second picture that look like it.
#[must_use]
pub fn candidates(edge: &Edge, second: &Edges, curve: &EpipolarCurve) -> Vec<Candidate> {
    let mut found = Vec::new();
    for (level, piece) in curve.pieces() {
        along_piece(edge, second, (level, piece), &mut found);
    }
    found
}

/// Goes from one place of a curve to the next.
fn along_piece(
    edge: &Edge,
    second: &Edges,
    (level, [near, far]): (usize, [Pixel; 2]),
    found: &mut Vec<Candidate>,
) {
    // Cut at a flatter angle than this (its sine) the place along the curve is a guess.
    const LEAST_SLOPE: f64 = 0.2;
    // So far from its place an edge is the straight line that it is there, in pixels.
    const STRAIGHT: f64 = 1.5;
    // Neighbours on one edge are cut within this, in places of the curve: a pixel.
    const SAME: f64 = 0.3;
    let (start, by) = (near, far - near);
    let length = by.norm();
    let steps = length.ceil().max(1.0) as usize;
    let mut last: Option<*const Edge> = None;
    for step in 0..steps {
        let at = start + by * (step as f64 / steps as f64);
        let (x, y) = (nearest(at.x), nearest(at.y));
        if !second.is_near(x, y) {
            continue;
        }
        for beside in [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)] {
            let Some(other) = second.at(x + beside.0, y + beside.1) else { continue };
            if last.is_some_and(|last| std::ptr::eq(last, other)) {
                continue;
            }
            last = Some(other);
            let Some(unlike) = unlike(edge, other) else { continue };
            // Where the curve cuts the straight line that the edge is nearby.
            let slope = by.dot(&other.towards_light);
            if slope.abs() < LEAST_SLOPE * length {
                continue;
            }
            let share = (other.at - start).dot(&other.towards_light) / slope;
            let cut = start + by * share;
            if (cut - other.at).norm() > STRAIGHT {
                continue;
            }
            let along = level as f64 + share;
            match found.iter_mut().find(|known| (known.along - along).abs() < SAME) {
                Some(known) if known.unlike <= unlike => {}
                Some(known) => *known = Candidate { along, other: cut, unlike },
                None => found.push(Candidate { along, other: cut, unlike }),
            }
        }
    }
}

/// The pixel nearest to a place on the picture or beside it, along one axis: a few instructions, where
/// rounding takes a call.
fn nearest(place: f64) -> isize {
    (place.clamp(-2.0, 1e9) + 2.5) as isize - 2
}

/// How unlike two edges are; `None` where they cannot be the same.
#[must_use]
pub fn unlike(edge: &Edge, other: &Edge) -> Option<f32> {
    // Cameras turned by some degrees to each other, see the same edge alike turned; of one aslant a
    // camera observes a little more.
    const TURNED: f64 = 0.9;
    // Lights differ over the pictures, by a third at most; what lies behind an edge may differ too.
    const CONTRAST: f32 = 0.35;
    const GREY: f32 = 0.5;
    let turned = edge.towards_light.dot(&other.towards_light);
    let contrast = (edge.contrast - other.contrast).abs();
    let grey = (edge.grey - other.grey).abs();
    (turned > TURNED && contrast < CONTRAST && grey < GREY)
        .then(|| contrast / CONTRAST + 0.3 * grey / GREY + 2.0 * (1.0 - turned as f32))
}

/// The candidate that the neighbours along the edge agree with; none where two are as good.
#[must_use]
pub fn settled(own: &[Candidate], beside: &[&[Candidate]]) -> Option<Candidate> {
    // A third of the way to the next place is a pixel or two, what slanted surfaces shift over the neighbourhood.
    const AGREE: f64 = 0.5;
    // Of two candidates the better one is taken where it is better by an eighth of the neighbours.
    const CLEARLY: f64 = 0.12;
    let score = |candidate: &Candidate| {
        let support = beside
            .iter()
            .filter(|others| others.iter().any(|o| (o.along - candidate.along).abs() < AGREE))
            .count();
        (support, support as f64 / beside.len().max(1) as f64 - 0.5 * f64::from(candidate.unlike))
    };
    let mut scored: Vec<(usize, f64, &Candidate)> = own
        .iter()
        .map(|candidate| {
            let (support, worth) = score(candidate);
            (support, worth, candidate)
        })
        .collect();
    scored.sort_by(|a, b| b.1.total_cmp(&a.1));
    match scored[..] {
        [(support, ..), (_, next, _), ..] if support < 2 || scored[0].1 - next < CLEARLY => None,
        [(support, _, best), ..] if 2 * support >= beside.len() && support >= 2 => Some(*best),
        _ => None,
    }
}

/// Drops what does not lie on one straight line in space with most of its chain: over the picture of a
/// straight edge the inverse distance changes evenly, and so does the place along the curves.
pub fn straighten(chain: &[usize], edges: &[Edge], matched: &mut [Option<Candidate>]) {
    // Pixels place an edge to a tenth of that way; rims are a little bent.
    const AGREE: f64 = 0.35;
    const LEAST: usize = 5;
    let found: Vec<(usize, f64)> =
        chain.iter().filter_map(|index| Some((*index, matched[*index]?.along))).collect();
    if found.len() < LEAST {
        return;
    }
    let [first, last] = [found[0].0, found[found.len() - 1].0].map(|index| edges[index].at);
    let Some(direction) = (last - first).try_normalize(1e-9) else { return };
    let points: Vec<[f64; 2]> = found
        .iter()
        .map(|(index, along)| [(edges[*index].at - first).dot(&direction), *along])
        .collect();
    let mut best: Vec<bool> = Vec::new();
    let mut most = 0;
    // Pairs a third of the chain apart tell its slope; all of those that start at every point are few.
    let apart = (points.len() / 3).max(1);
    for (start, end) in points.iter().zip(&points[apart..]) {
        let slope = (end[1] - start[1]) / (end[0] - start[0]);
        if !slope.is_finite() {
            continue;
        }
        let agrees =
            |point: &[f64; 2]| (point[1] - start[1] - slope * (point[0] - start[0])).abs() < AGREE;
        let agreeing: Vec<bool> = points.iter().map(agrees).collect();
        let count = agreeing.iter().filter(|agrees| **agrees).count();
        if count > most {
            (best, most) = (agreeing, count);
        }
    }
    // A chain that runs on over several edges has no one line.
    if 2 * most < points.len() {
        return;
    }
    for ((index, _), agrees) in found.iter().zip(best) {
        if !agrees {
            matched[*index] = None;
        }
    }
}
