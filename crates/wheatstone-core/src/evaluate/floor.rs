//! What physics allows: the error of the most likely point given the true cameras and the same noisy
//! pixels. No method does better on average.

use super::{Evaluation, PointError, judged, summarise};
use crate::{
    Result,
    camera::PosedCamera,
    dataset::Dataset,
    geometry::{Pixel, Point3, Vector3, triangulation},
};

/// Judges maximum-likelihood triangulation with the true `cameras` on `data`.
///
/// # Errors
///
/// [`crate::Error::Degenerate`] where no point could be located.
pub fn floor(cameras: &[PosedCamera], data: &Dataset) -> Result<Evaluation> {
    let centres: Vector3 = cameras.iter().map(|camera| camera.centre().coords).sum();
    let viewpoint = Point3::from(centres / cameras.len().max(1) as f64);
    let errors: Vec<PointError> = data
        .correspondences
        .iter()
        .enumerate()
        .filter_map(|(index, row)| {
            let world = row.world?;
            let (used, seen): (Vec<&PosedCamera>, Vec<Pixel>) =
                cameras.iter().zip(&row.pixels).filter_map(|(c, p)| Some((c, (*p)?))).unzip();
            if seen.len() < 2 {
                return None;
            }
            // From the truth the search cannot end in a wrong minimum.
            let found = triangulation::refine(world, &seen, |index, point| {
                used[index].project_with_jacobian(point)
            })?;
            Some(PointError {
                row: index,
                difference: found.point - world,
                working_distance: (world - viewpoint).norm(),
            })
        })
        .collect();
    summarise(&errors, judged(data), &data.unit)
}
