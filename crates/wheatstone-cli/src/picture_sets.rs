//! Pictures of several cameras, as they are named on the command line.

use crate::failure::{Failure, Outcome};
use std::path::{Path, PathBuf};
use wheatstone::{
    Error,
    imaging::{in_counting_order, is_picture},
};

/// Pictures of so many cameras taken at once: a file a camera, a folder a camera in sorted order, or all files of the first
/// camera, then as many of the next, as a shell makes them of `left/*.png right/*.png`.
pub(crate) fn frames(named: &[PathBuf], cameras: usize) -> Outcome<Vec<Vec<PathBuf>>> {
    if !named.len().is_multiple_of(cameras) {
        return Err(Failure::usage(
            format!("{} pictures or folders of {cameras} cameras", named.len()),
            "give the same number for each camera that `--cameras` names",
        ));
    }
    let of_camera = |named: &[PathBuf]| -> Outcome<Vec<PathBuf>> {
        let each: Outcome<Vec<Vec<PathBuf>>> = named.iter().map(|path| files(path)).collect();
        Ok(each?.concat())
    };
    let each = named.chunks((named.len() / cameras).max(1)).map(of_camera);
    let each: Vec<Vec<PathBuf>> = each.collect::<Outcome<_>>()?;
    let counts: Vec<String> = each.iter().map(|files| files.len().to_string()).collect();
    let count = each.first().map_or(0, Vec::len);
    if each.iter().any(|files| files.len() != count) {
        return Err(Failure::usage(
            format!("the cameras have {} pictures", counts.join(", ")),
            "pictures are matched in sorted order: give the same number for each camera",
        ));
    }
    Ok((0..count).map(|index| each.iter().map(|files| files[index].clone()).collect()).collect())
}

/// A file itself; of a folder its pictures, in sorted order.
fn files(path: &Path) -> Outcome<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let reading = |source| Error::Io { action: "read", path: path.into(), source };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(path).map_err(reading)? {
        let entry = entry.map_err(reading)?.path();
        found.extend((entry.is_file() && is_picture(&entry)).then_some(entry));
    }
    if found.is_empty() {
        return Err(Failure::usage(
            format!("{}: there is no picture in this folder", path.display()),
            "PNG, JPEG, TIFF, BMP and PNM pictures are known by the endings of their names",
        ));
    }
    found.sort_by(|a, b| in_counting_order(a, b));
    Ok(found)
}

/// Refuses a picture of another size than its camera's: one that was scaled or cropped has other pixels than the model
/// knows.
pub(crate) fn refuse_another_cameras(
    path: &Path,
    found: [u32; 2],
    known: Option<[u32; 2]>,
) -> Result<(), Error> {
    match known.filter(|known| *known != found) {
        Some([width, height]) => Err(Error::Image {
            path: path.into(),
            problem: format!(
                "{} x {} pixels, but the camera's pictures have {width} x {height}",
                found[0], found[1]
            ),
            hint: "give unscaled pictures, of the cameras in the order of `--cameras`".into(),
        }),
        None => Ok(()),
    }
}
