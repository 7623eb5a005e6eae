//! Anipose's `calibration.toml`: a table a camera with `matrix`, `distortions`, `rotation` (Rodrigues) and
//! `translation`, world to camera; `fisheye` for OpenCV's fisheye.
//!
//! Source: aniposelib's `cameras.py` (BSD). Pixels and axes are OpenCV's, and so ours.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera, coefficients,
    rig::{Optics, pinhole, vector, whole},
    text::{number, numbers},
    tree::{Node, Value},
};
use std::fmt::Write;
use wheatstone_core::{Result, camera::pinhole::Pinhole, geometry::Pose};

pub(super) const FORMAT: Format = Format {
    name: "anipose",
    about: "Anipose's calibration.toml",
    layout: Layout::File("toml"),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(12), Form::KannalaBrandt(4)],
        unit: None,
        loss: None,
    },
};

/// The tree of a TOML value; a value knows nothing of its line.
fn tree(value: &toml::Value) -> Node {
    let value = match value {
        toml::Value::Array(items) => Value::List(items.iter().map(tree).collect()),
        toml::Value::Table(table) => {
            Value::Map(table.iter().map(|(key, value)| (key.clone(), tree(value))).collect())
        }
        toml::Value::String(text) => Value::Scalar(text.clone()),
        toml::Value::Float(value) => Value::Scalar(number(*value)),
        other => Value::Scalar(other.to_string()),
    };
    Node { line: 0, value }
}

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let file = &files[0];
    let text = file.text()?;
    let table: toml::Table = toml::from_str(text).map_err(|error| {
        let before = error.span().map_or("", |span| text.get(..span.start).unwrap_or(""));
        let line = before.matches('\n').count() as u64 + 1;
        file.error(line, error.message().to_owned(), "is this a calibration.toml?")
    })?;
    let mut cameras = Vec::new();
    let mut unit = None;
    for (name, value) in &table {
        let node = tree(value);
        if node.get("matrix").is_some() {
            cameras.push((name.clone(), camera(name, &node, file)?));
        } else if name == "metadata" {
            unit = node.get("unit").and_then(Node::text).map(Into::into);
        }
    }
    // `cam_10` comes after `cam_9`.
    cameras.sort_by_key(|(name, _)| {
        let digits = name.rsplit('_').next().unwrap_or("");
        (digits.parse::<u64>().unwrap_or(u64::MAX), name.clone())
    });
    Ok(Rig { unit, cameras: cameras.into_iter().map(|(_, camera)| camera).collect() })
}

fn camera(table: &str, node: &Node, file: &InputFile) -> Result<RigCamera> {
    let wrong =
        |what: &str| file.error(0, format!("[{table}]: {what}"), "is this a calibration.toml?");
    let pinhole = pinhole(node.need("matrix", file)?.exactly(file)?, file, 0)?;
    let terms = node.need("distortions", file)?.numbers(file)?;
    let turn = vector(node.need("rotation", file)?.exactly(file)?);
    let moved = vector(node.need("translation", file)?.exactly(file)?);
    let pose = Pose::from_rotation_vector(moved, turn);
    let optics = if node.get("fisheye").and_then(Node::text) == Some("true") {
        let terms = terms.try_into().map_err(|_| wrong("a fisheye has four distortions"))?;
        Optics::fisheye(pinhole, terms, pose)
    } else {
        Optics::brown(pinhole, &terms, pose)
            .ok_or_else(|| wrong("4, 5, 8 or 12 distortions are read"))?
    };
    let size = match node.get("size") {
        Some(list) => {
            let [width, height] = list.exactly(file)?;
            Some([whole(width, file, 0)?, whole(height, file, 0)?])
        }
        None => None,
    };
    let name = node.get("name").and_then(Node::text).unwrap_or(table).to_owned();
    Ok(RigCamera { name, size, optics })
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let mut text = String::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        let (Pinhole { focal, principal }, pose) = Rig::pinhole_and_pose(camera)?;
        let [width, height] = Rig::size_of(camera, FORMAT.name)?;
        let (terms, fisheye) = match &camera.optics {
            Optics::KannalaBrandt(own) => (own.model.coefficients.to_vec(), true),
            Optics::Brown(own) => (coefficients(&own.model, 5), false),
            Optics::Linear(_) => continue,
        };
        let name = toml::Value::String(camera.name.clone());
        let [fx, fy, cx, cy] = [focal[0], focal[1], principal[0], principal[1]].map(number);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "[cam_{index}]\nname = {name}\nsize = [ {width}, {height},]\n\
             matrix = [ [ {fx}, 0.0, {cx},], [ 0.0, {fy}, {cy},], [ 0.0, 0.0, 1.0,],]\n\
             distortions = [ {},]\nrotation = [ {},]\ntranslation = [ {},]",
            numbers(terms, ", "),
            numbers(pose.rotation_vector().iter().copied(), ", "),
            numbers(pose.translation.iter().copied(), ", "),
        );
        if fisheye {
            text.push_str("fisheye = true\n");
        }
        text.push('\n');
    }
    text.push_str("[metadata]\n");
    if let Some(unit) = &rig.unit {
        let _ = writeln!(text, "unit = {}", toml::Value::String(unit.clone()));
    }
    Ok(vec![OutputFile::only(text)])
}
