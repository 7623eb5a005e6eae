//! Data with their faults put right, and the pictures that can only be left out.

use super::{
    evidence::{Cell, Evidence},
    finding::{Change, Finding},
    frame::Frame,
    views::{View, views},
};
use crate::{Error, Result, dataset::Dataset};
use std::collections::BTreeSet;
use wheatstone_numeric::statistics::median;

/// The data with all faults put right that can be, in the order of the findings.
#[must_use]
pub fn repair_all(data: &Dataset, findings: &[Finding]) -> Dataset {
    let (repaired, dropped) = changed(data, findings);
    // A point that no camera is left with says nothing.
    repaired.subset(|row, c| !dropped[row] && c.seen_by() > 0)
}

/// The same, where the findings can be believed.
///
/// # Errors
///
/// [`Error::Degenerate`] where there is a [`doubt`].
pub fn repair(data: &Dataset, findings: &[Finding]) -> Result<Dataset> {
    match doubt(data, findings) {
        Some(why) => Err(not_corrected(&why)),
        None => Ok(repair_all(data, findings)),
    }
}

/// That there is this doubt.
pub(in crate::preparation) fn not_corrected(doubt: &str) -> Error {
    Error::Degenerate {
        problem: format!("not corrected: {doubt}"),
        hint: "look at the views that are blamed and at those that are not; record again what is wrong".into(),
    }
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
            Change::Board { row, to } => {
                if let Some(c) = repaired.correspondences.get_mut(*row) {
                    c.board = Some(*to);
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

/// Why the changes that these findings ask for are not to be believed, if they are not: most views are blamed one by
/// one, or views that were not touched fit worse to what was.
#[must_use]
pub fn doubt(data: &Dataset, findings: &[Finding]) -> Option<String> {
    findings.iter().find(|finding| finding.is_fixable())?;
    let all = views(data, &Frame::of(data)).len();
    if let Some(why) = blames_most(all, findings) {
        return Some(why);
    }
    let (mut repaired, dropped) = changed(data, findings);
    let is_touched =
        |row: usize| dropped[row] || repaired.correspondences[row] != data.correspondences[row];
    let touched: Vec<bool> = (0..dropped.len()).map(is_touched).collect();
    repaired = repaired.subset(|row, _| !dropped[row]);
    let kept: Vec<bool> = touched
        .iter()
        .zip(&dropped)
        .filter(|(_, dropped)| !**dropped)
        .map(|(own, _)| *own)
        .collect();
    let (after, alone) = (Evidence::new(&repaired), data.subset(|row, _| !touched[row]));
    let untouched = |_: usize, cell: &Cell| cell.rows.iter().all(|row| !kept[*row]);
    worse(&after, &Evidence::new(&alone), untouched)
}

/// Whether these findings blame most of so many views one by one, in words.
pub(in crate::preparation) fn blames_most(views: usize, findings: &[Finding]) -> Option<String> {
    let fixable = findings.iter().filter(|finding| finding.is_fixable());
    let single = fixable.filter(|finding| 2 * finding.views.len() < views);
    let blamed: BTreeSet<&String> = single.flat_map(|finding| &finding.views).collect();
    (views > 3 && 2 * blamed.len() > views).then(|| {
        format!(
            "{} of {views} views are blamed one by one: then it is rather the others, or something else, that is wrong",
            blamed.len()
        )
    })
}

/// Whether views that were not changed (by name) fit worse to data with the changes than to data without the changed
/// views, in words.
pub(in crate::preparation) fn fits_worse(
    after: &Dataset,
    alone: &Dataset,
    is_changed: &dyn Fn(&String) -> bool,
) -> Option<String> {
    let after = Evidence::new(after);
    worse(&after, &Evidence::new(alone), |view, _| !is_changed(&after.views[view].name))
}

/// Whether untouched cells of `after` (by view) miss more than the cells of what is `alone`, in words.
fn worse(
    after: &Evidence,
    alone: &Evidence,
    is_untouched: impl Fn(usize, &Cell) -> bool,
) -> Option<String> {
    (0..after.data.cameras).find_map(|camera| {
        let cells = after.cells.iter().enumerate().map(|(view, cells)| (view, &cells[camera]));
        let untouched = cells.filter(|(view, cell)| is_untouched(*view, cell));
        let [with, without] = [
            typical(untouched.map(|(_, cell)| cell)),
            typical(alone.cells.iter().map(|view| &view[camera])),
        ];
        // Few views tell a camera less well than many.
        (with > 3.0 * without + 0.2).then(|| {
            format!(
                "views of camera {} that are not touched miss by {with:.2} px after it, by themselves by {without:.2} px",
                camera + 1
            )
        })
    })
}

/// Median of the errors of views that were judged.
fn typical<'a>(cells: impl Iterator<Item = &'a Cell>) -> f64 {
    median(&cells.map(|cell| cell.error).filter(|error| error.is_finite()).collect::<Vec<f64>>())
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
    for (name, rows) in pictures(data) {
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

/// The rows of each view: those of the file where charts have no places yet.
fn pictures(data: &Dataset) -> Vec<(String, Vec<usize>)> {
    if data.correspondences.iter().all(|row| row.world.is_some()) {
        let all = views(data, &Frame::of(data)).into_iter();
        return all.map(|View { name, rows, .. }| (name, rows)).collect();
    }
    let rows = |view: usize| {
        let all = data.correspondences.iter().enumerate();
        all.filter(|(_, row)| row.view == view).map(|(index, _)| index).collect()
    };
    data.views.iter().enumerate().map(|(view, name)| (name.clone(), rows(view))).collect()
}
