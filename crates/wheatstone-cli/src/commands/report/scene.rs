//! The scene in a capture's folder, for the report.

use crate::{commands::reconstruct::results, failure::Outcome, progress::Bar};
use std::path::PathBuf;
use wheatstone::{
    Calibration, Error,
    imaging::{ColourImage, Limits, read_colour_image, read_size},
    reconstruction::{ReconstructionSettings, SceneReconstructor},
    report::SceneFigures,
};

/// Reconstructs what the pictures show. Where that cannot be done, the report says why.
pub(super) fn figures(
    model: &Calibration,
    (pictures, depths): (&[PathBuf], Option<[f64; 2]>),
    bar: &Bar,
) -> Outcome<SceneFigures> {
    match reconstruct(model, (pictures, depths), bar) {
        Ok(figures) => Ok(figures),
        Err(Error::Cancelled) => Err(Error::Cancelled.into()),
        Err(problem) => Ok(SceneFigures {
            pictures: results::names(pictures),
            problem: Some(problem.to_string()),
            ..SceneFigures::default()
        }),
    }
}

fn reconstruct(
    model: &Calibration,
    (pictures, depths): (&[PathBuf], Option<[f64; 2]>),
    bar: &Bar,
) -> Result<SceneFigures, Error> {
    let sizes: Vec<[u32; 2]> =
        pictures.iter().map(|path| read_size(path)).collect::<Result<_, Error>>()?;
    let settings = ReconstructionSettings { depths, ..ReconstructionSettings::new(sizes) };
    let made = SceneReconstructor::new(model, settings, bar)?;
    let read = |path: &PathBuf| read_colour_image(path, Limits::default());
    let images: Vec<ColourImage> = pictures.iter().map(read).collect::<Result<_, Error>>()?;
    let found = made.reconstruct(&images.iter().collect::<Vec<_>>(), bar)?;
    Ok(results::figures(&found, (&made, model), pictures))
}
