//! Bodies whose points are known in three dimensions: recognised by how their points lie to each other,
//! under any camera.

mod body;
mod evidence;
mod marks;
mod matching;
mod search;
mod view;
mod ways;

use super::{PointId, Sighting};
use crate::{
    geometry::{Pixel, Point3},
    imaging::GrayImage,
};

/// Looks for a body whose marks are dots, squares or other small compact patches, dark or bright.
///
/// `named` are points that someone has seen in this picture, to some pixels: four or more that are not on
/// one line lead the search where nothing else does; fewer tell apart what looks alike.
#[must_use]
pub fn find(points: &[Point3], image: &GrayImage, named: &[(PointId, Pixel)]) -> Sighting {
    search::find(&body::Body::new(points.to_vec()), image, named)
}
