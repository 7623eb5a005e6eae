//! Edges of the first picture found again in the second one, along the curves of the calibration.

use super::epipolar_curves::EpipolarCurves;
use crate::Ground;
use rayon::prelude::*;
use wheatstone_core::geometry::Pixel;
use wheatstone_reconstruction::features::{
    Candidate, Edge, EdgeNeighbours, Edges, LEAST_CROSSING, about, candidates, is_sampled, settled,
    straighten, unlike,
};

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
    let neighbours = EdgeNeighbours::of(&sampled);
    let among = |index: usize| -> Vec<&Found> {
        neighbours.of_edge[index].iter().map(|other| &found[*other]).collect()
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
        let beside: Vec<&[Candidate]> =
            neighbours.of_edge[index].iter().map(|other| &free[*other].candidates[..]).collect();
        match own.crossing >= LEAST_CROSSING {
            true => floor[index].or_else(|| settled(&own.candidates, &beside)),
            false => None,
        }
    };
    let mut matched: Vec<Option<Candidate>> =
        (0..sampled.len()).into_par_iter().map(settle).collect();
    for chain in &neighbours.chains {
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
    let seen = curve.seen();
    let Some(overall) = seen.direction() else { return found };
    found.crossing = edge.towards_light.dot(&overall).abs();
    if let Some((along, at)) = curve.floor() {
        let like = like_at(edge, second, at.other);
        found.floor = like.map(|other| Candidate { along, other, unlike: 0.0 });
        found.ground = Some(Ground::new(at.point.x, at.point.z));
    }
    if found.crossing >= LEAST_CROSSING {
        found.candidates = candidates(edge, second, &seen);
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
