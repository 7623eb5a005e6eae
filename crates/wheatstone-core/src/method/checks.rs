//! What every method needs of the points that it is fitted to.

use crate::{
    Error, Result,
    dataset::Dataset,
    geometry::{Pixel, Point3, ProjectionMatrix},
};

/// Points that lie flatter than this share of their extent are one plane to any method: a tenth of a
/// millimetre over a metre is what a good chart is flat to.
const FLATTEST: f64 = 1e-4;

/// Refuses data from which no method can learn depth.
///
/// # Errors
///
/// [`Error::Degenerate`] or [`Error::TooFew`], with what to add.
pub fn depth_is_observable(train: &Dataset) -> Result<()> {
    let known = train.known().count();
    if known == 0 {
        let problem = "no point has known world coordinates".into();
        let hint = if train.correspondences.iter().any(|c| c.board.is_some()) {
            "give the chart poses: `translation` in each [[views]] of the capture, or columns `X,Y,Z`"
        } else {
            "give columns `X,Y,Z` with the world coordinates of the points"
        };
        return Err(Error::Degenerate { problem, hint: hint.into() });
    }
    let matched = train.known().filter(|(_, c)| c.seen_by() >= 2).count();
    if train.cameras >= 2 && matched < 4 {
        return Err(Error::TooFew {
            method: "any method".into(),
            what: "points with known coordinates that two cameras see".into(),
            need: 4,
            got: matched,
        });
    }
    if train.flatness() < FLATTEST {
        return Err(Error::Degenerate {
            problem: format!(
                "all {known} points with known coordinates lie on one plane, so depth cannot be calibrated"
            ),
            hint: "show the chart at two or more distances, better four to seven".into(),
        });
    }
    Ok(())
}

/// Refuses fewer points than a method needs, of those that a camera (counted from 0) saw or, where none is
/// named, of those that all saw.
pub(super) fn enough(method: &str, camera: Option<usize>, need: usize, got: usize) -> Result<()> {
    if got >= need {
        return Ok(());
    }
    let what = match camera {
        Some(camera) => format!("points seen by camera {}", camera + 1),
        None => "points seen by all cameras".into(),
    };
    Err(Error::TooFew { method: method.into(), what, need, got })
}

/// What one camera saw determines no camera.
pub(super) fn on_one_plane(camera: usize) -> Error {
    Error::Degenerate {
        problem: format!("the points seen by camera {} lie on one plane", camera + 1),
        hint: "show it points at two or more distances".into(),
    }
}

/// The camera in closed form, or why there is none.
pub(super) fn linear_camera(camera: usize, pairs: &[(Point3, Pixel)]) -> Result<ProjectionMatrix> {
    ProjectionMatrix::fit(pairs).ok_or_else(|| on_one_plane(camera))
}
