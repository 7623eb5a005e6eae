//! MayaCam 2.0, as XMALab writes it and Autoscoper reads it: a text file a camera with `image size`, `camera
//! matrix`, `rotation` and `translation`, world to camera.
//!
//! Source: Autoscoper's documentation, "Camera calibration file format"; axes and pixels are taken for
//! OpenCV's, on which XMALab is built. It holds no distortion: its pictures are undistorted before.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera,
    mrcal::file_name,
    rig::{Optics, pinhole, rotation, rows, vector, whole},
    text::{number, numbers, row},
};
use wheatstone_core::{Result, camera::pinhole::Pinhole, geometry::Pose};

pub(super) const FORMAT: Format = Format {
    name: "mayacam",
    about: "MayaCam 2.0 of XMALab, one text file per camera; pinholes without distortion",
    layout: Layout::Cameras("txt"),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(0)],
        unit: None,
        loss: None,
    },
};

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let cameras: Result<Vec<RigCamera>> = files.iter().map(camera).collect();
    Ok(Rig { unit: None, cameras: cameras? })
}

/// So many numbers on the lines after a heading.
fn section<const N: usize>(file: &InputFile, heading: &str) -> Result<([f64; N], u64)> {
    let mut lines = (1_u64..).zip(file.text()?.lines());
    let start = lines.find(|(_, line)| line.trim().eq_ignore_ascii_case(heading));
    let Some((start, _)) = start else {
        let problem = format!("`{heading}` is missing");
        return Err(file.error(0, problem, "is this a MayaCam 2.0 file?"));
    };
    let mut found = Vec::with_capacity(N);
    for (line, content) in lines {
        if found.len() >= N {
            break;
        }
        if !content.trim().is_empty() {
            found.extend(row(content, file, line)?);
        }
    }
    let count = found.len();
    let numbers = found.try_into().map_err(|_| {
        let problem = format!("expected {N} numbers after `{heading}`, found {count}");
        file.error(start, problem, "is this a MayaCam 2.0 file?")
    })?;
    Ok((numbers, start))
}

fn camera(file: &InputFile) -> Result<RigCamera> {
    let ([width, height], line) = section(file, "image size")?;
    let size = [whole(width, file, line)?, whole(height, file, line)?];
    let (k, line) = section(file, "camera matrix")?;
    let pinhole = pinhole(k, file, line)?;
    let (r, line) = section(file, "rotation")?;
    let rotation = rotation(r, file, line)?;
    let (t, line) = section(file, "translation")?;
    let pose = Pose { rotation, translation: vector(t) };
    let optics = Optics::brown(pinhole, &[], pose)
        .ok_or_else(|| file.error(line, "no such camera".into(), "the file is damaged"))?;
    Ok(RigCamera { name: file.stem(), size: Some(size), optics })
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let mut files = Vec::with_capacity(rig.cameras.len());
    for (index, camera) in rig.cameras.iter().enumerate() {
        let (Pinhole { focal, principal }, pose) = Rig::pinhole_and_pose(camera)?;
        let [width, height] = Rig::size_of(camera, FORMAT.name)?;
        let lines = |values: &[f64]| -> String {
            values.chunks(3).map(|row| numbers(row.iter().copied(), ",") + "\n").collect()
        };
        let k = [focal[0], 0.0, principal[0], 0.0, focal[1], principal[1], 0.0, 0.0, 1.0];
        let moved: String = pose.translation.iter().map(|value| number(*value) + "\n").collect();
        let text = format!(
            "image size\n{width},{height}\n\ncamera matrix\n{}\nrotation\n{}\ntranslation\n{moved}",
            lines(&k),
            lines(&rows(&pose.rotation)),
        );
        files.push(OutputFile::named(file_name(index, &camera.name, "txt"), text));
    }
    Ok(files)
}
