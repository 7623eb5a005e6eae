//! Corners and edges of the reference camera's picture, found in the other cameras' along epipolar curves.

use crate::{
    features::{
        Candidate, Corner, Edge, Edges, Gradient, Look, aligned_along, corners, is_sampled, look,
        match_corners, match_edges,
    },
    pair::RectifiedPair,
    seen::{Found, Seen},
    settings::ReconstructionSettings,
};
use rayon::prelude::*;
use std::collections::BTreeMap;
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{Result, geometry::Pixel};
use wheatstone_stereo::{DisparityMap, PairJudgement};

/// What a picture shows that can be found again.
pub(crate) struct Features {
    gradient: Gradient,
    corners: Vec<Corner>,
    edges: Edges,
    /// Those edges that stand for the others.
    sampled: Vec<Edge>,
}

/// More than a picture of twelve million pixels has.
const MOST_CORNERS: usize = 50_000;

impl Features {
    pub(crate) fn of(picture: &ColourImage) -> Self {
        let gradient = Gradient::new(&picture.gray.stretched());
        let (corners, edges) =
            rayon::join(|| corners(&gradient, MOST_CORNERS), || Edges::new(&gradient));
        let sampled = edges.all.iter().filter(|edge| is_sampled(edge)).copied().collect();
        Self { gradient, corners, edges, sampled }
    }

    /// Where they are: corners, then edges.
    fn places(&self) -> impl Iterator<Item = Pixel> {
        let corners = self.corners.iter().map(|corner| corner.at);
        corners.chain(self.sampled.iter().map(|edge| edge.at))
    }
}

/// A corner may lie so many pixels beside its curve: calibrations err, and noise does.
const ASIDE: f64 = 1.0;

/// How alike windows of a feature are at least.
const LEAST_LIKENESS: f32 = 0.85;

/// The standard deviation of a feature along its curve over what it would be if noise were white and no surface slanted,
/// as measured on scenes through six optics: then 65 to 71 % of the errors are within one, 92 to 96 % within two.
const SIGMA: f64 = 3.9;

/// The share of features whose matches are less than a pixel off: 0.978 to 1 on the same scenes.
const CONFIDENCE: f32 = 0.98;

/// What one pair matches with features of its reference camera's picture, in the order of [`Features::places`], and what
/// is said of it. Pictures are those of the pair's cameras.
pub(crate) fn search(
    pair: &RectifiedPair<'_>,
    pictures: [&ColourImage; 2],
    reference: &Features,
) -> Result<(Vec<Option<Found>>, PairJudgement)> {
    let other = Features::of(pictures[1]);
    let found = matched(pair, reference, &other);
    let exchanged = || Ok(density(&other, &matched(pair, &other, reference)));
    let judged = pair.judged(&pair.rectified(pictures), density(reference, &found), exchanged)?;
    Ok((found, judged))
}

/// What one pair matches with the features of its reference camera's picture, in the order of [`Features::places`].
fn matched(pair: &RectifiedPair<'_>, reference: &Features, other: &Features) -> Vec<Option<Found>> {
    let curve = |pixel: Pixel| pair.curve(pixel);
    let corners =
        match_corners(&curve, &reference.corners, (&other.corners, &other.gradient), ASIDE);
    let key = |pixel: Pixel| (pixel.y as i64, pixel.x as i64);
    let corners: BTreeMap<_, _> = corners.iter().map(|found| (key(found.first), found)).collect();
    let of_corner = |corner: &Corner| {
        let found = corners.get(&key(corner.at))?;
        refined(pair, (corner.at, &corner.look), (found.second, other))
    };
    let edges = match_edges(&curve, &reference.sampled, &other.edges);
    let of_edge = |(edge, found): (&Edge, &Option<Candidate>)| {
        let look = look(&reference.gradient.smooth, edge.at)?;
        refined(pair, (edge.at, &look), (found.as_ref()?.other, other))
    };
    let corners: Vec<_> = reference.corners.par_iter().map(of_corner).collect();
    let edges: Vec<_> = reference.sampled.par_iter().zip(&edges).map(of_edge).collect();
    [corners, edges].concat()
}

/// A feature's place along its curve, to a fraction of a pixel.
fn refined(
    pair: &RectifiedPair<'_>,
    (pixel, look): (Pixel, &Look),
    (start, other): (Pixel, &Features),
) -> Option<Found> {
    let curve = pair.curve(pixel);
    let way = curve.way(curve.nearest(start)?.piece)?;
    let found = aligned_along(look, &other.gradient, (start, way))?;
    let along = curve.nearest(found.at)?;
    let sigma = SIGMA / way.dot(&(found.information * way)).sqrt();
    let along = along.piece as f64 + along.share;
    let is_like = found.likeness > LEAST_LIKENESS;
    is_like.then(|| pair.on_curve(pixel, (along, sigma), CONFIDENCE))?
}

/// The share of the corners that one pair matches.
fn density(reference: &Features, found: &[Option<Found>]) -> f64 {
    let corners = reference.corners.len();
    let matched = found.iter().take(corners).filter(|found| found.is_some()).count();
    matched as f64 / corners.max(1) as f64
}

/// What the pairs match with features of the reference camera's picture: of those in one pixel of the left rectified
/// picture the one that most of them see.
pub(crate) fn seen(
    pairs: &[RectifiedPair<'_>],
    reference: &Features,
    found: &[Option<Vec<Option<Found>>>],
    settings: &ReconstructionSettings,
) -> Seen {
    let pixels: Vec<[f64; 2]> = reference.places().map(|at| [at.x, at.y]).collect();
    let count = |index: usize| found.iter().flatten().filter(|pair| pair[index].is_some()).count();
    let mut kept: BTreeMap<u32, usize> = BTreeMap::new();
    for (place, index) in places(&pairs[0], &pixels, settings) {
        let best = kept.entry(place).or_insert(index);
        if count(index) > count(*best) {
            *best = index;
        }
    }
    at_pixels(pairs, &pixels, found, kept)
}

/// The pixels of the left rectified picture that show pixels of the reference camera's own, each with its place in the
/// list; those that are not wanted are left out.
pub(crate) fn places(
    pair: &RectifiedPair<'_>,
    pixels: &[[f64; 2]],
    settings: &ReconstructionSettings,
) -> Vec<(u32, usize)> {
    let wanted = pixels.iter().enumerate().filter(|(_, pixel)| settings.holds(**pixel));
    wanted.filter_map(|(index, pixel)| Some((pair.rectified_pixel(*pixel)?, index))).collect()
}

/// What the pairs match with pixels of the reference camera's picture, those that are found at `places`.
pub(crate) fn at_pixels(
    pairs: &[RectifiedPair<'_>],
    pixels: &[[f64; 2]],
    found: &[Option<Vec<Option<Found>>>],
    places: impl IntoIterator<Item = (u32, usize)>,
) -> Seen {
    let mut seen = Seen::new(pairs.len());
    for (place, index) in places {
        let of_pairs: Vec<Option<Found>> =
            found.iter().map(|pair| pair.as_ref().and_then(|pair| pair[index])).collect();
        // What a camera does not find of a feature says nothing.
        if of_pairs.iter().any(Option::is_some) {
            seen.push((place, pixels[index]), (&of_pairs, 0));
        }
    }
    seen
}

/// What features say of the first pair's disparities.
pub(crate) fn map(pair: &RectifiedPair<'_>, seen: &Seen) -> Option<DisparityMap> {
    let [width, height] = pair.rectification.pair.size.map(|side| side as usize);
    let mut map = DisparityMap::given(width, vec![f32::NAN; width * height], 1.0)?;
    for (place, found) in seen.places.iter().zip(&seen.found[0]) {
        if let Some(found) = found {
            let place = *place as usize;
            map.disparity[place] = found.disparity as f32;
            map.confidence[place] = found.confidence;
            map.sigma[place] = found.sigma as f32;
        }
    }
    Some(map)
}
