//! A large fault of one view bends the cameras and charts that are adjusted together with it: other views seem to have
//! faults, or nothing explains it. Then the charts are placed once more without the view that errs most.

use super::{
    after_placing::{Placed, rows_placed},
    checks::{self, Examination, Severity},
};
use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Point3, Pose},
};
use std::collections::{BTreeMap, BTreeSet};

/// Views that are set apart, one after the other, at most: each costs a placement.
const TRIED: usize = 2;

/// What shows in charts that were placed, by an examination of them; `rows` tells from which of the `recorded` rows each
/// comes.
///
/// # Errors
///
/// [`Error::Cancelled`].
pub(super) fn examine_placed(
    (recorded, rows): (&Dataset, &[usize]),
    placed: &Dataset,
    examine: &dyn Fn(&Dataset) -> Examination,
    place: &dyn Fn(&Dataset) -> Result<Placed>,
) -> Result<Examination> {
    let all = examine(placed);
    let before = unclear(&all);
    if before <= CLEAR {
        return Ok(all);
    }
    for worst in checks::worst_views(placed).into_iter().take(TRIED) {
        let Some(apart) = placed_without(worst, (recorded, rows), placed, place)? else { continue };
        let anew = examine(&apart);
        let after = unclear(&anew);
        if after.0 > 0 && after < before {
            return Ok(anew);
        }
    }
    Ok(all)
}

/// One view has a fault with a name.
const CLEAR: (usize, usize) = (1, 0);

/// How many views have fatal faults, and of how many of them nothing is known but that.
fn unclear(examination: &Examination) -> (usize, usize) {
    let fatal = || examination.findings.iter().filter(|found| found.severity == Severity::Fatal);
    let views: BTreeSet<&String> = fatal().flat_map(|finding| &finding.views).collect();
    let unexplained = fatal().filter(|finding| finding.code == "view-unexplained");
    (views.len(), unexplained.flat_map(|finding| &finding.views).count())
}

/// All charts where they are placed without one view, whose own keeps its pose among the others. `None` where the rest
/// cannot be placed.
fn placed_without(
    view: usize,
    (recorded, rows): (&Dataset, &[usize]),
    placed: &Dataset,
    place: &dyn Fn(&Dataset) -> Result<Placed>,
) -> Result<Option<Dataset>> {
    let is_kept = |row: &usize| recorded.correspondences[*row].view != view;
    let kept: Vec<usize> = (0..recorded.correspondences.len()).filter(is_kept).collect();
    let rest = recorded.subset(|_, row| row.view != view);
    let (rest_placed, estimated) = match place(&rest) {
        Ok(found) => found,
        Err(Error::TooFew { .. } | Error::Degenerate { .. }) => return Ok(None),
        Err(other) => return Err(other),
    };
    let of_rest = rows_placed(&rest, &estimated).into_iter().map(|row| kept[row]);
    let places: BTreeMap<usize, Point3> = of_rest
        .zip(&rest_placed.correspondences)
        .filter_map(|(row, c)| Some((row, c.world?)))
        .collect();
    let both = rows.iter().zip(&placed.correspondences);
    let pairs: Vec<(Point3, Point3)> =
        both.filter_map(|(row, c)| Some((c.world?, *places.get(row)?))).collect();
    let Some(moved) = Pose::aligning(&pairs) else { return Ok(None) };
    let mut apart = placed.clone();
    for (row, c) in rows.iter().zip(&mut apart.correspondences) {
        let world = c.world.map(|world| moved.transform(world));
        c.world = places.get(row).copied().or(world);
    }
    Ok(Some(apart))
}
