//! Data of which nothing can be said: next to no points, a camera that saw nothing, a camera whose pixels are all the
//! same. To find no fault in them would say that they are sound.

use super::{
    Fault,
    evidence::Evidence,
    finding::{Proposal, Severity},
    views::LEAST,
};
use crate::geometry::Pixel;

pub(super) struct Unusable;

impl Fault for Unusable {
    fn propose(&self, evidence: &Evidence) -> Vec<Proposal> {
        let rows = &evidence.data.correspondences;
        let placed = |row: &&_| is_placed(row);
        let count = rows.iter().filter(placed).count();
        let mut found = Vec::new();
        if count < LEAST {
            let what =
                format!("{count} points with pixels and places: nothing can be told of them");
            let hint = "show the chart in several poses, with ten points or more in each";
            found.push(Proposal::itself("too-few-points", Severity::Fatal, what, hint));
            return found;
        }
        for camera in 0..evidence.data.cameras {
            let pixels: Vec<Pixel> =
                rows.iter().filter_map(|row| *row.pixels.get(camera)?).collect();
            found.extend(of_camera(camera, &pixels));
        }
        found
    }
}

/// Whether a row says where a point is and where a camera saw it.
fn is_placed(row: &crate::dataset::Correspondence) -> bool {
    (row.world.is_some() || row.board.is_some()) && row.seen_by() > 0
}

fn of_camera(camera: usize, pixels: &[Pixel]) -> Option<Proposal> {
    let number = camera + 1;
    let Some(first) = pixels.first() else {
        return Some(Proposal::itself(
            "camera-without-pixels",
            Severity::Fatal,
            format!("camera {number} sees no point"),
            "give its pixels, or leave its columns out",
        ));
    };
    let apart = pixels.iter().map(|pixel| (pixel - first).norm()).fold(0.0, f64::max);
    (pixels.len() > 1 && apart < 1e-6).then(|| {
        let what = format!("all pixels of camera {number} are the same, {}, {}", first.x, first.y);
        let hint = "these are no measurements: give the pixels of the points";
        Proposal::itself("pixels-constant", Severity::Fatal, what, hint)
    })
}
