//! What disparity maps say of pixels of the reference camera.

use crate::{
    pair::RectifiedPair,
    point_lattice::{LatticeRow, PointLattice},
    seen::{Found, PairPoint, Seen},
    settings::ReconstructionSettings,
};
use wheatstone_stereo::{DisparityMap, doubt_factor};

/// Of several pairs, disparities that are at least so confident count: two that agree are more than each.
const CANDIDATE: f32 = 0.5;

/// What the pairs' maps match with pixels of one row of the left rectified picture, where that is confident enough.
pub(crate) fn seen(
    (pairs, lattices): (&[RectifiedPair<'_>], &[Option<PointLattice>]),
    maps: &[Option<&DisparityMap>],
    y: usize,
    settings: &ReconstructionSettings,
) -> Seen {
    let width = pairs[0].rectification.pair.size[0] as usize;
    let wanted = settings.least_confidence;
    let least = if pairs.len() == 1 { wanted } else { CANDIDATE.min(wanted) };
    type Row<'a> = Option<LatticeRow<'a>>;
    let of_pairs = |at: (f64, f64), reference: [f64; 2], (row, found): (&Row<'_>, &mut Vec<_>)| {
        let mut missed = 0;
        for (index, (pair, map)) in pairs.iter().zip(maps).enumerate() {
            let at = if index == 0 { Some(at) } else { pair.place(reference) };
            let read = at.zip(*map).and_then(|(at, map)| Some((at, read(map, at)?)));
            let sure = read.filter(|(_, read)| read.confidence >= least);
            let point = |at: (f64, f64), disparity: f64| match &lattices[index] {
                _ if index == 0 => row.as_ref()?.at(at.0, disparity),
                lattice => lattice.as_ref()?.at(at, disparity),
            };
            let own = sure.and_then(|(at, read)| matched(pair, at, &read, point));
            let is_in_view = || at.zip(*map).is_some_and(|(at, _)| pair.shows(at));
            missed += usize::from(own.is_none() && is_in_view());
            found.push(own);
        }
        missed
    };
    let mut seen = Seen::with_room(pairs.len(), width);
    let mut found = Vec::with_capacity(pairs.len());
    let row = lattices[0].as_ref().map(|lattice| lattice.row(y as f64));
    for x in 0..width {
        let at = (x as f64, y as f64);
        let wanted = pairs[0].reference(at).filter(|pixel| settings.holds(*pixel));
        let Some(reference) = wanted else { continue };
        found.clear();
        let missed = of_pairs(at, reference, (&row, &mut found));
        if found.iter().any(Option::is_some) {
            seen.push(((y * width + x) as u32, reference), (&found, missed));
        }
    }
    seen
}

/// What one pair matches with a pixel of its reference camera's rectified picture.
fn matched(
    pair: &RectifiedPair<'_>,
    at: (f64, f64),
    read: &Read,
    point: impl FnOnce((f64, f64), f64) -> Option<PairPoint>,
) -> Option<Found> {
    let Read { disparity, sigma, confidence } = *read;
    let shown = pair.shown(at, disparity)?;
    let point = point(at, disparity);
    let doubt = f64::from(doubt_factor(confidence));
    Some(Found { at: shown.matched(sigma), disparity, sigma, confidence, doubt, point })
}

/// What a map has at a place.
struct Read {
    disparity: f64,
    sigma: f64,
    confidence: f32,
}

/// What a map has between pixels; `None` where it has nothing on one of them, or two surfaces.
fn read(map: &DisparityMap, (x, y): (f64, f64)) -> Option<Read> {
    /// Pixels of one surface differ by less, in pixels.
    const STEP: f32 = 1.0;
    let (column, row) = (x.floor(), y.floor());
    let (along, down) = (x - column, y - row);
    let mut read = Read { disparity: 0.0, sigma: 0.0, confidence: 1.0 };
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for (dy, share) in [(0, 1.0 - down), (1, down)] {
        for (dx, part) in [(0, 1.0 - along), (1, along)] {
            let weight = share * part;
            if weight == 0.0 {
                continue;
            }
            let (x, y) = (column as i64 + dx, row as i64 + dy);
            let inside = (0..map.width as i64).contains(&x) && (0..map.height as i64).contains(&y);
            let at = inside.then(|| y as usize * map.width + x as usize)?;
            let disparity = map.disparity[at];
            (least, most) = (least.min(disparity), most.max(disparity));
            read.disparity += weight * f64::from(disparity);
            read.sigma = read.sigma.max(f64::from(map.sigma[at]));
            read.confidence = read.confidence.min(map.confidence[at]);
        }
    }
    let is_one = most - least <= STEP && read.disparity.is_finite() && read.sigma.is_finite();
    (is_one && read.confidence > 0.0).then_some(read)
}
