//! Pictures of two cameras exchanged in some views.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Change, Freedom, Proposal, Severity},
};

pub(super) struct CamerasSwapped;

impl Fault for CamerasSwapped {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let mut found = Vec::new();
        for view in 0..evidence.views.len() {
            let suspects = evidence.suspects(view);
            for (place, first) in suspects.iter().enumerate() {
                for second in &suspects[place + 1..] {
                    found.extend(swapped(evidence, view, [*first, *second]));
                }
            }
        }
        found
    }
}

fn swapped(evidence: &Evidence, view: usize, cameras: [usize; 2]) -> Option<Proposal> {
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
    let left = each[0].max(each[1]);
    let mut changes = Vec::new();
    for row in &evidence.views[view].rows {
        let pixels = &evidence.data.correspondences[*row].pixels;
        for [own, other] in [cameras, [cameras[1], cameras[0]]] {
            changes.push(Change::Pixel { row: *row, camera: own, to: pixels[other] });
        }
    }
    Some(Proposal {
        freedom: Freedom::Choice,
        left,
        cells: cameras.map(|camera| (view, camera)).to_vec(),
        also: Vec::new(),
        key: String::new(),
        code: "cameras-swapped",
        severity: Severity::Fatal,
        what: format!(
            "the pictures of cameras {} and {} are exchanged: each fits the other's camera",
            cameras[0] + 1,
            cameras[1] + 1
        ),
        hint: "exchange the two pictures (or columns) of these views, or let them be exchanged"
            .into(),
        figures: Vec::new(),
        changes,
        is_estimate: false,
    })
}
