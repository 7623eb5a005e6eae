//! Pictures taken at once, of the sizes that cameras have.

use crate::picture_sets::refuse_another_cameras;
use std::path::PathBuf;
use wheatstone::{
    Calibration, Error,
    imaging::{ColourImage, Limits, read_colour_image, read_size},
    reconstruction::SceneReconstructor,
};

/// The sizes of the first pictures taken at once that can be of these cameras: a broken file in a series costs its own
/// frame only, also where it is the first.
pub(super) fn sizes(
    frames: &[Vec<PathBuf>],
    model: &Calibration,
    cameras: &[usize],
) -> Result<Vec<[u32; 2]>, Error> {
    let of_frame = |frame: &Vec<PathBuf>| {
        let of_picture = |(path, camera): (&PathBuf, &usize)| {
            let found = read_size(path)?;
            refuse_another_cameras(path, found, model.picture_size(*camera))?;
            Ok(found)
        };
        frame.iter().zip(cameras).map(of_picture).collect()
    };
    let mut all = frames.iter().map(of_frame);
    let first = all.next().unwrap_or_else(|| Ok(Vec::new()));
    first.or_else(|error| all.find_map(Result::ok).ok_or(error))
}

/// Pictures taken at once.
pub(super) fn read(
    frame: &[PathBuf],
    made: &SceneReconstructor,
) -> Result<Vec<ColourImage>, Error> {
    let of_camera = |(path, size): (&PathBuf, &[u32; 2])| {
        let picture = read_colour_image(path, Limits::default())?;
        let found = [picture.gray.width(), picture.gray.height()].map(|side| side as u32);
        refuse_another_cameras(path, found, Some(*size))?;
        Ok(picture)
    };
    frame.iter().zip(&made.settings().sizes).map(of_camera).collect()
}

/// `100,80,320,240`.
pub(super) fn region(text: &str) -> Result<[u32; 4], String> {
    let parts: Result<Vec<u32>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let parts = parts.ok().and_then(|parts| <[u32; 4]>::try_from(parts).ok());
    parts
        .filter(|[_, _, width, height]| *width > 0 && *height > 0)
        .ok_or_else(|| "write left, top, width and height in pixels as 100,80,320,240".into())
}
