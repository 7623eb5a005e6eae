//! Lengths that somebody measured, against those that the data say.

use super::finding::{Finding, Severity};
use crate::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::Point3,
};
use wheatstone_numeric::statistics::median;

/// A length between the charts of two views, as measured on the stage.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedDistance {
    /// The names of the views.
    pub views: [String; 2],
    /// How far apart their charts are, in the data's unit.
    pub length: f64,
}

/// By what share of the measured length the data may differ.
const TOLERANCE: f64 = 0.01;

/// Compares how far apart the charts of two views are with what was measured: the median over points that both show, by
/// name, or by their order where they have none. A finding where they differ by more than a hundredth.
///
/// # Errors
///
/// [`Error::UnknownName`] for a view that is not there; [`Error::Degenerate`] where the two share no point with a place.
pub fn compare_distance(data: &Dataset, expected: &ExpectedDistance) -> Result<Option<Finding>> {
    let [first, second] = &expected.views;
    let [one, other] = [places(data, first)?, places(data, second)?];
    let named = |row: &&Correspondence| row.id.is_some();
    let is_named = one.iter().chain(&other).all(|(row, _)| named(row));
    let mut apart = Vec::new();
    for (rank, (row, place)) in one.iter().enumerate() {
        let twin = if is_named {
            other.iter().find(|(twin, _)| twin.id == row.id)
        } else {
            other.get(rank).filter(|_| one.len() == other.len())
        };
        apart.extend(twin.map(|(_, twin)| (twin - place).norm()));
    }
    if apart.is_empty() {
        return Err(Error::Degenerate {
            problem: format!("views `{first}` and `{second}` share no point with a place"),
            hint: "give two views of the whole chart, at known places".into(),
        });
    }
    let (own, wanted) = (median(&apart), expected.length);
    let ratio = own / wanted;
    if (ratio - 1.0).abs() <= TOLERANCE {
        return Ok(None);
    }
    Ok(Some(Finding {
        views: expected.views.to_vec(),
        figures: vec![("distance by the data".to_owned(), own)],
        ..Finding::of_all(
            "distance-differs",
            Severity::Fatal,
            format!(
                "the charts of views `{first}` and `{second}` are {own:.6} apart by these data and {wanted} by your measurement (ratio {ratio:.4}): an axis has another unit, or the measurement is wrong"
            ),
            "measure the stage's steps again, and give all coordinates in one unit",
        )
    }))
}

/// The rows of a view that have places.
fn places<'a>(data: &'a Dataset, view: &str) -> Result<Vec<(&'a Correspondence, Point3)>> {
    let index = data.views.iter().position(|own| own == view).ok_or_else(|| {
        Error::UnknownName { kind: "view", name: view.into(), known: data.views.clone() }
    })?;
    let rows = data.correspondences.iter().filter(|row| row.view == index);
    Ok(rows.filter_map(|row| Some((row, row.world?))).collect())
}
