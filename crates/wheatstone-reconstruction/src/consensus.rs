//! Which of several pairs' depths at a pixel are right.

use crate::{
    pair::RectifiedPair,
    points::PointEstimator,
    seen::{Found, Seen},
};
use wheatstone_core::geometry::{Point3, Pose};

/// What the pairs agree on, as far as that is right with a probability of `least`. Of a single pair it is all.
pub(crate) fn agreed(
    pairs: &[RectifiedPair<'_>],
    map: &PointEstimator<'_>,
    seen: Seen,
    least: f32,
) -> Seen {
    if pairs.len() == 1 {
        return seen;
    }
    let candidates: Vec<Vec<Option<Candidate>>> =
        (0..pairs.len()).map(|pair| depths(pairs, map, &seen, pair)).collect();
    let mut agreed = Seen { pixel_sigma: seen.pixel_sigma, ..Seen::new(pairs.len()) };
    for (index, place) in seen.places.iter().enumerate() {
        let of_pixel: Vec<_> = candidates.iter().map(|pair| pair[index]).collect();
        let missed = seen.missed[index];
        let (kept, probability) = consensus(&of_pixel, missed);
        let kept = kept.into_iter().zip(&seen.found);
        let found: Vec<_> = kept.map(|(kept, pair)| pair[index].filter(|_| kept)).collect();
        if probability as f32 >= least {
            agreed.push((*place, seen.reference[index]), (&found, missed));
            agreed.confidence[agreed.places.len() - 1] = probability as f32;
        }
    }
    agreed
}

/// The depths that one pair sees, in the frame of the left virtual camera.
pub(crate) fn depths(
    pairs: &[RectifiedPair<'_>],
    map: &PointEstimator<'_>,
    seen: &Seen,
    pair: usize,
) -> Vec<Option<Candidate>> {
    let frame = pairs[0].rectification.pair.rectified_from_world;
    let found = &seen.found[pair];
    let of_lattice = |found: &Option<Found>| by_lattice(&frame, found.as_ref()?);
    let mut candidates: Vec<_> = found.iter().map(of_lattice).collect();
    let rest: Vec<(usize, Found)> = found
        .iter()
        .enumerate()
        .filter_map(|(index, found)| Some((index, found.filter(|found| found.point.is_none())?)))
        .collect();
    let matched: Vec<_> =
        rest.iter().map(|(index, found)| (seen.reference[*index], *found)).collect();
    let asked = by_map(&frame, map, &pairs[pair].cameras, &matched);
    for ((index, _), asked) in rest.iter().zip(asked) {
        candidates[*index] = Some(asked);
    }
    candidates.into_iter().map(|own| own.filter(|own| own.sigma.is_finite())).collect()
}

/// The depth that a pair's lattice says.
fn by_lattice(frame: &Pose, found: &Found) -> Option<Candidate> {
    let point = found.point?;
    let nearness = frame.transform(point.place).z.recip();
    let by = (frame.rotation * point.slope).z * nearness * nearness;
    Some(Candidate::new(nearness, by * found.sigma, found))
}

/// The depths that the map says of two cameras' pixels, those of the reference first.
fn by_map(
    frame: &Pose,
    map: &PointEstimator<'_>,
    cameras: &[usize; 2],
    matched: &[([f64; 2], Found)],
) -> Vec<Candidate> {
    let column = |of: &dyn Fn(&[f64; 2], &Found) -> f64| -> Vec<f64> {
        matched.iter().map(|(reference, found)| of(reference, found)).collect()
    };
    let nearness = |deviations: f64| -> Vec<f64> {
        let pixels = [
            [0, 1].map(|axis| column(&|reference, _| reference[axis])),
            [0, 1].map(|axis| {
                column(&|_, Found { at, .. }| at.pixel[axis] + deviations * at.deviation[axis])
            }),
        ];
        let [x, y, z] = map.places(cameras, &pixels);
        let places = x.into_iter().zip(y).zip(z).map(|((x, y), z)| Point3::new(x, y, z));
        places.map(|place| frame.transform(place).z.recip()).collect()
    };
    let both = nearness(0.0).into_iter().zip(nearness(1.0)).zip(matched);
    both.map(|((at, moved), (_, found))| Candidate::new(at, moved - at, found)).collect()
}

/// What a pair of cameras says of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// The reciprocal of the depth, and its standard deviation without what is added for doubt: that is in the probability.
    pub(crate) nearness: f64,
    pub(crate) sigma: f64,
    /// The probability that it is right.
    confidence: f64,
}

impl Candidate {
    fn new(nearness: f64, deviation: f64, found: &Found) -> Self {
        let (sigma, confidence) = (deviation.abs() / found.doubt, f64::from(found.confidence));
        Self { nearness, sigma, confidence }
    }
}

/// Depths agree that are within so many standard deviations of their difference. On scenes of four cameras 3 leaves one point
/// in a hundred fewer, for errors have longer tails than normal ones; 5 leaves an eighth more gross errors.
pub(crate) const MOST_SIGMAS: f64 = 4.0;

/// By how much less probable a depth is that another pair should see and does not. On scenes of four cameras most gross
/// errors are where two of three pairs agree, at edges of depth: 0.3 leaves half as many of them as 0.5, for a fiftieth of
/// the points.
const MISSED: f64 = 0.3;

/// Which of the candidates agree on the most probable depth, and the probability that it is right. `missed` other pairs
/// should see something there, and do not.
///
/// By Bayes' rule: a depth is right if all that agree on it are right and all others wrong, another is right if these
/// are wrong, or none is. Wrong matches agree as a rule: windows about one pixel smear alike at an edge of depth,
/// whichever picture they are compared with.
fn consensus(candidates: &[Option<Candidate>], missed: usize) -> (Vec<bool>, f64) {
    let agree = |a: &Candidate, b: &Candidate| {
        (a.nearness - b.nearness).abs()
            < MOST_SIGMAS * (a.sigma * a.sigma + b.sigma * b.sigma).sqrt()
    };
    // Relative to that all are wrong.
    let odds =
        |candidate: &Candidate| candidate.confidence / (1.0 - candidate.confidence).max(1e-6);
    let supporters = |leader: &Candidate| -> Vec<bool> {
        candidates.iter().map(|own| own.as_ref().is_some_and(|own| agree(own, leader))).collect()
    };
    let weight = |kept: &[bool]| -> f64 {
        let kept = candidates.iter().zip(kept).filter(|(_, kept)| **kept);
        kept.filter_map(|(own, _)| own.as_ref().map(odds)).product()
    };
    let sets = candidates.iter().flatten().map(supporters);
    let best = sets.max_by(|a, b| weight(a).total_cmp(&weight(b)));
    let Some(kept) = best else { return (vec![false; candidates.len()], 0.0) };
    let others = candidates.iter().zip(&kept).filter(|(_, kept)| !**kept);
    let others: f64 = others.filter_map(|(own, _)| own.as_ref().map(odds)).sum();
    let right = weight(&kept) * MISSED.powi(missed as i32);
    (kept, right / (right + others + 1.0))
}

#[cfg(test)]
mod tests {
    use super::{Candidate, consensus};

    fn candidate(nearness: f64, confidence: f64) -> Option<Candidate> {
        Some(Candidate { nearness, sigma: 0.01, confidence })
    }

    #[test]
    fn a_single_pair_is_as_sure_as_it_says() {
        let (kept, probability) = consensus(&[None, candidate(1.0, 0.8)], 0);
        assert_eq!(kept, [false, true]);
        assert!((probability - 0.8).abs() < 1e-9);
        assert!((consensus(&[None, candidate(1.0, 0.8)], 1).1 - 1.2 / 2.2).abs() < 1e-9);
        assert_eq!(consensus(&[None, None], 0), (vec![false, false], 0.0));
    }

    #[test]
    fn pairs_that_agree_are_surer_and_those_that_contradict_are_not() {
        let (kept, probability) =
            consensus(&[candidate(1.0, 0.8), candidate(1.02, 0.8), candidate(1.5, 0.8)], 0);
        assert_eq!(kept, [true, true, false]);
        assert!((probability - 16.0 / 21.0).abs() < 1e-9);
        let (_, agreed) = consensus(&[candidate(1.0, 0.8), candidate(1.02, 0.8)], 0);
        assert!((agreed - 16.0 / 17.0).abs() < 1e-9);
        let (_, torn) = consensus(&[candidate(1.0, 0.95), candidate(1.5, 0.95)], 0);
        assert!((torn - 0.5).abs() < 0.05);
    }
}
