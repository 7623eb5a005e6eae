//! Cameras whose depths contradict those of the others everywhere: a camera that was turned sideways hardly changes rows,
//! and shifts all depths.

use crate::{
    consensus::{Candidate, MOST_SIGMAS, depths},
    dense,
    pair::RectifiedPair,
    pair_check::PairCheck,
    points::PointEstimator,
    scene_points::ScenePoints,
    seen::{Found, Seen},
    settings::ReconstructionSettings,
    turned::{DepthDifference, TurnedCamera, TurnedSideways, sideways, turned},
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

/// What several pairs say of each other.
#[derive(Default)]
pub(crate) struct Verdict {
    pub(crate) contradiction: Option<Contradiction>,
    /// The camera that was turned, where rows or depths are off and one alone explains how.
    pub(crate) turned: Option<TurnedCamera>,
    /// Of a single pair, what its rows say of a turn sideways.
    pub(crate) sideways: Option<TurnedSideways>,
}

impl Verdict {
    /// Of disparity maps.
    pub(crate) fn of_maps(
        pairs: &[RectifiedPair<'_>],
        points: &ScenePoints<'_>,
        (maps, checks): (&[Option<&DisparityMap>], &[PairCheck]),
        settings: &ReconstructionSettings,
    ) -> Self {
        let height = pairs[0].rectification.pair.size[1] as usize;
        let rows =
            if pairs.len() > 1 { (STEP / 2..height).step_by(STEP) } else { (0..0).step_by(1) };
        let mut all = Contradictions::new(pairs.len());
        for y in rows {
            let seen = dense::seen((pairs, &points.lattices), maps, y, settings);
            all.add(pairs, &points.map, &seen);
        }
        all.told(pairs, checks)
    }

    /// Of single pixels.
    pub(crate) fn of_pixels(
        pairs: &[RectifiedPair<'_>],
        points: &ScenePoints<'_>,
        (seen, checks): (&Seen, &[PairCheck]),
    ) -> Self {
        let mut all = Contradictions::new(pairs.len());
        all.add(pairs, &points.map, seen);
        all.told(pairs, checks)
    }

    /// The pair that is left out because of its other camera.
    pub(crate) fn left_out(&self, pairs: &[RectifiedPair<'_>]) -> Option<usize> {
        let contradicting = self.contradiction.as_ref().and_then(|own| own.left_out);
        let camera = contradicting.or(self.turned.map(|own| own.camera))?;
        pairs.iter().position(|pair| pair.cameras[1] == camera)
    }
}

/// What several pairs say of depths, gathered bit by bit.
struct Contradictions {
    /// [pair][pair]: differences in standard deviations.
    differences: Vec<Vec<Vec<f64>>>,
    /// The same with all that tells where.
    depths: Vec<DepthDifference>,
}

impl Contradictions {
    fn new(pairs: usize) -> Self {
        Self { differences: vec![vec![Vec::new(); pairs]; pairs], depths: Vec::new() }
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
            let variance = own.sigma * own.sigma + calibration(found, own.nearness);
            (variance > 0.0 && variance.is_finite()).then_some((own, variance, found.as_ref()?))
        };
        for first in 0..pairs.len() {
            for second in first + 1..pairs.len() {
                for index in 0..seen.places.len() {
                    let (Some(a), Some(b)) = (sure(first, index), sure(second, index)) else {
                        continue;
                    };
                    let nearness = a.0.nearness - b.0.nearness;
                    self.differences[first][second].push(nearness.abs() / (a.1 + b.1).sqrt());
                    self.depths.push(DepthDifference {
                        pairs: [first, second],
                        pixel: seen.reference[index],
                        disparities: [a.2.disparity, b.2.disparity],
                        slopes: [a, b].map(|own| own.0.sigma * own.2.doubt / own.2.sigma),
                        nearness,
                    });
                }
            }
        }
    }

    /// What they say together with the rows of corners.
    fn told(&self, pairs: &[RectifiedPair<'_>], checks: &[PairCheck]) -> Verdict {
        let contradiction = self.contradiction(pairs);
        let is_unexplained = contradiction.as_ref().is_some_and(|own| own.left_out.is_none());
        let is_off = || checks.iter().any(|check| check.is_off() && !check.is_left_out);
        let is_open = is_unexplained || (contradiction.is_none() && is_off());
        let turned = if is_open { turned(pairs, checks, &self.depths) } else { None };
        let sideways = sideways(pairs, checks);
        Verdict { contradiction, turned, sideways }
    }

    /// What they say together, if most pixels contradict each other.
    fn contradiction(&self, pairs: &[RectifiedPair<'_>]) -> Option<Contradiction> {
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
