//! Views in the order of the file, parted in two.

/// Where views are best parted in two: the place with the least error. Of many places some are tried
/// first, then those about the best of them: the error rises with the distance from where a camera moved.
pub(super) fn parting(views: usize, error: impl Fn(usize) -> f64) -> Option<usize> {
    const TRIED: usize = 12;
    // Both parts need two views, or anything could be a move.
    let places = 2..views.saturating_sub(1);
    let mut step = places.len().div_ceil(TRIED).max(1);
    let best = |places: &mut dyn Iterator<Item = usize>| {
        places.map(|at| (at, error(at))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
    };
    let mut found = best(&mut places.clone().step_by(step))?;
    while step > 1 {
        let (first, last) = (found.saturating_sub(step - 1), found + step - 1);
        step = step.div_ceil(TRIED);
        let near = places.start.max(first)..places.end.min(last + 1);
        found = best(&mut near.step_by(step))?;
    }
    Some(found)
}
