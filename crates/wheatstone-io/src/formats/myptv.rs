//! MyPTV's calibration points: a file a camera, lines `x y X Y Z`.
//!
//! Source: MyPTV's user manual and its example files. Points of different cameras are one where X, Y and Z are
//! the same numbers. Pixels are taken as they stand.

use super::{
    Content, Format, Given, InputFile, Layout, OutputFile,
    text::{lines, numbers, row},
};
use std::collections::BTreeMap;
use wheatstone_core::{
    Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
};

pub(super) const FORMAT: Format = Format {
    name: "myptv",
    about: "MyPTV's calibration points, one file per camera: x y X Y Z",
    layout: Layout::Folder(&["cal_points"]),
    content: Content::Points { read: Some(read), write: Some(write), known_only: true },
};

pub(super) fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    if files.len() > 64 {
        let problem = format!("{} files, one per camera", files.len());
        return Err(files[0].error(0, problem, "name the files of one calibration"));
    }
    let mut places: BTreeMap<[u64; 3], usize> = BTreeMap::new();
    let mut correspondences: Vec<Correspondence> = Vec::new();
    for (camera, file) in files.iter().enumerate() {
        for (line, content) in lines(file.text()?) {
            let [x, y, wx, wy, wz] = row(content, file, line)?[..] else {
                return Err(file.error(line, "expected five numbers: x y X Y Z".into(), ""));
            };
            let key = [wx, wy, wz].map(|value| (value + 0.0).to_bits());
            let index = *places.entry(key).or_insert(correspondences.len());
            if index == correspondences.len() {
                correspondences.push(Correspondence {
                    view: 0,
                    id: None,
                    pixels: vec![None; files.len()],
                    world: Some(Point3::new(wx, wy, wz)),
                    board: None,
                });
            }
            let place = &mut correspondences[index].pixels[camera];
            if place.is_some() {
                let problem = format!("the point {wx} {wy} {wz} is in this file already");
                return Err(file.error(line, problem, "remove one of the two"));
            }
            *place = Some(Pixel::new(x, y));
        }
    }
    Ok(Dataset {
        unit: given.unit().into(),
        cameras: files.len(),
        views: Vec::new(),
        correspondences,
    })
}

fn write(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    Ok(lists(data, |camera| format!("cam{}_cal_points", camera + 1), ("", "\t")))
}

/// A file a camera, with what stands first in it and between its numbers.
pub(super) fn lists(
    data: &Dataset,
    name: impl Fn(usize) -> String,
    (heading, between): (&str, &str),
) -> Vec<OutputFile> {
    let file = |camera: usize| {
        let line = |(world, row): (Point3, &Correspondence)| {
            let pixel = row.pixels[camera]?;
            Some(numbers([pixel.x, pixel.y, world.x, world.y, world.z], between) + "\n")
        };
        let points: String = data.known().filter_map(line).collect();
        OutputFile::named(name(camera), format!("{heading}{points}"))
    };
    (0..data.cameras).map(file).collect()
}
