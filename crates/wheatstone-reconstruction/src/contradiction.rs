//! Cameras whose depths contradict those of the others everywhere: a camera that was turned sideways leaves the rows as
//! they are, and shifts all depths.

use crate::{
    consensus::{Candidate, MOST_SIGMAS, depths},
    dense,
    pair::RectifiedPair,
    points::PointEstimator,
    scene_points::ScenePoints,
    seen::{Found, Seen},
    settings::ReconstructionSettings,
};
use wheatstone_numeric::statistics::median;
use wheatstone_stereo::{CONFIDENT, DisparityMap};

/// Of disparity maps, rows so far apart tell enough.
const STEP: usize = 16;

/// Fewer pixels that two pairs see say nothing.
const LEAST_PIXELS: usize = 50;

/// Pairs of cameras whose depths contradict each other at most pixels that both match with confidence.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Contradiction {
    /// The camera that contradicts all others, where those agree: it is left out.
    pub left_out: Option<usize>,
    /// The others of the reference's pairs that contradict each other.
    pub cameras: Vec<usize>,
    /// The median, over pixels, of the difference of the two pairs' depths that differ most, in its standard deviations.
    pub sigmas: f64,
}

impl Contradiction {
    /// Of disparity maps, if there is one.
    pub(crate) fn of_maps(
        pairs: &[RectifiedPair<'_>],
        points: &ScenePoints<'_>,
        maps: &[Option<&DisparityMap>],
        settings: &ReconstructionSettings,
    ) -> Option<Self> {
        let height = pairs[0].rectification.pair.size[1] as usize;
        let rows =
            if pairs.len() > 1 { (STEP / 2..height).step_by(STEP) } else { (0..0).step_by(1) };
        let mut all = Contradictions::new(pairs.len());
        for y in rows {
            let seen = dense::seen((pairs, &points.lattices), maps, y, settings);
            all.add(pairs, &points.map, &seen);
        }
        all.told(pairs)
    }

    /// Of single pixels, if there is one.
    pub(crate) fn of_pixels(
        pairs: &[RectifiedPair<'_>],
        points: &ScenePoints<'_>,
        seen: &Seen,
    ) -> Option<Self> {
        let mut all = Contradictions::new(pairs.len());
        all.add(pairs, &points.map, seen);
        all.told(pairs)
    }
}

/// What several pairs say of depths, gathered bit by bit.
struct Contradictions {
    /// [pair][pair]: differences in standard deviations.
    differences: Vec<Vec<Vec<f64>>>,
}

impl Contradictions {
    fn new(pairs: usize) -> Self {
        Self { differences: vec![vec![Vec::new(); pairs]; pairs] }
    }

    /// Adds what pairs match with some pixels.
    fn add(&mut self, pairs: &[RectifiedPair<'_>], map: &PointEstimator<'_>, seen: &Seen) {
        let frame = pairs[0].rectification.pair.rectified_from_world;
        let told: Vec<Vec<Option<Candidate>>> =
            (0..pairs.len()).map(|pair| depths(pairs, map, seen, pair)).collect();
        // The variance of the nearness by the calibration.
        let calibration = |found: &Option<Found>, nearness: f64| {
            let point = found.and_then(|found| found.point);
            point.map_or(0.0, |point| {
                let depth = frame.rotation * point.calibration * frame.rotation.transpose();
                depth[(2, 2)] * nearness.powi(4)
            })
        };
        let sure = |pair: usize, index: usize| {
            let found = &seen.found[pair][index];
            let is_sure = found.is_some_and(|found| found.confidence > CONFIDENT);
            let own = told[pair][index].filter(|_| is_sure)?;
            Some((own.nearness, own.sigma * own.sigma + calibration(found, own.nearness)))
        };
        for first in 0..pairs.len() {
            for second in first + 1..pairs.len() {
                let both = (0..seen.places.len())
                    .filter_map(|index| Some((sure(first, index)?, sure(second, index)?)));
                let sigmas = both.map(|((a, va), (b, vb))| (a - b).abs() / (va + vb).sqrt());
                self.differences[first][second].extend(sigmas.filter(|sigmas| sigmas.is_finite()));
            }
        }
    }

    /// What they say together, if most pixels contradict each other.
    fn told(&self, pairs: &[RectifiedPair<'_>]) -> Option<Contradiction> {
        let count = self.differences.len();
        let typical = |first: usize, second: usize| {
            let all = &self.differences[first.min(second)][first.max(second)];
            (all.len() >= LEAST_PIXELS).then(|| median(all))
        };
        let contradicts =
            |a: usize, b: usize| typical(a, b).is_some_and(|sigmas| sigmas > MOST_SIGMAS);
        let others = |own: usize| (0..count).filter(move |other| *other != own);
        let at_fault: Vec<usize> =
            (0..count).filter(|own| others(*own).any(|other| contradicts(*own, other))).collect();
        let both = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
        let sigmas = both.filter_map(|(a, b)| typical(a, b)).fold(0.0, f64::max);
        let rest_agrees = |own: usize| {
            let mut both = others(own).flat_map(|a| others(own).map(move |b| (a, b)));
            both.all(|(a, b)| a >= b || typical(a, b).is_some_and(|sigmas| sigmas < MOST_SIGMAS))
        };
        let alone = at_fault.iter().copied().find(|own| {
            count > 2 && rest_agrees(*own) && others(*own).all(|other| contradicts(*own, other))
        });
        let camera = |pair: usize| pairs[pair].cameras[1];
        (!at_fault.is_empty()).then(|| Contradiction {
            left_out: alone.map(camera),
            cameras: at_fault.into_iter().map(camera).collect(),
            sigmas,
        })
    }
}
