//! What makes pictures worthless, told.

use super::depths::searched;
use std::path::PathBuf;
use wheatstone::{Calibration, reconstruction::SceneReconstructor, stereo::PairFault};

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
