//! What is said where a chart is found in too few pictures, or in none.

use super::{Picture, Read};
use crate::{capture::Capture, chart::ChartSearch};
use rayon::prelude::*;
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
};

/// A few pictures tell; looking at all would take as long again.
const LOOKED_AT: usize = 6;

/// Where the chart is in few pictures, looks for what the user may have declared otherwise than it is, and
/// says so.
pub(super) fn refuse_a_mistake(
    capture: &Capture,
    pictures: &[&Picture],
    (seen, read): (usize, Read),
) -> Result<()> {
    refuse_a_miscount(capture, pictures, (seen, read))?;
    let without = pictures.iter().filter(|picture| picture.outcome.is_err());
    let few: Vec<&&Picture> = without.take(LOOKED_AT).collect();
    let told: Vec<String> = few
        .par_iter()
        .filter_map(|picture| capture.chart.misdeclared(&read(&picture.path).ok()?))
        .collect();
    let mut counts: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
    for meant in &told {
        *counts.entry(meant).or_default() += 1;
    }
    // Pictures that show a part of the chart may tell of fewer rows.
    let most = counts.iter().max_by_key(|(_, count)| **count);
    let Some((meant, found)) = most.filter(|_| 2 * told.len() > few.len()) else { return Ok(()) };
    Err(Error::Degenerate {
        problem: found_in(seen, pictures),
        hint: format!(
            "did you mean {meant}? So it is found in {found} of {} of the others",
            few.len()
        )
        .into(),
    })
}

fn found_in(seen: usize, pictures: &[&Picture]) -> String {
    match seen {
        0 => format!("the chart was found in none of {} pictures", pictures.len()),
        _ => format!("the chart was found in only {seen} of {} pictures", pictures.len()),
    }
}

/// Looks for the chart that is left when squares were counted instead of corners, and says so if it is there.
fn refuse_a_miscount(
    capture: &Capture,
    pictures: &[&Picture],
    (seen, read): (usize, Read),
) -> Result<()> {
    let Some(meant) = capture.chart.miscounted() else { return Ok(()) };
    let few: Vec<&&Picture> = pictures.iter().take(LOOKED_AT).collect();
    let found = few
        .par_iter()
        .filter(|picture| {
            read(&picture.path)
                .is_ok_and(|image| matches!(meant.detect(&image), ChartSearch::Found(_)))
        })
        .count();
    if 2 * found <= few.len() {
        return Ok(());
    }
    let described = serde_json::to_value(&meant).unwrap_or_default();
    Err(Error::Degenerate {
        problem: found_in(seen, pictures),
        hint: format!(
            "with `columns = {}`, `rows = {}` it is found in {found} of the first {}: count inner corners or crossings, not squares",
            described["columns"],
            described["rows"],
            few.len()
        )
        .into(),
    })
}

/// The error for a capture without a single chart, naming the commonest reason.
pub(super) fn nothing_found(capture: &Capture, pictures: &[&Picture]) -> Error {
    let mut reasons: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
    for picture in pictures {
        if let Err(why) = &picture.outcome {
            *reasons.entry(why).or_default() += 1;
        }
    }
    let total: usize = reasons.values().sum();
    let (why, count) = reasons
        .iter()
        .max_by_key(|(_, count)| **count)
        .map_or(("no picture", 0), |(why, count)| (*why, *count));
    let hint = match crate::chart::lattice::size_in_reason(why) {
        Some((width, height)) => format!(
            "did you mean `columns = {width}`, `rows = {height}`? Count inner corners, crossings or dots; for a charuco board count squares, for an april-grid tags"
        )
        .into(),
        None => Hint::new(
            format!("compare the pictures with [chart] in `{}`", capture.path.display()),
            Remedy::ShowDetections,
        ),
    };
    Error::Degenerate {
        problem: format!(
            "the chart was found in none of {total} pictures; in {count} of them: {why}"
        ),
        hint,
    }
}
