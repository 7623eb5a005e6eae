//! Points digitised in DLTdv and Argus: `xypts.csv` with `pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,…`, a row a frame,
//! and `xyzpts.csv` with `pt1_X,pt1_Y,pt1_Z`. NaN stands for what was not digitised.
//!
//! Source: Hedrick 2008 (doi:10.1088/1748-3182/3/3/034001) and the files that DLTdv writes. Pixels are those of
//! `dltdv`: from MATLAB's 1, v up from the bottom of the picture. Frames become views, points ids.

use super::{
    Content, Format, Given, InputFile, Layout, OutputFile,
    text::{finite, number},
};
use std::collections::BTreeMap;
use wheatstone_core::{
    Error, Result,
    dataset::{Correspondence, Dataset},
    error::{Hint, Remedy},
    geometry::{Pixel, Point3},
};

pub(super) const FORMAT: Format = Format {
    name: "dltdv-points",
    about: "points of DLTdv 5 to 7 and Argus (xypts.csv, xyzpts.csv): v up from the bottom; needs --size",
    layout: Layout::Folder(&["xypts.csv", "xyzpts.csv"]),
    content: Content::Points { read: Some(read), write: Some(write), known_only: false },
};

/// Where a column goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cell {
    /// Point, camera and axis, counted from 0.
    Pixel(usize, usize, usize),
    /// Point and axis.
    World(usize, usize),
}

/// More points than this are a damaged header.
const MOST_POINTS: usize = 100_000;

/// And so are more cameras.
const MOST_CAMERAS: usize = 64;

/// `pt3_cam2_X` or `pt3_X`.
fn cell(name: &str) -> Option<Cell> {
    let count = |text: &str, most: usize| -> Option<usize> {
        text.parse::<usize>().ok()?.checked_sub(1).filter(|index| *index < most)
    };
    let axis = |text: &str| ["X", "Y", "Z"].iter().position(|axis| *axis == text);
    let parts: Vec<&str> = name.trim().trim_matches('"').split('_').collect();
    match parts[..] {
        [point, camera, along] => Some(Cell::Pixel(
            count(point.strip_prefix("pt")?, MOST_POINTS)?,
            count(camera.strip_prefix("cam")?, MOST_CAMERAS)?,
            axis(along).filter(|axis| *axis < 2)?,
        )),
        [point, along] => {
            Some(Cell::World(count(point.strip_prefix("pt")?, MOST_POINTS)?, axis(along)?))
        }
        _ => None,
    }
}

/// What one file says of each frame and point: numbers by camera and axis, or by axis alone.
type Frames = BTreeMap<(usize, usize), BTreeMap<(usize, usize), f64>>;

/// Key of the world's axes among cameras.
const WORLD: usize = usize::MAX;

fn gather(file: &InputFile, frames: &mut Frames) -> Result<()> {
    let mut rows = (1_u64..).zip(file.text()?.lines());
    let (_, header) = rows.next().unwrap_or((1, ""));
    let header = header.trim_start_matches('\u{feff}');
    let cells: Option<Vec<Cell>> = header.split(',').map(cell).collect();
    let cells = cells.ok_or_else(|| {
        let problem = "the header is not that of xypts.csv or xyzpts.csv".into();
        file.error(1, problem, "columns are pt1_cam1_X,pt1_cam1_Y,… or pt1_X,pt1_Y,pt1_Z")
    })?;
    for (frame, (line, content)) in rows.filter(|(_, row)| !row.trim().is_empty()).enumerate() {
        let values: Vec<&str> = content.split(',').map(str::trim).collect();
        if values.len() != cells.len() {
            let problem = format!("{} cells, the header has {}", values.len(), cells.len());
            return Err(file.error(
                line,
                problem,
                "give every row as many cells as the header; write NaN where nothing was digitised",
            ));
        }
        for (cell, text) in cells.iter().zip(values) {
            if text.is_empty() || text.eq_ignore_ascii_case("nan") {
                continue;
            }
            let value = finite(text, file, line)?;
            let (point, key) = match *cell {
                Cell::Pixel(point, camera, axis) => (point, (camera, axis)),
                Cell::World(point, axis) => (point, (WORLD, axis)),
            };
            frames.entry((frame, point)).or_default().insert(key, value);
        }
    }
    Ok(())
}

fn height(given: &Given, camera: usize) -> Result<f64> {
    given.size(camera).map(|[_, height]| f64::from(height)).ok_or_else(|| {
        Format::unsupported(
            FORMAT.name,
            "pixels that count up from the bottom of pictures of unknown height".into(),
            Hint::new("give their size", Remedy::ImageSize),
        )
    })
}

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let mut frames = Frames::new();
    for file in files {
        gather(file, &mut frames)?;
    }
    let cameras = frames.values().flat_map(BTreeMap::keys).map(|(camera, _)| *camera);
    let cameras = cameras.filter(|camera| *camera != WORLD).max().map_or(0, |last| last + 1);
    let mut views: Vec<String> = Vec::new();
    let mut correspondences = Vec::with_capacity(frames.len());
    for ((frame, point), found) in frames {
        let name = (frame + 1).to_string();
        if views.last() != Some(&name) {
            views.push(name);
        }
        let mut pixels = Vec::new();
        for camera in 0..cameras {
            let at = |axis: usize| found.get(&(camera, axis)).copied();
            pixels.push(match at(0).zip(at(1)) {
                Some((u, v)) => Some(Pixel::new(u - 1.0, height(given, camera)? - v)),
                None => None,
            });
        }
        let at = |axis: usize| found.get(&(WORLD, axis)).copied();
        let world = at(0).zip(at(1)).zip(at(2)).map(|((x, y), z)| Point3::new(x, y, z));
        let id = Some(format!("pt{}", point + 1));
        correspondences.push(Correspondence {
            view: views.len() - 1,
            id,
            pixels,
            world,
            board: None,
        });
    }
    Ok(Dataset { unit: given.unit().into(), cameras, views, correspondences })
}

/// Each row's frame and point, and how many of both there are.
struct Places {
    rows: Vec<(usize, usize)>,
    frames: usize,
    points: usize,
}

/// Each row's frame and point: by their names where they have any, otherwise counted.
fn placed(data: &Dataset) -> Result<Places> {
    let mut names: Vec<&str> = Vec::new();
    let mut in_frame = vec![0; data.views.len().max(1)];
    let mut places = Vec::with_capacity(data.correspondences.len());
    let mut index = BTreeMap::new();
    for (row, correspondence) in data.correspondences.iter().enumerate() {
        let frame = if data.views.is_empty() { row } else { correspondence.view };
        let point = match correspondence.id.as_deref() {
            Some(id) => *index.entry(id).or_insert_with(|| {
                names.push(id);
                names.len() - 1
            }),
            None if data.views.is_empty() => 0,
            None => in_frame.get(frame).copied().unwrap_or(0),
        };
        if let Some(count) = in_frame.get_mut(frame) {
            *count += 1;
        }
        places.push((frame, point));
    }
    let mut sorted = places.clone();
    sorted.sort_unstable();
    if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(twice());
    }
    let most =
        |which: fn(&(usize, usize)) -> usize| places.iter().map(which).max().map_or(0, |m| m + 1);
    let (frames, points) = (most(|place| place.0), most(|place| place.1));
    Ok(Places { rows: places, frames, points })
}

fn twice() -> Error {
    Format::unsupported(
        FORMAT.name,
        "two rows of one view with the same id".into(),
        "give each point of a view its own id",
    )
}

fn write(data: &Dataset, given: &Given) -> Result<Vec<OutputFile>> {
    let Places { rows: places, frames, points } = placed(data)?;
    let most_cells = 100_000_000;
    if frames.saturating_mul(points).saturating_mul(2 * data.cameras + 3) > most_cells {
        return Err(Format::unsupported(
            FORMAT.name,
            format!("{frames} frames of {points} points"),
            "write fewer",
        ));
    }
    let rows: BTreeMap<(usize, usize), &Correspondence> =
        places.into_iter().zip(&data.correspondences).collect();
    let nan = || "NaN".to_owned();
    let (mut flat, mut deep) = (Vec::new(), Vec::new());
    for point in 1..=points {
        for camera in 1..=data.cameras {
            flat.extend(["X", "Y"].map(|axis| format!("pt{point}_cam{camera}_{axis}")));
        }
        deep.extend(["X", "Y", "Z"].map(|axis| format!("pt{point}_{axis}")));
    }
    let (mut flat, mut deep) = (flat.join(",") + "\n", deep.join(",") + "\n");
    for frame in 0..frames {
        let (mut pixels, mut world) = (Vec::new(), Vec::new());
        for point in 0..points {
            let row = rows.get(&(frame, point));
            for camera in 0..data.cameras {
                match row.and_then(|row| row.pixels[camera]) {
                    Some(p) => {
                        pixels.extend([number(p.x + 1.0), number(height(given, camera)? - p.y)]);
                    }
                    None => pixels.extend([nan(), nan()]),
                }
            }
            match row.and_then(|row| row.world) {
                Some(p) => world.extend([p.x, p.y, p.z].map(number)),
                None => world.extend([nan(), nan(), nan()]),
            }
        }
        flat += &(pixels.join(",") + "\n");
        deep += &(world.join(",") + "\n");
    }
    let mut files = Vec::new();
    if data.cameras > 0 {
        files.push(OutputFile::named("xypts.csv", flat));
    }
    if data.known().next().is_some() {
        files.push(OutputFile::named("xyzpts.csv", deep));
    }
    Ok(files)
}
