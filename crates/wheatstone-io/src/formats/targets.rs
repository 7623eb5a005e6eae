//! OpenPTV's found particles: `cam1.10001_targets` a camera and frame, and `rt_is.10001` a frame, which says
//! which of them are one.
//!
//! Source: OpenPTV's liboptv (`tracking_frame_buf.c`). A targets file holds their number, then lines `number x
//! y pixels width height brightness correspondence`; `rt_is` their number, then lines `number X Y Z t1 t2 …`,
//! -1 where a camera saw none. Pixels count from the corner of the top-left one (`segmentation.c` adds half a
//! pixel): half is taken off on the way in and put on on the way out. Where there is no `rt_is`, targets with
//! the same correspondence belong together.

use super::{
    Content, Format, Given, InputFile, Layout, OutputFile,
    text::{number, row},
};
use std::{collections::BTreeMap, fmt::Write};
use wheatstone_core::{
    Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
};

pub(super) const FORMAT: Format = Format {
    name: "openptv-targets",
    about: "OpenPTV's detected particles: cam1.10001_targets, …, with rt_is.10001",
    layout: Layout::Folder(&["_targets", "rt_is"]),
    content: Content::Points { read: Some(read), write: Some(write), known_only: false },
};

/// What OpenPTV adds to our pixels.
const HALF: f64 = 0.5;

const HINT: &str = "is this a file of OpenPTV?";

/// The lines of a file after the first, which says how many there are; of at least so many numbers.
fn table(file: &InputFile, least: usize) -> Result<Vec<(u64, Vec<f64>)>> {
    let mut lines = (1_u64..).zip(file.text()?.lines()).filter(|(_, line)| !line.trim().is_empty());
    let count = match lines.next() {
        Some((line, content)) => row(content, file, line)?,
        None => Vec::new(),
    };
    let [count] = count[..] else {
        return Err(file.error(1, "expected the number of lines".into(), HINT));
    };
    let mut rows = Vec::new();
    for (line, content) in lines {
        let values = row(content, file, line)?;
        if values.len() < least {
            let problem = format!("expected at least {least} numbers, found {}", values.len());
            return Err(file.error(line, problem, HINT));
        }
        rows.push((line, values));
    }
    if rows.len() as f64 != count {
        let problem = format!("{} lines, where the first line says {count}", rows.len());
        return Err(file.error(1, problem, "the file is truncated, or not from OpenPTV"));
    }
    Ok(rows)
}

/// Camera and frame of `cam1.10001_targets`; the frame is empty for a picture of one chart.
fn names(file: &InputFile) -> Option<(String, String)> {
    let name = file.name();
    let stem = name.strip_suffix("_targets")?;
    let (camera, frame) = stem.rsplit_once('.').unwrap_or((stem, ""));
    if frame.chars().all(|c| c.is_ascii_digit()) && !frame.is_empty() {
        Some((camera.into(), frame.into()))
    } else {
        Some((stem.into(), String::new()))
    }
}

/// Targets of a frame, a camera each; with their correspondence.
type Targets = BTreeMap<usize, Vec<(Pixel, i64)>>;

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let named: Vec<(String, String, &InputFile)> = files
        .iter()
        .filter_map(|file| names(file).map(|(camera, frame)| (camera, frame, file)))
        .collect();
    let mut cameras: Vec<&String> = named.iter().map(|(camera, _, _)| camera).collect();
    cameras.sort();
    cameras.dedup();
    let mut frames: BTreeMap<&str, Targets> = BTreeMap::new();
    for (camera, frame, file) in &named {
        let index = cameras.binary_search(&camera).unwrap_or(0);
        let rows = table(file, 8)?;
        let target = |(_, v): &(u64, Vec<f64>)| (Pixel::new(v[1] - HALF, v[2] - HALF), v[7] as i64);
        frames.entry(frame).or_default().insert(index, rows.iter().map(target).collect());
    }
    if cameras.len() > 64 {
        return Err(files[0].error(
            0,
            format!("{} cameras", cameras.len()),
            "name the files of one run",
        ));
    }
    let mut data = Dataset {
        unit: given.unit().into(),
        cameras: cameras.len(),
        views: Vec::new(),
        correspondences: Vec::new(),
    };
    for (frame, targets) in frames {
        let same = |file: &&InputFile| file.name() == format!("rt_is.{frame}");
        data.views.push(frame.into());
        match files.iter().find(same) {
            Some(file) => matched(file, &targets, &mut data)?,
            None => numbered(&targets, &mut data),
        }
    }
    Ok(data)
}

/// By `rt_is`.
fn matched(file: &InputFile, targets: &Targets, data: &mut Dataset) -> Result<()> {
    for (line, values) in table(file, 4 + data.cameras)? {
        let mut pixels = Vec::with_capacity(data.cameras);
        for camera in 0..data.cameras {
            let index = values[4 + camera];
            if index < 0.0 {
                pixels.push(None);
                continue;
            }
            let target = targets.get(&camera).and_then(|all| all.get(index as usize));
            let Some((pixel, _)) = target else {
                let problem = format!("camera {} has no target {index}", camera + 1);
                return Err(file.error(line, problem, "name the targets of every camera"));
            };
            pixels.push(Some(*pixel));
        }
        data.correspondences.push(Correspondence {
            view: data.views.len() - 1,
            id: Some(format!("{}", values[0])),
            pixels,
            world: Some(Point3::new(values[1], values[2], values[3])),
            board: None,
        });
    }
    Ok(())
}

/// By the targets' own correspondence.
fn numbered(targets: &Targets, data: &mut Dataset) {
    let mut found: BTreeMap<i64, Vec<Option<Pixel>>> = BTreeMap::new();
    for (camera, targets) in targets {
        for (pixel, number) in targets.iter().filter(|(_, number)| *number >= 0) {
            found.entry(*number).or_insert_with(|| vec![None; data.cameras])[*camera] =
                Some(*pixel);
        }
    }
    data.correspondences.extend(found.into_iter().map(|(number, pixels)| Correspondence {
        view: data.views.len() - 1,
        id: Some(number.to_string()),
        pixels,
        world: None,
        board: None,
    }));
}

fn write(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    let mut files = Vec::new();
    for view in 0..data.views.len().max(1) {
        // OpenPTV counts frames from a number with five digits.
        let own = data.views.get(view).filter(|name| !name.is_empty());
        let plain = own.filter(|name| name.chars().all(|c| c.is_ascii_digit()));
        let frame = plain.cloned().unwrap_or_else(|| (10_001 + view).to_string());
        let rows: Vec<&Correspondence> =
            data.correspondences.iter().filter(|row| row.view == view).collect();
        let mut targets = vec![(0, String::new()); data.cameras];
        let (mut known, mut text) = (0, String::new());
        for (index, row) in rows.iter().enumerate() {
            let mut seen = Vec::with_capacity(data.cameras);
            for (pixel, (count, text)) in row.pixels.iter().zip(&mut targets) {
                let Some(pixel) = pixel else {
                    seen.push("-1".to_owned());
                    continue;
                };
                let (x, y) = (number(pixel.x + HALF), number(pixel.y + HALF));
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{count:4} {x} {y} 1 1 1 1 {index}");
                seen.push(count.to_string());
                *count += 1;
            }
            if let Some(world) = row.world {
                known += 1;
                let place = [world.x, world.y, world.z].map(number).join(" ");
                let _ = writeln!(text, "{known:4} {place} {}", seen.join(" "));
            }
        }
        for (camera, (count, text)) in targets.into_iter().enumerate() {
            let name = format!("cam{}.{frame}_targets", camera + 1);
            files.push(OutputFile::named(name, format!("{count}\n{text}")));
        }
        if known > 0 {
            files.push(OutputFile::named(format!("rt_is.{frame}"), format!("{known}\n{text}")));
        }
    }
    Ok(files)
}
