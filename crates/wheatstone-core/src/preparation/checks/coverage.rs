//! Points that lie where they cannot tell enough: on one plane, in a thin slab, on parallel planes, in
//! a corner of the picture.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Proposal, Severity},
    views::LEAST,
};
use crate::{
    dataset::Dataset,
    geometry::{Pixel, Point3, Vector3, principal_axes},
};
use std::collections::BTreeMap;
use wheatstone_numeric::statistics::{median, percentile};

pub(super) struct Coverage;

impl Fault for Coverage {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found: Vec<Proposal> = depth(evidence).into_iter().collect();
        found.extend(parallel(evidence));
        // In a slab or on a plane nothing tells where the cameras' axes are.
        if found.iter().all(|proposal| proposal.severity == Severity::Information) {
            for camera in 0..evidence.data.cameras {
                found.extend(corner(evidence, camera));
            }
        }
        found
    }
}

/// Thickness of the points over their extent. `None` for too few points.
pub(super) fn thickness(evidence: &Evidence) -> Option<f64> {
    thickness_if(evidence, |place| place)
}

/// As [`thickness`], with each place moved so.
pub(super) fn thickness_if(evidence: &Evidence, place: impl Fn(Point3) -> Point3) -> Option<f64> {
    // Views that miss in every camera may have wrong places: they tell nothing of the others' spread.
    let sound = |view: &usize| {
        let present = evidence.present(*view);
        present.is_empty() || evidence.suspects(*view).len() < present.len()
    };
    let rows = (0..evidence.views.len()).filter(sound).flat_map(|view| &evidence.views[view].rows);
    let known = rows.filter_map(|row| evidence.data.correspondences[*row].world);
    let places: Vec<Point3> = known.map(|world| place(evidence.frame.scaled(world))).collect();
    if places.len() < 4 {
        return None;
    }
    let (_, _, spread) = principal_axes(&places);
    Some(spread[2] / spread[0].max(1e-12))
}

/// Below this points are a slab: twenty times as wide as thick, of what most rigs sweep a tenth or less.
pub(super) const THIN: f64 = 0.05;

fn depth(evidence: &Evidence) -> Option<Proposal> {
    let share = thickness(evidence)?;
    let figures = vec![("thickness of the points over their extent".into(), share)];
    // A chart's own unevenness is a thousandth of its size.
    if share < 2e-3 {
        let (problem, advice) = if is_moved_chart(evidence.data) {
            (
                "all points lie on one plane, and the same ones are at other pixels from view to view: these are places on a chart that was moved, and not in the world",
                "name the columns X and Y `board_x` and `board_y`: then the poses of the chart are estimated",
            )
        } else {
            (
                "all points lie on one plane: depth cannot be calibrated from them",
                "show the chart at three or more distances, from nearest to farthest",
            )
        };
        return Some(Proposal {
            figures,
            ..Proposal::itself("single-plane", Severity::Fatal, problem.into(), advice)
        });
    }
    (share < THIN).then(|| Proposal {
        figures,
        ..Proposal::itself("thin-depth", Severity::Warning, format!("the points fill only a thin slab ({:.1} % of its extent): depth beyond it is extrapolated", 100.0 * share), "add views nearer and farther, over the whole range in which points will be located; or, if they were recorded over such a range, check whether one column is in another unit")
    })
}

/// Whether most places are listed more than once, and a camera sees them elsewhere each time.
fn is_moved_chart(data: &Dataset) -> bool {
    /// In pixels: no detector misplaces a corner by so much.
    const FAR: f64 = 10.0;
    let mut seen: BTreeMap<[u64; 3], Vec<&[Option<Pixel>]>> = BTreeMap::new();
    for row in &data.correspondences {
        if let Some(world) = row.world {
            let place = [world.x, world.y, world.z].map(f64::to_bits);
            seen.entry(place).or_default().push(&row.pixels);
        }
    }
    let apart = |rows: &Vec<&[Option<Pixel>]>| {
        rows.windows(2).any(|two| {
            let mut both = two[0].iter().zip(two[1]).filter_map(|(a, b)| Some((*a)? - (*b)?));
            both.any(|apart| apart.norm() > FAR)
        })
    };
    2 * seen.values().filter(|rows| apart(rows)).count() > seen.len()
}

/// The normal that all charts share, and how many these are.
pub(super) fn common_normal(evidence: &Evidence) -> Option<(Vector3, usize)> {
    let normals: Vec<_> =
        evidence.views.iter().map(|v| v.board.as_ref().map(|b| b.normal())).collect();
    let normals: Vec<_> = normals.into_iter().collect::<Option<_>>()?;
    let first = *normals.first()?;
    // Half a degree is what stages keep to.
    let alike = normals.iter().all(|normal| normal.cross(&first).norm() < 0.01);
    (alike && normals.len() > 1).then_some((first, normals.len()))
}

fn parallel(evidence: &Evidence) -> Option<Proposal> {
    common_normal(evidence).map(|(_, count)| Proposal::itself(
        "planes-parallel",
        Severity::Information,
        format!("all {} chart poses are parallel, which is fine because they are given; without given poses such views could not be calibrated", count),
        "nothing to do; tilt the chart if its poses are ever to be estimated",
    ))
}

/// How far from the edges of the points' box the camera's axis may be while the points lie beside it:
/// of the box's side.
const MIDDLE: f64 = 0.25;

/// In pixels: the largest pictures that cameras of machines take.
const LARGEST: f64 = 4e7;

/// Points beside where the camera's axis meets the picture, on a small part of it.
fn corner(evidence: &Evidence, camera: usize) -> Option<Proposal> {
    let seen = evidence.seen[camera].as_ref()?;
    let [left, top, right, bottom] = pixel_box(evidence.data, camera)?;
    let axis = seen.camera.principal();
    let [fx, fy] = seen.camera.focal();
    let (wide, high) = (right - left, bottom - top);
    let pairs: Vec<_> =
        evidence.cells.iter().flat_map(|view| view[camera].pairs.iter().copied()).collect();
    let sigma = seen.camera.principal_uncertainty(&pairs)?;
    // Points in a corner tell little of the axis: it must be off their middle beyond its own error.
    let off_middle = |low: f64, high: f64, at: f64, sigma: f64| {
        let margin = MIDDLE * (high - low);
        at + sigma < low + margin || at - sigma > high - margin
    };
    let beside = |axis: Pixel, sigma: f64| {
        off_middle(left, right, axis.x, sigma) && off_middle(top, bottom, axis.y, sigma)
    };
    // One camera's axis may be far off behind glass; those of all are hardly.
    let axes: Vec<Pixel> =
        evidence.seen.iter().flatten().map(|seen| seen.camera.principal()).collect();
    let middle = |of: fn(&Pixel) -> f64| median(&axes.iter().map(of).collect::<Vec<_>>());
    let several = (axes.len() as f64).sqrt();
    let common = Pixel::new(middle(|p| p.x), middle(|p| p.y));
    let beside = beside(common, sigma / several) && (axes.len() > 2 || beside(axis, sigma));
    // A picture is about twice as wide as its axis is from its edge.
    let picture = (2.0 * axis.x).max(right) * (2.0 * axis.y).max(bottom);
    let share = wide * high / picture.max(1.0);
    // Behind an oblique window the axis that a lens formula finds may be anywhere.
    let plausible = axis.x > 0.0
        && axis.y > 0.0
        && fx > 0.0
        && fy > 0.0
        && picture < LARGEST
        && evidence.is_described(camera);
    (plausible && beside && share < 0.2).then(|| Proposal {
        cells: (0..evidence.views.len()).map(|view| (view, camera)).collect(),
        figures: vec![("share of the picture".into(), share)],
        ..Proposal::itself(
            "corner-only",
            Severity::Warning,
            format!("points fill only x {left:.0} to {right:.0}, y {top:.0} to {bottom:.0} of the picture (about {:.0} %): the lens beyond is extrapolated", 100.0 * share),
            "show the chart in all parts of the picture in which points will be located",
        )
    })
}

/// The box that holds nearly all pixels of a camera: left, top, right, bottom.
pub(super) fn pixel_box(data: &Dataset, camera: usize) -> Option<[f64; 4]> {
    let seen: Vec<Pixel> =
        data.correspondences.iter().filter_map(|c| *c.pixels.get(camera)?).collect();
    if seen.len() < LEAST {
        return None;
    }
    let along = |axis: usize, share: f64| {
        let values: Vec<f64> = seen.iter().map(|pixel| pixel[axis]).collect();
        percentile(&values, share)
    };
    Some([along(0, 0.01), along(1, 0.01), along(0, 0.99), along(1, 0.99)])
}
