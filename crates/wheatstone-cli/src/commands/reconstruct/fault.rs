//! What makes pictures worthless, told.

use super::depths::searched;
use crate::{progress::Bar, verbosity::remark};
use std::path::PathBuf;
use wheatstone::{
    Calibration, Error,
    imaging::ColourImage,
    reconstruction::{Reconstruction, SceneReconstructor},
    stereo::PairFault,
};

/// `left.png and right.png`.
pub(super) fn listed<'p>(pictures: impl IntoIterator<Item = &'p PathBuf>) -> String {
    let names: Vec<String> = pictures.into_iter().map(|path| path.display().to_string()).collect();
    names.join(" and ")
}

/// A fault, after the names of the pictures that it is between.
pub(super) fn named(
    made: &SceneReconstructor,
    (cameras, fault): ([usize; 2], PairFault),
    frame: &[PathBuf],
) -> String {
    let order = &made.settings().cameras;
    let at_fault = order.iter().zip(frame).filter(|(camera, _)| cameras.contains(camera));
    format!("{}: {fault}", listed(at_fault.map(|(_, path)| path)))
}

/// What to do about a fault.
pub(super) fn way_out(fault: &PairFault, made: &SceneReconstructor, model: &Calibration) -> String {
    match fault {
        PairFault::Vertical(_) => {
            "nothing was written; fit again if a camera has moved (`wheatstone check POINTS --against MODEL` says which), \
             with another method if the model does not fit the optics (`wheatstone evaluate`), or go on with `--force`"
                .into()
        }
        PairFault::Exchanged => "nothing was written; exchange the two pictures".into(),
        PairFault::SamePicture => "nothing was written; give the pictures of two cameras".into(),
        _ => format!(
            "nothing was written; depths of {} were searched: `--range NEAR:FAR` names others; `--force` goes on",
            searched(made, model)
        ),
    }
}

/// Says which cameras are left out, and by the pictures whether two of them are exchanged.
pub(super) fn warn_left_out(
    found: &Reconstruction,
    made: &SceneReconstructor,
    (pictures, bar): (Option<&[&ColourImage]>, &Bar),
) -> Result<(), Error> {
    let exchanged = match pictures {
        Some(pictures) => made.exchanged(&found.left_out, pictures, bar)?,
        None => None,
    };
    if let Some([a, b]) = exchanged.map(|both| both.map(|camera| camera + 1)) {
        remark!("warning", "cameras {a} and {b} are left out: their pictures are exchanged");
    }
    for camera in &found.left_out {
        if !exchanged.is_some_and(|both| both.contains(camera)) {
            remark!(
                "warning",
                "camera {} is left out: hardly anything of its picture matches that of camera {}; are the pictures in \
                 the order of the cameras?",
                camera + 1,
                made.pair().cameras[0] + 1
            );
        }
    }
    Ok(())
}
