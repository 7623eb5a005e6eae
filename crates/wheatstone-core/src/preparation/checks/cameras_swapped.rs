//! Pictures of two cameras exchanged in some views.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
    stretch::{MOST_LEFT, RIGID, Stretch, adjusted, in_other_views, shots},
};

pub(super) struct CamerasSwapped;

impl Fault for CamerasSwapped {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for view in 0..evidence.views.len() {
            let suspects = evidence.suspects(view);
            // An estimated pose may fit one of two exchanged pictures.
            let estimated = !suspects.is_empty() && evidence.has_estimated_pose(view);
            let cameras = if estimated { evidence.present(view) } else { suspects };
            for (place, first) in cameras.iter().enumerate() {
                for second in &cameras[place + 1..] {
                    let pair = [*first, *second];
                    let left = if estimated {
                        with_other_pose(evidence, (view, &cameras), pair)
                    } else {
                        exchanged(evidence, view, pair)
                    };
                    found.extend(left.map(|left| proposal(evidence, view, pair, left)));
                }
            }
        }
        found
    }
}

/// What is left of the errors of two cameras with each other's pictures, where that explains them.
fn exchanged(evidence: &Evidence, view: usize, cameras: [usize; 2]) -> Option<f64> {
    let error = |own: usize, other: usize| {
        let rows = &evidence.cells[view][own].rows;
        evidence.explained((view, own), |index, (world, _)| {
            let pixel = evidence.data.correspondences[rows[index]].pixels[other]?;
            Some((world, pixel))
        })
    };
    let each = [error(cameras[0], cameras[1]), error(cameras[1], cameras[0])];
    if !(evidence.accepts((view, cameras[0]), each[0])
        && evidence.accepts((view, cameras[1]), each[1]))
    {
        return None;
    }
    Some(each[0].max(each[1]))
}

/// The same for a chart whose pose was estimated from pictures of the wrong cameras: with the pose that fits all cameras
/// best once the two have each other's.
fn with_other_pose(
    evidence: &Evidence,
    (view, present): (usize, &[usize]),
    [first, second]: [usize; 2],
) -> Option<f64> {
    let read = |camera: usize, row: usize| {
        let meant = match camera {
            _ if camera == first => second,
            _ if camera == second => first,
            _ => camera,
        };
        evidence.data.correspondences[row].pixels[meant]
    };
    let (shots, given) = shots(evidence, (view, present), read)?;
    let left_from = |start: Stretch| {
        let placed = adjusted(&shots, start, RIGID);
        let left = present.iter().map(|camera| {
            let rows = &evidence.cells[view][*camera].rows;
            evidence.explained((view, *camera), |index, (place, _)| {
                Some((placed.map(place), read(*camera, rows[index])?))
            })
        });
        left.fold(0.0, f64::max)
    };
    let before = [first, second].map(|camera| evidence.excess((view, camera)));
    let most = f64::min(1.0, MOST_LEFT * before[0].max(before[1]));
    let starts = std::iter::once(Stretch::by_scale(given, 1.0));
    let starts = starts.chain(in_other_views(evidence, view, given));
    starts.map(left_from).find(|left| *left <= most)
}

fn proposal(evidence: &Evidence, view: usize, cameras: [usize; 2], left: f64) -> Proposal {
    let mut changes = Vec::new();
    for row in &evidence.views[view].rows {
        let pixels = &evidence.data.correspondences[*row].pixels;
        for [own, other] in [cameras, [cameras[1], cameras[0]]] {
            changes.push(Change::Pixel { row: *row, camera: own, to: pixels[other] });
        }
    }
    Proposal {
        freedom: Freedom::Choice,
        left,
        cells: cameras.map(|camera| (view, camera)).to_vec(),
        changes,
        ..Proposal::itself(
            "cameras-swapped",
            Severity::Fatal,
            format!(
                "the pictures of cameras {} and {} are exchanged: each fits the other's camera",
                cameras[0] + 1,
                cameras[1] + 1
            ),
            "exchange the two pictures (or columns) of these views, or let them be exchanged",
        )
    }
}
