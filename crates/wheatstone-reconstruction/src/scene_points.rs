//! Where a scene's points are: what a single pair matches as its lattice says, everything else as the map says.

use crate::{
    matches::Matches,
    pair::RectifiedPair,
    point_lattice::PointLattice,
    points::{Point, PointEstimator},
    seen::{PairPoint, Seen},
};
use rayon::prelude::*;
use wheatstone_core::Calibration;

/// The map of some cameras, and lattices of what it says of their pairs.
pub(crate) struct ScenePoints<'a> {
    pub(crate) map: PointEstimator<'a>,
    /// Of each pair.
    pub(crate) lattices: Vec<Option<PointLattice>>,
}

impl<'a> ScenePoints<'a> {
    /// For disparities of whole pictures.
    pub(crate) fn of_pictures(model: &'a Calibration, pairs: &[RectifiedPair<'a>]) -> Self {
        let asked_once = PointEstimator::new(model, &Matches::new(cameras(pairs)));
        let lattice = |pair: &RectifiedPair<'_>| PointLattice::new(pair, &asked_once);
        let lattices: Vec<_> = pairs.iter().map(lattice).collect();
        // What several pairs match is asked of the map itself.
        let is_asked = pairs.len() > 1 || lattices.iter().any(Option::is_none);
        let map = if is_asked { made_ready(model, pairs) } else { asked_once };
        Self { map, lattices }
    }

    /// For single pixels, many of them.
    pub(crate) fn of_pixels(model: &'a Calibration, pairs: &[RectifiedPair<'a>]) -> Self {
        Self { map: made_ready(model, pairs), lattices: pairs.iter().map(|_| None).collect() }
    }

    /// Locates what pairs see of these cameras' pixels; `None` for what means no point.
    pub(crate) fn locate(&self, cameras: &[usize], seen: &Seen) -> Vec<Option<Point>> {
        let trust = self.map.trust(cameras, &seen.pixels());
        let of_lattice = |index: usize| {
            let mut found = seen.found.iter().filter_map(|pair| pair[index].as_ref());
            let (only, other) = (found.next()?, found.next());
            let point = only.point.as_ref().filter(|_| other.is_none())?;
            let PairPoint { place, slope, calibration } = *point;
            let covariance = calibration + slope * slope.transpose() * (only.sigma * only.sigma);
            let is_known = covariance.iter().chain(place.iter()).all(|value| value.is_finite());
            is_known.then_some(Point { place, covariance, trust: trust[index] })
        };
        let each = (0..seen.places.len()).into_par_iter();
        let mut points: Vec<Option<Point>> = each.map(of_lattice).collect();
        let rest: Vec<usize> = (0..points.len()).filter(|index| points[*index].is_none()).collect();
        let matches = Matches::new(cameras.to_vec());
        let mut matches = Matches { pixel_sigma: seen.pixel_sigma, ..matches };
        for index in &rest {
            let others = seen.found.iter().map(|pair| Some(pair[*index].as_ref()?.at));
            matches.push(seen.reference[*index], others);
        }
        for (index, point) in rest.iter().zip(self.map.locate(&matches)) {
            points[*index] = point;
        }
        points
    }
}

/// The reference camera, and the others.
pub(crate) fn cameras(pairs: &[RectifiedPair<'_>]) -> Vec<usize> {
    let others = pairs.iter().map(|pair| pair.cameras[1]);
    pairs.iter().take(1).map(|pair| pair.cameras[0]).chain(others).collect()
}

/// The map, with all that makes many points quick: it takes seconds.
fn made_ready<'a>(model: &'a Calibration, pairs: &[RectifiedPair<'a>]) -> PointEstimator<'a> {
    let mut shown = Matches::new(cameras(pairs));
    for (index, pair) in pairs.iter().enumerate() {
        for (reference, other) in pair.lattice() {
            let of_pair = |own: usize| (own == index).then_some(other);
            shown.push(reference, (0..pairs.len()).map(of_pair));
        }
    }
    PointEstimator::new(model, &shown)
}
