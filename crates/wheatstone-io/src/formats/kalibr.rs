//! Kalibr's camera chain: a YAML file with `cam0`, `cam1`, …, each with `T_cn_cnm1`, the 4x4 transformation
//! from the camera before it. Metres.
//!
//! Source: the Kalibr wiki, "yaml formats" and "supported models". Its pinholes are with `radtan` (k1, k2,
//! p1, p2), `equidistant` (OpenCV's fisheye) or no distortion. The world is the first camera: Kalibr has no
//! other.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera, coefficients,
    rig::{Optics, lens, rotation, vector, whole},
    text::numbers,
    tree::{Node, Value},
    yaml::parse,
};
use std::fmt::Write;
use wheatstone_core::{Result, camera::pinhole::Pinhole, geometry::Pose};

pub(super) const FORMAT: Format = Format {
    name: "kalibr",
    about: "Kalibr's camchain.yaml: pinhole with radtan or equidistant; metres, world = cam0",
    layout: Layout::File("yaml"),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(4), Form::KannalaBrandt(4)],
        unit: Some("m"),
        loss: None,
    },
};

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let file = &files[0];
    let root = parse(file)?;
    let Value::Map(entries) = &root.value else {
        return Err(file.error(1, "there is no `cam0` in it".into(), "is this a Kalibr camchain?"));
    };
    let mut cameras = Vec::new();
    let mut before = Pose::default();
    for (index, name) in (0..entries.len()).map(|index| (index, format!("cam{index}"))) {
        let Some(node) = root.get(&name) else { break };
        let pose = match node.get("T_cn_cnm1") {
            Some(chain) => {
                let [a, b, c, x, d, e, f, y, g, h, i, z, ..] = chain.exactly::<16>(file)?;
                let turned = rotation([a, b, c, d, e, f, g, h, i], file, chain.line)?;
                let moved = vector([x, y, z]);
                Pose {
                    rotation: turned * before.rotation,
                    translation: turned * before.translation + moved,
                }
            }
            None if index == 0 => Pose::default(),
            None => return node.need("T_cn_cnm1", file).map(|_| Rig { unit: None, cameras }),
        };
        before = pose;
        cameras.push(camera(name, node, pose, file)?);
    }
    if cameras.is_empty() {
        return Err(file.error(1, "there is no `cam0` in it".into(), "is this a Kalibr camchain?"));
    }
    Ok(Rig { unit: None, cameras })
}

fn camera(name: String, node: &Node, pose: Pose, file: &InputFile) -> Result<RigCamera> {
    let model = node.need("camera_model", file)?;
    if model.text() != Some("pinhole") {
        return Err(file.error(
            model.line,
            format!("camera model `{}` is not supported", model.text().unwrap_or("")),
            "calibrate with pinhole-radtan or pinhole-equi in Kalibr",
        ));
    }
    let intrinsics = node.need("intrinsics", file)?;
    let [fx, fy, cx, cy] = intrinsics.exactly(file)?;
    let pinhole = lens([fx, fy, cx, cy], file, intrinsics.line)?;
    let kind = node.need("distortion_model", file)?;
    let terms = match node.get("distortion_coeffs") {
        Some(list) => list.numbers(file)?,
        None => Vec::new(),
    };
    let optics = match (kind.text(), &terms[..]) {
        (Some("radtan"), [_, _, _, _]) => Optics::brown(pinhole, &terms, pose),
        (Some("none"), _) => Optics::brown(pinhole, &[], pose),
        (Some("equidistant" | "equi"), [a, b, c, d]) => {
            Some(Optics::fisheye(pinhole, [*a, *b, *c, *d], pose))
        }
        _ => None,
    };
    let optics = optics.ok_or_else(|| {
        let kind_text = kind.text().unwrap_or("");
        file.error(
            kind.line,
            format!("distortion `{kind_text}` with {} coefficients is not supported", terms.len()),
            "radtan and equidistant with four coefficients are",
        )
    })?;
    let size = match node.get("resolution") {
        Some(list) => {
            let [width, height] = list.exactly(file)?;
            Some([whole(width, file, list.line)?, whole(height, file, list.line)?])
        }
        None => None,
    };
    Ok(RigCamera { name, size, optics })
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let mut text = String::new();
    let mut before: Option<Pose> = None;
    for (index, camera) in rig.cameras.iter().enumerate() {
        let (Pinhole { focal, principal }, pose) = Rig::pinhole_and_pose(camera)?;
        let [width, height] = Rig::size_of(camera, FORMAT.name)?;
        let (kind, terms) = match &camera.optics {
            Optics::KannalaBrandt(own) => ("equidistant", own.model.coefficients.to_vec()),
            Optics::Brown(own) => ("radtan", coefficients(&own.model, 4)),
            Optics::Linear(_) => continue,
        };
        let others: Vec<String> = (0..rig.cameras.len())
            .filter(|other| *other != index)
            .map(|other| other.to_string())
            .collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "cam{index}:");
        if let Some(before) = before {
            let turned = pose.rotation * before.rotation.transpose();
            let moved = pose.translation - turned * before.translation;
            text.push_str("  T_cn_cnm1:\n");
            for row in 0..3 {
                let row = turned.row(row).iter().copied().chain([moved[row]]).collect::<Vec<_>>();
                let _ = writeln!(text, "  - [{}]", numbers(row, ", "));
            }
            text.push_str("  - [0.0, 0.0, 0.0, 1.0]\n");
        }
        let _ = writeln!(
            text,
            "  cam_overlaps: [{}]\n  camera_model: pinhole\n  distortion_coeffs: [{}]\n  \
             distortion_model: {kind}\n  intrinsics: [{}]\n  resolution: [{width}, {height}]\n  \
             rostopic: /cam{index}/image_raw",
            others.join(", "),
            numbers(terms, ", "),
            numbers(focal.into_iter().chain(principal), ", "),
        );
        before = Some(pose);
    }
    Ok(vec![OutputFile::only(text)])
}
