//! What makes pictures worthless, told.

use super::depths::searched;
use crate::{exposure::badly_exposed, failure::Failure, progress::Bar, verbosity::remark};
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

/// What is wrong with pictures that were taken at once, if anything, and the way out.
pub(super) fn of(
    found: &Reconstruction,
    of: (&SceneReconstructor, &Calibration),
    both: (&[PathBuf], &[&ColourImage]),
    bar: &Bar,
) -> Result<Option<[String; 2]>, Error> {
    match found.fault {
        Some(fault) => told((found, fault), of, both, bar).map(Some),
        None => Ok(contradicting(found, both.0)),
    }
}

/// Pictures that are not reconstructed.
pub(super) fn refusal([problem, hint]: [String; 2]) -> Failure {
    Failure::Library(Error::Degenerate { problem, hint: hint.into() })
}

fn told(
    (found, (cameras, fault)): (&Reconstruction, ([usize; 2], PairFault)),
    (made, model): (&SceneReconstructor, &Calibration),
    (frame, pictures): (&[PathBuf], &[&ColourImage]),
    bar: &Bar,
) -> Result<[String; 2], Error> {
    let is_blind = matches!(fault, PairFault::Vertical(_) | PairFault::NothingInCommon { .. });
    let unfit = found.checks.iter().filter(|check| check.fault.is_some() && is_blind);
    let unfit: Vec<usize> = unfit.map(|check| check.cameras[1]).collect();
    if let Some(both) = made.exchanged(&unfit, pictures, bar)? {
        let order = &made.settings().cameras;
        let files = order.iter().zip(frame).filter(|(camera, _)| both.contains(camera));
        let files = listed(files.map(|(_, path)| path));
        let [a, b] = both.map(|camera| camera + 1);
        let problem = format!("{files}: the pictures of cameras {a} and {b} are exchanged");
        return Ok([problem, way_out(&PairFault::Exchanged, made, model)]);
    }
    let mut problem = named(made, (cameras, fault), frame);
    if let Some(turned) = found.turned {
        let camera = turned.camera + 1;
        problem += &format!("; of these cameras, camera {camera} alone explains it");
    }
    if let PairFault::NothingInCommon { .. } = fault {
        let badly = |(path, picture): (&PathBuf, &&ColourImage)| badly_exposed(path, &picture.gray);
        problem.extend(frame.iter().zip(pictures).filter_map(badly));
    }
    Ok([problem, way_out(&fault, made, model)])
}

/// Refuses pictures of several frames that [contradict](contradicting) each other, unless that is insisted on.
pub(super) fn refuse_contradicting(
    found: &Reconstruction,
    frame: &[PathBuf],
    insist: bool,
) -> Result<(), Failure> {
    contradicting(found, frame).filter(|_| !insist).map_or(Ok(()), |told| Err(refusal(told)))
}

/// What is wrong where pictures fit each other row by row, and the cloud would be wrong: the camera with which all others are
/// matched has moved, or depths contradict each other and nobody is known to be the reason.
fn contradicting(found: &Reconstruction, frame: &[PathBuf]) -> Option<[String; 2]> {
    /// Standard deviations, in the median: below, a cloud is worse than told, and above it is another one.
    const GREAT: f64 = 10.0;
    let is_kept = found.turned.is_some_and(|turned| !found.left_out.contains(&turned.camera));
    let contradiction = found.contradiction.as_ref().filter(|_| found.turned.is_none());
    let is_unresolved = contradiction.is_some_and(|it| it.left_out.is_none() && it.sigmas > GREAT);
    // Where rows do not fit one camera, and those of the other pair drift apart, the camera of both may be the reason.
    let is_shared = found.sideways.is_some() && !found.left_out.is_empty();
    let problem = || format!("{}: {}", listed(frame), found.doubts(1).join("; "));
    (is_kept || is_unresolved || is_shared).then(|| [problem(), MOVED.into()])
}

const MOVED: &str = "nothing was written; fit again if a camera has moved (`wheatstone check POINTS --against MODEL` says which), \
     with another method if the model does not fit the optics (`wheatstone evaluate`), take pictures of one instant, or go on \
     with `--force`";

/// What to do about a fault.
fn way_out(fault: &PairFault, made: &SceneReconstructor, model: &Calibration) -> String {
    match fault {
        PairFault::Vertical(_) => MOVED.into(),
        PairFault::Exchanged => "nothing was written; exchange the two pictures".into(),
        PairFault::SamePicture => "nothing was written; give the pictures of two cameras".into(),
        _ => format!(
            "nothing was written; depths of {} were searched: `--range NEAR:FAR` names others; are the pictures of one \
             instant, in the order of the cameras, and have those not moved? `--force` goes on",
            searched(made, model)
        ),
    }
}

/// Says which cameras are left out, and by the pictures whether two of them are exchanged; and what makes standard
/// deviations doubtful.
pub(super) fn warn_left_out(
    found: &Reconstruction,
    made: &SceneReconstructor,
    (pictures, bar): (Option<&[&ColourImage]>, &Bar),
) -> Result<(), Error> {
    for doubt in found.doubts(1) {
        remark!(
            "warning",
            "{doubt}; fit again, or add a view of the chart (`wheatstone check POINTS --against MODEL` says which camera \
             has moved)"
        );
    }
    let contradicting = found.contradiction.as_ref().and_then(|told| told.left_out);
    let told = [contradicting, found.turned.map(|turned| turned.camera)];
    let unfit: Vec<usize> =
        found.left_out.iter().copied().filter(|camera| !told.contains(&Some(*camera))).collect();
    let exchanged = match pictures {
        Some(pictures) => made.exchanged(&unfit, pictures, bar)?,
        None => None,
    };
    if let Some([a, b]) = exchanged.map(|both| both.map(|camera| camera + 1)) {
        remark!("warning", "cameras {a} and {b} are left out: their pictures are exchanged");
    }
    let offset = |camera: usize| {
        let check = found.checks.iter().find(|check| check.cameras[1] == camera)?;
        check.fault.filter(|fault| matches!(fault, PairFault::Vertical(_)))
    };
    for camera in &unfit {
        if exchanged.is_some_and(|both| both.contains(camera)) {
            continue;
        }
        if let Some(fault) = offset(*camera) {
            remark!("warning", "camera {} is left out: {fault}", camera + 1);
        } else {
            remark!(
                "warning",
                "camera {} is left out: hardly anything of its picture matches that of camera {}; are the pictures of one \
                 instant and in the order of the cameras, or has it moved (`wheatstone check POINTS --against MODEL`)?",
                camera + 1,
                made.pair().cameras[0] + 1
            );
        }
    }
    Ok(())
}
