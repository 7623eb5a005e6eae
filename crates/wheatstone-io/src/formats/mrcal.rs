//! mrcal's `.cameramodel`, a file a camera: `lensmodel`, `intrinsics`, `extrinsics` (rotation vector and
//! translation, camera from reference) and `imagersize`, as a Python literal.
//!
//! Source: mrcal's documentation, "Camera model representation" and "Lens models". Read are
//! LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5, 8 and 12; the pose under its old name `extrinsics` and its
//! new one `rt_cam_ref`. Pixels and axes are ours.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera, coefficients,
    rig::{Optics, lens, vector, whole},
    text::numbers,
    yaml::parse,
};
use wheatstone_core::{Result, camera::pinhole::Pinhole, geometry::Pose};

pub(super) const FORMAT: Format = Format {
    name: "mrcal",
    about: "mrcal's .cameramodel, one file per camera: pinhole and OpenCV4 to OpenCV12",
    layout: Layout::Cameras("cameramodel"),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(12)],
        unit: None,
        loss: None,
    },
};

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let cameras: Result<Vec<RigCamera>> = files.iter().map(camera).collect();
    Ok(Rig { unit: None, cameras: cameras? })
}

fn camera(file: &InputFile) -> Result<RigCamera> {
    let root = parse(file)?;
    let model = match root.get("lens_model") {
        Some(old) => old,
        None => root.need("lensmodel", file)?,
    };
    let kind = model.text().unwrap_or("");
    let terms = match kind {
        "LENSMODEL_PINHOLE" => 0,
        "LENSMODEL_OPENCV4" => 4,
        "LENSMODEL_OPENCV5" => 5,
        "LENSMODEL_OPENCV8" => 8,
        "LENSMODEL_OPENCV12" => 12,
        _ => {
            return Err(file.error(
                model.line,
                format!("`{kind}` is not supported"),
                "convert it with `mrcal-convert-lensmodel LENSMODEL_OPENCV8`",
            ));
        }
    };
    let intrinsics = root.need("intrinsics", file)?;
    let values = intrinsics.numbers(file)?;
    if values.len() != 4 + terms {
        return Err(file.error(
            intrinsics.line,
            format!("{} numbers, but {kind} has {}", values.len(), 4 + terms),
            "the file is damaged",
        ));
    }
    let pinhole = lens([values[0], values[1], values[2], values[3]], file, intrinsics.line)?;
    let pose = match root.get("rt_cam_ref") {
        Some(new) => new,
        None => root.need("extrinsics", file)?,
    };
    let [a, b, c, x, y, z] = pose.exactly(file)?;
    let pose = Pose::from_rotation_vector(vector([x, y, z]), vector([a, b, c]));
    let list = root.need("imagersize", file)?;
    let [width, height] = list.exactly(file)?;
    let size = [whole(width, file, list.line)?, whole(height, file, list.line)?];
    let optics = Optics::brown(pinhole, &values[4..], pose)
        .ok_or_else(|| file.error(intrinsics.line, "no such lens".into(), "the file is damaged"))?;
    Ok(RigCamera { name: file.stem(), size: Some(size), optics })
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let mut files = Vec::with_capacity(rig.cameras.len());
    for (index, camera) in rig.cameras.iter().enumerate() {
        let (Pinhole { focal, principal }, pose) = Rig::pinhole_and_pose(camera)?;
        let [width, height] = Rig::size_of(camera, FORMAT.name)?;
        let Optics::Brown(own) = &camera.optics else { continue };
        let terms = coefficients(&own.model, 0);
        let kind = match terms.len() {
            0 => "LENSMODEL_PINHOLE".to_owned(),
            count => format!("LENSMODEL_OPENCV{count}"),
        };
        let intrinsics = focal.into_iter().chain(principal).chain(terms);
        let turn = pose.rotation_vector();
        let placed = turn.iter().chain(pose.translation.iter()).copied();
        let text = format!(
            "{{\n    'lensmodel':  '{kind}',\n\n    \
             # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n    \
             'intrinsics': [ {},],\n\n    \
             # extrinsics are rt_fromref\n    \
             'extrinsics': [ {},],\n\n    'imagersize': [ {width}, {height},]\n}}\n",
            numbers(intrinsics, ", "),
            numbers(placed, ", "),
        );
        files.push(OutputFile::named(file_name(index, &camera.name, "cameramodel"), text));
    }
    Ok(files)
}

/// A file's name for a camera that sorts in the cameras' order.
pub(super) fn file_name(index: usize, name: &str, extension: &str) -> String {
    let plain: String = name
        .chars()
        .map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' })
        .collect();
    let begins = format!("{:02}-", index + 1);
    let plain = plain.strip_prefix(&begins).unwrap_or(&plain);
    format!("{begins}{plain}.{extension}")
}
