//! Growing a lattice over points that were found: place by place, each beside those that are known.

use std::collections::{BTreeMap, BTreeSet};

/// Column and row; where they begin and which way they go means nothing.
pub(super) type Place = (i32, i32);

/// The empty places beside some of the known ones, in order.
pub(super) fn beside<'a, T>(
    some: impl Iterator<Item = &'a Place>,
    known: &BTreeMap<Place, T>,
) -> Vec<Place> {
    let mut places: Vec<Place> = some
        .flat_map(|(c, r)| [(c - 1, *r), (c + 1, *r), (*c, r - 1), (*c, r + 1)])
        .filter(|place| !known.contains_key(place))
        .collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// The seed with all that grows from it: `find` names the point, by its number, that belongs to an
/// empty place. No point gets two places.
pub(super) fn grown(
    seed: BTreeMap<Place, usize>,
    find: impl Fn(&BTreeMap<Place, usize>, Place) -> Option<usize>,
) -> BTreeMap<Place, usize> {
    let mut labels = seed;
    let mut taken: BTreeSet<usize> = labels.values().copied().collect();
    let mut fresh: Vec<Place> = labels.keys().copied().collect();
    while !fresh.is_empty() {
        let places = beside(fresh.iter(), &labels);
        fresh.clear();
        for place in places {
            let Some(found) = find(&labels, place) else { continue };
            if taken.insert(found) {
                labels.insert(place, found);
                fresh.push(place);
            }
        }
    }
    labels
}
