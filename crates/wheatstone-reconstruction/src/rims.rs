//! Points at edges of depth.

use crate::{cloud::Cloud, pair::RectifiedPair, settings::ReconstructionSettings};
use rayon::prelude::*;

/// Drops points beside a pixel that has none, though it might: at edges of depth windows reach over, and pairs agree on a
/// wrong depth. With several cameras little is lost, as others fill what one does not see; a single pair would lose points
/// at every hole.
pub(crate) fn drop_rims(
    cloud: &mut Cloud,
    depth: &mut [f32],
    (pair, settings): (&RectifiedPair<'_>, &ReconstructionSettings),
) {
    let [width, height] = pair.rectification.pair.size.map(|side| side as usize);
    let is_hole = |x: usize, y: usize| {
        let shown = || pair.reference((x as f64, y as f64));
        depth[y * width + x].is_nan() && shown().is_some_and(|at| settings.holds(at))
    };
    let is_rim = |place: &u32| {
        let (x, y) = (*place as usize % width, *place as usize / width);
        (x > 0 && is_hole(x - 1, y))
            || (y > 0 && is_hole(x, y - 1))
            || (x + 1 < width && is_hole(x + 1, y))
            || (y + 1 < height && is_hole(x, y + 1))
    };
    let keep: Vec<bool> = cloud.places.par_iter().map(|place| !is_rim(place)).collect();
    for (place, keep) in cloud.places.iter().zip(&keep) {
        if !keep {
            depth[*place as usize] = f32::NAN;
        }
    }
    cloud.retain(&keep);
}
