//! What speaks against a reading that matches well: marks where the body would go on if it had more points,
//! and other readings that are no worse.

use super::{
    body::{Body, Patch},
    matching::{CLICKED, Click, Matched, Search},
    view::View,
};
use crate::imaging::GrayImage;
use std::collections::BTreeSet;
use wheatstone_core::geometry::Point3;

/// Places in one row beyond the body's last that tell whether it ends there.
const LEAST_BEYOND: usize = 3;
/// From a place beyond the body to the mark that would be there, as a share of the step to it.
const NEAR: f64 = 0.25;
/// Share of the places beside the body that may have marks: 0.00 to 0.17 for right readings of photographed
/// plates and vees, 0.80 to 1.00 for those a row aside, turned, or on a cylinder that goes on.
const MOST_BEYOND: f64 = 0.5;
/// Share of the body's points that must be there where nobody has named four: less may be one face laid onto
/// another.
const LEAST_WHOLE: f64 = 0.75;
/// The same for corners: walls are cut by the picture, and look the same a row aside.
const LEAST_WHOLE_OF_CORNERS: f64 = 0.95;
/// Named points that are believed against marks beyond the body: it is a part of a larger lattice. One is
/// not: one camera's picture of a vee was laid askew through it in six of eight cases.
const LEAST_NAMED: usize = 3;

/// The largest share of the places beyond a side of the body where there is a mark like its own: near 0
/// for a body that stands alone, near 1 where it was laid onto a part of a larger lattice, or a row aside.
fn goes_on(search: &Search, image: &GrayImage, matched: &Matched) -> f64 {
    let Some(view) = View::fit(&search.pairs(&matched.marks), search.frame.0, search.frame.1)
    else {
        return 1.0;
    };
    let seen = search.seen(&view);
    let claimed: BTreeSet<usize> = matched.marks.values().copied().collect();
    let mut most: f64 = 0.0;
    for patch in &search.body.patches {
        for step in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let (mut asked, mut there) = (0, 0);
            for (id, beyond) in ends(search.body, patch, step) {
                let (Some(own), Some(at)) = (matched.marks.get(&id), view.project(&beyond)) else {
                    continue;
                };
                let Some(last) = seen[id] else { continue };
                let spacing = (at - last).norm();
                let at = at + search.offset(&seen, &matched.marks, id, at).unwrap_or_default();
                if !image.contains(at, 0.4 * spacing) {
                    continue;
                }
                asked += 1;
                let found = search.marks.nearest(at, NEAR * spacing);
                there += usize::from(found.is_some_and(|(mark, _)| {
                    !claimed.contains(&mark) && search.marks.alike(mark, *own)
                }));
            }
            if asked >= LEAST_BEYOND {
                most = most.max(f64::from(there as u32) / f64::from(asked as u32));
            }
        }
    }
    most
}

/// Points of a patch after which it ends in a direction, and where the next would be.
fn ends(body: &Body, patch: &Patch, (column, row): (i32, i32)) -> Vec<(usize, Point3)> {
    let at = |label: (i32, i32), steps: i32| {
        patch.get(&(label.0 + steps * column, label.1 + steps * row)).copied()
    };
    let place = |id: usize| body.points[id].coords;
    let last = patch.iter().filter(|(label, _)| at(**label, 1).is_none());
    last.filter_map(|(label, id)| {
        let before = at(*label, -1)?;
        let beyond = at(*label, -2).map_or_else(
            || 2.0 * place(*id) - place(before),
            |third| 3.0 * place(*id) - 3.0 * place(before) + place(third),
        );
        let step = (place(*id) - place(before)).norm();
        let free = |other: &usize| (place(*other) - beyond).norm() > 0.5 * step;
        body.neighbours[*id].iter().all(free).then_some((*id, Point3::from(beyond)))
    })
    .collect()
}

/// Whether one reading is what a symmetry of the body makes of the other.
fn are_twins(body: &Body, one: &Matched, other: &Matched) -> bool {
    body.symmetries.iter().any(|to| {
        let both = one
            .marks
            .iter()
            .filter(|(id, mark)| to[**id].is_some_and(|twin| other.marks.get(&twin) == Some(mark)));
        2 * both.count() > one.marks.len()
    })
}

/// What a named point says of a reading: whether the point is where it was named, nearer than to its
/// neighbours; nothing where the reading does not have it.
fn confirms(search: &Search, matched: &Matched, (id, at): &Click) -> Option<bool> {
    let own = search.marks.at(*matched.marks.get(id)?);
    let steps = search.body.neighbours[*id].iter().filter_map(|other| {
        let step = (search.marks.at(*matched.marks.get(other)?) - own).norm();
        // Two points in one line of sight are not neighbours in the picture.
        (step > 2.0).then_some(step)
    });
    Some((own - at).norm() < CLICKED.min(0.5 * steps.fold(f64::INFINITY, f64::min)))
}

/// The readings that can be told, of those that are left: without named points to lead the search they must
/// be of nearly the whole body, which ends where they say, and differ by its own symmetry only.
pub(super) fn decided(
    search: &Search,
    image: &GrayImage,
    mut readings: Vec<Matched>,
    clicks: &[Click],
) -> Vec<Matched> {
    let count = search.body.points.len();
    let confirmed = |reading: &Matched| -> Vec<bool> {
        clicks.iter().filter_map(|click| confirms(search, reading, click)).collect()
    };
    readings.retain(|reading| {
        let corners = search.marks.are_corners() && confirmed(reading).len() < LEAST_NAMED;
        let least = if corners { LEAST_WHOLE_OF_CORNERS } else { LEAST_WHOLE };
        reading.marks.len() as f64 >= least * count as f64
    });
    readings.retain(|reading| {
        let says = confirmed(reading);
        says.iter().all(|it| *it)
            && (says.len() >= LEAST_NAMED || goes_on(search, image, reading) < MOST_BEYOND)
    });
    let alike = readings.iter().skip(1).all(|it| are_twins(search.body, &readings[0], it));
    if alike { readings } else { Vec::new() }
}
