//! Edges of the first picture found again in the second one, along the curves of the calibration.

use super::{
    curve::Waypoint,
    edges::{Edge, Edges, about},
    epipolar_curves::EpipolarCurves,
};
use crate::Ground;
use rayon::prelude::*;
use wheatstone_core::geometry::Pixel;

/// An edge of the first picture, and where it was found in the second.
#[derive(Clone, Copy, Debug)]
pub struct EdgeMatch {
    /// In the first picture.
    pub edge: Edge,
    /// In the second; none where it was not found, or could be one of several.
    pub other: Option<Pixel>,
    /// Cosine of the angle between gradient and curve: how sharply the curve cuts the edge.
    pub crossing: f64,
    /// Where it is on the floor, if the second picture has an edge like it where it would be then.
    pub floor: Option<Ground>,
}

/// A place where the curve of an edge cuts one of the second picture that looks like it.
#[derive(Clone, Copy)]
struct Candidate {
    /// How far along the curve, in waypoints.
    along: f64,
    other: Pixel,
    /// How unlike they are, 0 for alike.
    unlike: f32,
}

/// Every so many pixels along an edge one is matched.
const EVERY: isize = 4;

/// Curves that run along an edge do not tell where they cut it: the least cosine between the edge's
/// gradient and the curve.
const LEAST_CROSSING: f64 = 0.3;

/// Finds the edges of one picture in the other.
#[must_use]
pub(crate) fn match_edges(
    epipolar_curves: &EpipolarCurves,
    first: &Edges,
    second: &Edges,
) -> Vec<EdgeMatch> {
    let sampled: Vec<Edge> = first.all.iter().filter(|edge| is_sampled(edge)).copied().collect();
    let found: Vec<Found> =
        sampled.par_iter().map(|edge| find(epipolar_curves, edge, second)).collect();
    let chains = by_chain(&sampled);
    let beside = |index: usize| -> Vec<usize> {
        let edge = sampled[index];
        let near = |other: &usize| *other != index && near(&sampled[*other], &edge);
        chains[edge.chain as usize].iter().copied().filter(near).collect()
    };
    let neighbours: Vec<Vec<usize>> = (0..sampled.len()).into_par_iter().map(beside).collect();
    let among = |index: usize| -> Vec<&Found> {
        neighbours[index].iter().map(|other| &found[*other]).collect()
    };
    let floor: Vec<Option<Candidate>> = (0..sampled.len())
        .into_par_iter()
        .map(|index| on_floor(&found[index], &among(index)))
        .collect();
    // What the second picture shows of the floor is no obstacle's: a floor's edge that is hidden from it
    // would else be taken for its neighbour's.
    let taken = Taken::by(&floor, second);
    let free: Vec<Found> = found
        .iter()
        .map(|own| {
            let free = own.candidates.iter().filter(|candidate| !taken.at(candidate.other));
            Found { candidates: free.copied().collect(), ..*own }
        })
        .collect();
    let settle = |index: usize| -> Option<Candidate> {
        let own = &free[index];
        let beside: Vec<&Found> = neighbours[index].iter().map(|other| &free[*other]).collect();
        match own.crossing >= LEAST_CROSSING {
            true => floor[index].or_else(|| settled(&own.candidates, &beside)),
            false => None,
        }
    };
    let mut matched: Vec<Option<Candidate>> =
        (0..sampled.len()).into_par_iter().map(settle).collect();
    for chain in &chains {
        straighten(chain, &sampled, &mut matched);
    }
    let edge_match = |index: usize| EdgeMatch {
        edge: sampled[index],
        other: matched[index].map(|found| found.other),
        crossing: free[index].crossing,
        floor: floor[index].and(found[index].ground),
    };
    (0..sampled.len()).map(edge_match).collect()
}

/// Pixels of the second picture where edges of the floor were found.
struct Taken {
    pixels: Vec<bool>,
    width: usize,
}

impl Taken {
    fn by(floor: &[Option<Candidate>], second: &Edges) -> Self {
        let [width, height] = second.size();
        let mut pixels = vec![false; width * height];
        // Edges are sampled every few pixels; those between belong to the same.
        for (x, y) in floor.iter().flatten().flat_map(|found| about(found.other)) {
            if x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height {
                pixels[y as usize * width + x as usize] = true;
            }
        }
        Self { pixels, width }
    }

    fn at(&self, pixel: Pixel) -> bool {
        let (x, y) = (pixel.x.round().max(0.0) as usize, pixel.y.round().max(0.0) as usize);
        x < self.width && self.pixels.get(y * self.width + x).copied().unwrap_or(false)
    }
}

/// Whether an edge is one of those that stand for the others.
fn is_sampled(edge: &Edge) -> bool {
    let along_rows = edge.towards_light.y.abs() > edge.towards_light.x.abs();
    let place = if along_rows { edge.at.x } else { edge.at.y };
    (place.round() as isize).rem_euclid(EVERY) == 0
}

/// Neighbours along a chain see the same surface.
fn near(one: &Edge, other: &Edge) -> bool {
    const NEAR: f64 = 22.0;
    (one.at - other.at).norm_squared() < NEAR * NEAR
}

fn by_chain(edges: &[Edge]) -> Vec<Vec<usize>> {
    let count = edges.iter().map(|edge| edge.chain as usize + 1).max().unwrap_or(0);
    let mut chains = vec![Vec::new(); count];
    for (index, edge) in edges.iter().enumerate() {
        chains[edge.chain as usize].push(index);
    }
    chains
}

/// What the second picture has along the curve of an edge.
struct Found {
    crossing: f64,
    candidates: Vec<Candidate>,
    /// Where it is if it is on the floor.
    ground: Option<Ground>,
    /// An edge like it where it would be then.
    floor: Option<Candidate>,
}

fn find(epipolar_curves: &EpipolarCurves, edge: &Edge, second: &Edges) -> Found {
    let curve = epipolar_curves.curve(edge.at);
    let mut found = Found { crossing: 0.0, candidates: Vec::new(), ground: None, floor: None };
    let Some(overall) = curve.direction() else { return found };
    found.crossing = edge.towards_light.dot(&overall).abs();
    if let Some((along, at)) = curve.floor() {
        let like = like_at(edge, second, at.other);
        found.floor = like.map(|other| Candidate { along, other, unlike: 0.0 });
        found.ground = Some(Ground::new(at.point.x, at.point.z));
    }
    if found.crossing >= LEAST_CROSSING {
        for (level, piece) in curve.pieces().enumerate() {
            along_piece(edge, second, (level, piece), &mut found.candidates);
        }
    }
    found
}

/// The place nearest to `at` on an edge of the second picture that looks like `edge` and passes there.
fn like_at(edge: &Edge, second: &Edges, at: Pixel) -> Option<Pixel> {
    // The floor's edges are found this near to where they should be.
    const NEAR: f64 = 1.5;
    let mut best: Option<(f64, Pixel)> = None;
    for (x, y) in about(at) {
        let Some(other) = second.at(x, y) else { continue };
        let off = (other.at - at).dot(&other.towards_light);
        let nearer = best.is_none_or(|(known, _)| off.abs() < known);
        if off.abs() < NEAR && nearer && unlike(edge, other).is_some() {
            best = Some((off.abs(), at + other.towards_light * off));
        }
    }
    best.map(|(_, place)| place)
}

/// Where an edge is in the second picture if it is of the floor, as most of its neighbours along the chain
/// can be too: of what stands up a line may pass for the floor's at places, not all along.
fn on_floor(own: &Found, beside: &[&Found]) -> Option<Candidate> {
    let alike = beside.iter().filter(|other| other.floor.is_some()).count();
    own.floor.filter(|_| 4 * alike >= 3 * beside.len() && alike >= 2)
}

/// Goes from one waypoint to the next.
fn along_piece(
    edge: &Edge,
    second: &Edges,
    (level, [near, far]): (usize, [Waypoint; 2]),
    found: &mut Vec<Candidate>,
) {
    // Cut at a flatter angle than this (its sine) the place along the curve is a guess.
    const LEAST_SLOPE: f64 = 0.2;
    // So far from its place an edge is the straight line that it is there, in pixels.
    const STRAIGHT: f64 = 1.5;
    // Neighbours on one edge are cut within this, in waypoints: a pixel.
    const SAME: f64 = 0.3;
    let (start, by) = (near.other, far.other - near.other);
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
fn unlike(edge: &Edge, other: &Edge) -> Option<f32> {
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
fn settled(own: &[Candidate], beside: &[&Found]) -> Option<Candidate> {
    // A third of a waypoint is a pixel or two, what slanted surfaces shift over the neighbourhood.
    const AGREE: f64 = 0.5;
    // Of two candidates the better one is taken where it is better by an eighth of the neighbours.
    const CLEARLY: f64 = 0.12;
    let score = |candidate: &Candidate| {
        let support = beside
            .iter()
            .filter(|others| {
                others.candidates.iter().any(|o| (o.along - candidate.along).abs() < AGREE)
            })
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
fn straighten(chain: &[usize], edges: &[Edge], matched: &mut [Option<Candidate>]) {
    // Pixels place an edge to a tenth of a waypoint; rims are a little bent.
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
