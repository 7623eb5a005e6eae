//! Bodies whose points are known in three dimensions: recognised by how their points lie to each other,
//! under any camera.

mod body;
mod corners;
mod evidence;
mod marks;
mod matching;
mod search;
mod view;
mod pose_hypotheses;

use super::{ChartSearch, PointId};
use crate::imaging::GrayImage;
use serde::{Deserialize, Serialize};
use wheatstone_core::geometry::{Pixel, Point3};

/// What a body's marks are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MarkKind {
    /// Dots, squares or other small compact patches, dark or bright; the points are their centres.
    #[default]
    Patches,
    /// Corners at which four squares of a chessboard meet; boards may meet at an edge.
    Corners,
}

/// Looks for a body by its marks.
///
/// `named` are points that someone has seen in this picture, to some pixels: four or more that are not on
/// one line lead the search where nothing else does; fewer tell apart what looks alike.
#[must_use]
pub fn find(
    points: &[Point3],
    kind: MarkKind,
    image: &GrayImage,
    named: &[(PointId, Pixel)],
) -> ChartSearch {
    let sizes = match kind {
        MarkKind::Patches => marks::find(image, points.len()),
        MarkKind::Corners => vec![corners::find(image, points.len())],
    };
    search::find(&body::Body::new(points.to_vec()), &sizes, image, named)
}
