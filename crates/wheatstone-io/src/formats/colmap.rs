//! COLMAP's text model: `cameras.txt` and `images.txt` (and an empty `points3D.txt`, which its reader wants).
//!
//! Source: COLMAP's documentation, "Output format" and `src/colmap/sensor/models.h`. The centre of its
//! top-left pixel is (0.5, 0.5): half a pixel is taken off principal points on the way in and put on on the
//! way out. Poses are camera from world, as quaternions with the real part first.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera, coefficients,
    rig::{Optics, lens, vector, whole},
    text::{finite, lines, numbers},
};
use nalgebra::{Quaternion, Rotation3, UnitQuaternion};
use std::{collections::BTreeMap, fmt::Write};
use wheatstone_core::{Result, camera::pinhole::Pinhole, geometry::Pose};

pub(super) const FORMAT: Format = Format {
    name: "colmap",
    about: "COLMAP's text model: a folder with cameras.txt and images.txt",
    layout: Layout::Folder(&["cameras.txt", "images.txt"]),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(8), Form::KannalaBrandt(4)],
        unit: None,
        loss: None,
    },
};

/// What COLMAP adds to our pixels.
const HALF: f64 = 0.5;

/// A lens that images share.
#[derive(Clone, Debug)]
struct Lens {
    size: [u32; 2],
    pinhole: Pinhole,
    /// OpenCV's coefficients; of a fisheye its four.
    terms: Vec<f64>,
    fisheye: bool,
}

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let find = |name: &str| files.iter().find(|file| file.name().to_lowercase().ends_with(name));
    let missing = |name: &str| {
        let problem = format!("{name} is missing beside it");
        files[0].error(0, problem, "name the folder of a text model (`colmap model_converter`)")
    };
    let cameras = find("cameras.txt").ok_or_else(|| missing("cameras.txt"))?;
    let images = find("images.txt").ok_or_else(|| missing("images.txt"))?;
    let mut lenses = BTreeMap::new();
    for (line, content) in lines(cameras.text()?) {
        let (id, lens) = read_lens(content, cameras, line)?;
        lenses.insert(id, lens);
    }
    // Every second line holds an image's points, and may be empty: it is gone by then.
    let mut found = Vec::new();
    let mut points_follow = false;
    for (line, content) in (1_u64..).zip(images.text()?.lines()) {
        let content = content.trim();
        if content.starts_with('#') {
            continue;
        }
        if points_follow {
            points_follow = false;
            continue;
        }
        if content.is_empty() {
            continue;
        }
        found.push(read_image(content, &lenses, images, line)?);
        points_follow = true;
    }
    found.sort_by_key(|(id, _)| *id);
    Ok(Rig { unit: None, cameras: found.into_iter().map(|(_, camera)| camera).collect() })
}

fn read_lens(content: &str, file: &InputFile, line: u64) -> Result<(u64, Lens)> {
    let cells: Vec<&str> = content.split_whitespace().collect();
    let wrong = |problem: String| {
        let hint = "a line is CAMERA_ID MODEL WIDTH HEIGHT PARAMS…; read are SIMPLE_PINHOLE, PINHOLE, \
                    SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE";
        file.error(line, problem, hint)
    };
    let [id, model, width, height, values @ ..] = &cells[..] else {
        return Err(wrong("this is not a camera".into()));
    };
    let id = id.parse().map_err(|_| wrong(format!("`{id}` is not a camera number")))?;
    let side = |text: &str| whole(finite(text, file, line)?, file, line);
    let size = [side(width)?, side(height)?];
    let values: Vec<f64> =
        values.iter().map(|value| finite(value, file, line)).collect::<Result<_>>()?;
    let (focal, principal, terms) = match (*model, &values[..]) {
        ("SIMPLE_PINHOLE", [f, x, y]) => ([*f; 2], [*x, *y], vec![]),
        ("SIMPLE_RADIAL", [f, x, y, k]) => ([*f; 2], [*x, *y], vec![*k, 0.0, 0.0, 0.0]),
        ("RADIAL", [f, x, y, k, l]) => ([*f; 2], [*x, *y], vec![*k, *l, 0.0, 0.0]),
        ("PINHOLE", [f, g, x, y]) => ([*f, *g], [*x, *y], vec![]),
        ("OPENCV" | "OPENCV_FISHEYE", [f, g, x, y, terms @ ..]) if terms.len() == 4 => {
            ([*f, *g], [*x, *y], terms.to_vec())
        }
        ("FULL_OPENCV", [f, g, x, y, terms @ ..]) if terms.len() == 8 => {
            ([*f, *g], [*x, *y], terms.to_vec())
        }
        _ => {
            return Err(wrong(format!("`{model}` with {} numbers is not supported", values.len())));
        }
    };
    let pinhole = lens([focal[0], focal[1], principal[0] - HALF, principal[1] - HALF], file, line)?;
    Ok((id, Lens { size, pinhole, terms, fisheye: *model == "OPENCV_FISHEYE" }))
}

fn read_image(
    content: &str,
    lenses: &BTreeMap<u64, Lens>,
    file: &InputFile,
    line: u64,
) -> Result<(u64, RigCamera)> {
    let wrong = |problem: String| {
        file.error(line, problem, "a line is IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")
    };
    let cells: Vec<&str> = content.splitn(10, char::is_whitespace).collect();
    let [id, pose @ .., camera, name] = &cells[..] else {
        return Err(wrong("this is not an image".into()));
    };
    let id = id.parse().map_err(|_| wrong(format!("`{id}` is not an image number")))?;
    let pose: Vec<f64> =
        pose.iter().map(|value| finite(value, file, line)).collect::<Result<_>>()?;
    let [w, x, y, z, tx, ty, tz] = pose[..] else {
        return Err(wrong("a pose has seven numbers".into()));
    };
    // Quaternions come with few digits; any length means the same rotation.
    let quaternion = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6)
        .ok_or_else(|| wrong("this quaternion is not a rotation".into()))?;
    let lens = camera.parse().ok().and_then(|camera: u64| lenses.get(&camera));
    let lens = lens.ok_or_else(|| wrong(format!("cameras.txt has no camera {camera}")))?;
    let rotation = quaternion.to_rotation_matrix().into_inner();
    let pose = Pose { rotation, translation: vector([tx, ty, tz]) };
    let optics = match (&lens.terms[..], lens.fisheye) {
        ([a, b, c, d], true) => Some(Optics::fisheye(lens.pinhole, [*a, *b, *c, *d], pose)),
        (terms, _) => Optics::brown(lens.pinhole, terms, pose),
    };
    let optics = optics.ok_or_else(|| wrong("no such lens".into()))?;
    let name = name.trim().to_owned();
    Ok((id, RigCamera { name, size: Some(lens.size), optics }))
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let mut cameras = String::from("# Camera list with one line of data per camera:\n");
    cameras.push_str("#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    let mut images = String::from("# Image list with two lines of data per image:\n");
    images.push_str("#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n");
    images.push_str("#   POINTS2D[] as (X, Y, POINT3D_ID)\n");
    for (index, camera) in rig.cameras.iter().enumerate() {
        let (Pinhole { focal, principal }, pose) = Rig::pinhole_and_pose(camera)?;
        let [width, height] = Rig::size_of(camera, FORMAT.name)?;
        let (model, terms) = match &camera.optics {
            Optics::KannalaBrandt(own) => ("OPENCV_FISHEYE", own.model.coefficients.to_vec()),
            Optics::Brown(own) => match coefficients(&own.model, 0) {
                terms if terms.is_empty() => ("PINHOLE", terms),
                terms if terms.len() == 4 => ("OPENCV", terms),
                _ => ("FULL_OPENCV", coefficients(&own.model, 8)),
            },
            Optics::Linear(_) => continue,
        };
        let principal = principal.map(|value| value + HALF);
        let turn =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(pose.rotation));
        let pose =
            [turn.w, turn.i, turn.j, turn.k].into_iter().chain(pose.translation.iter().copied());
        // Names with spaces end at the first of them for some readers.
        let name: String =
            camera.name.chars().map(|c| if c.is_whitespace() { '_' } else { c }).collect();
        let id = index + 1;
        // Writing to a string cannot fail.
        let _ = writeln!(
            cameras,
            "{id} {model} {width} {height} {}",
            numbers(focal.into_iter().chain(principal).chain(terms), " ")
        );
        let _ = writeln!(images, "{id} {} {id} {name}\n", numbers(pose, " "));
    }
    Ok(vec![
        OutputFile::named("cameras.txt", cameras),
        OutputFile::named("images.txt", images),
        OutputFile::named("points3D.txt", String::from("# 3D point list, empty\n")),
    ])
}
