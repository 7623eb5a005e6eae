//! Points of matches that another program found.

use super::depths::searched;
use crate::{
    failure::Outcome, matches::GivenMatches, progress::Bar, table::figure, verbosity::remark,
};
use std::path::Path;
use wheatstone::{
    Calibration, Error,
    imaging::ColourImage,
    reconstruction::{Reconstruction, SceneReconstructor},
    stereo::DisparityMap,
};

/// The points of a file of matches with a standard deviation. How many are left out is told, and what makes the pictures
/// worthless is looked for as without matches.
pub(super) fn located(
    (path, sigma): (&Path, f64),
    (made, model): (&SceneReconstructor, &Calibration),
    pictures: &[&ColourImage],
    bar: &Bar,
) -> Outcome<Reconstruction> {
    let given = GivenMatches::read(path, sigma, &made.settings().cameras)?;
    let (found, [kept, all], why) = match given {
        GivenMatches::Disparities(map) => {
            refuse_other_size(path, &map, made)?;
            let all = finite(&map).count();
            if !finite(&map).any(|disparity| made.searches(disparity)) {
                return Err(none_searched(&map, made, model).into());
            }
            let found = made.locate(map, pictures, bar)?;
            let kept = finite(&found.map).count();
            (found, [kept, all], "points outside of the depths of")
        }
        GivenMatches::Pixels(rows) => {
            let found = made.locate_matches(&rows, sigma, pictures, bar)?;
            let kept = found.cloud.len();
            let why = "pixels far from their epipolar lines, or points outside of the pictures and \
                       the depths of";
            (found, [kept, rows.len()], why)
        }
    };
    let found = made.checked(found, pictures, bar)?;
    // Of what is refused it would be one message more.
    if kept < all && found.fault.is_none() && !found.cloud.is_empty() {
        let depths = searched(made, model);
        remark!("note", "{} of {all} matches are left out: {why} {depths}", all - kept);
    }
    Ok(found)
}

/// Refuses an array of another size than the rectified pictures have.
fn refuse_other_size(
    path: &Path,
    map: &DisparityMap,
    made: &SceneReconstructor,
) -> Result<(), Error> {
    let [width, height] = made.pair().size;
    if [map.width, map.height] == [width, height].map(|side| side as usize) {
        return Ok(());
    }
    Err(Error::Malformed {
        path: path.into(),
        line: None,
        problem: format!(
            "an array of {} x {} disparities; the rectified pictures have {width} x {height} pixels",
            map.width, map.height
        ),
        hint: format!(
            "give {height} rows of {width} disparities, one a pixel of the left rectified picture"
        )
        .into(),
    })
}

/// The disparities that there are.
fn finite(map: &DisparityMap) -> impl Iterator<Item = f32> {
    map.disparity.iter().copied().filter(|disparity| disparity.is_finite())
}

/// Of disparities none of which is searched: what they are, and what it may be that is wrong with them.
fn none_searched(map: &DisparityMap, made: &SceneReconstructor, model: &Calibration) -> Error {
    let all = finite(map).count();
    if all == 0 {
        return Error::Degenerate {
            problem: "there is no disparity in the array: all of its values are NaN or infinite"
                .into(),
            hint: "nothing was written; give disparities of the left rectified picture in pixels"
                .into(),
        };
    }
    let (least, most) =
        (finite(map).fold(f32::INFINITY, f32::min), finite(map).fold(f32::NEG_INFINITY, f32::max));
    let range = made.disparities();
    let problem = format!(
        "none of the {all} disparities, {} to {} px, is one of the depths of {}, {} to {} px",
        figure(f64::from(least)),
        figure(f64::from(most)),
        searched(made, model),
        range.start,
        range.end - 1
    );
    /// Of pixels without a match there may be many, with a value that means that.
    const MANY: usize = 10;
    let would_be = |change: fn(f32) -> f32| {
        MANY * finite(map).filter(|disparity| made.searches(change(*disparity))).count() > all
    };
    let way_out = if would_be(|disparity| -disparity) {
        "change their sign: a disparity is x in the left rectified picture less x in the right one"
    } else if would_be(|disparity| disparity / 16.0) {
        "divide them by 16: OpenCV's StereoSGBM and StereoBM write sixteenths of a pixel"
    } else {
        "a disparity is x in the left rectified picture less x in the right one, in pixels; `--range NEAR:FAR` names \
         other depths"
    };
    Error::Degenerate { problem, hint: format!("nothing was written; {way_out}").into() }
}
