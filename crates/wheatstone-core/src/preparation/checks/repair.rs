//! Data with their faults put right, and the pictures that can only be left out.

use super::{
    finding::{Change, Finding},
    frame::Frame,
    views::{View, views},
};
use crate::dataset::Dataset;

/// The data with all faults put right that can be, in the order of the findings.
#[must_use]
pub fn repair_all(data: &Dataset, findings: &[Finding]) -> Dataset {
    let (repaired, dropped) = changed(data, findings);
    // A point that no camera is left with says nothing.
    repaired.subset(|row, c| !dropped[row] && c.seen_by() > 0)
}

/// All changes made but for rows to be removed, which are marked.
fn changed(data: &Dataset, findings: &[Finding]) -> (Dataset, Vec<bool>) {
    let mut repaired = data.clone();
    let mut dropped = vec![false; data.correspondences.len()];
    for change in findings.iter().flat_map(|finding| &finding.changes) {
        match change {
            Change::Pixel { row, camera, to } => {
                let pixels = repaired.correspondences.get_mut(*row).map(|c| &mut c.pixels);
                if let Some(pixel) = pixels.and_then(|pixels| pixels.get_mut(*camera)) {
                    *pixel = *to;
                }
            }
            Change::World { row, to } => {
                if let Some(c) = repaired.correspondences.get_mut(*row) {
                    c.world = Some(*to);
                }
            }
            Change::Drop { row } => {
                if let Some(gone) = dropped.get_mut(*row) {
                    *gone = true;
                }
            }
        }
    }
    (repaired, dropped)
}

/// The pictures of which [`repair_all`] leaves nothing: the view's name and the camera, counted from 0. Nothing corrects
/// them, so the calibration is less certain than that of a recording without fault. Points that are there twice do not
/// count.
#[must_use]
pub fn left_out(data: &Dataset, findings: &[Finding]) -> Vec<(String, usize)> {
    let (repaired, dropped) = changed(data, findings);
    let is_seen = |data: &Dataset, row: usize, camera: usize| {
        data.correspondences[row].pixels.get(camera).is_some_and(Option::is_some)
    };
    let mut left_out = Vec::new();
    for View { name, rows, .. } in views(data, &Frame::of(data)) {
        let kept: Vec<usize> = rows.into_iter().filter(|row| !dropped[*row]).collect();
        for camera in 0..data.cameras {
            let has = |data: &Dataset| kept.iter().any(|row| is_seen(data, *row, camera));
            if has(data) && !has(&repaired) {
                left_out.push((name.clone(), camera));
            }
        }
    }
    left_out
}
