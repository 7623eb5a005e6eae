//! ROS camera_info: a YAML file a camera, as `camera_calibration` writes them. Metres.
//!
//! Source: the definition of `sensor_msgs/CameraInfo`, and `camera_info_manager` for the file. A pair's
//! geometry is in the rectification R (camera to rectified frame) and the projection P, whose fourth column
//! is minus the baseline times the focal length: a point at `x` in the left camera's rectified frame is at
//! `x + P[:, 3] / f` in the right one's. The world of what is read is the left rectified frame; ROS keeps no
//! other.

use super::{
    Content, Error, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera,
    coefficients,
    mrcal::file_name,
    rig::{Optics, pinhole, rotation, rows, vector, whole},
    text::numbers,
    tree::Node,
    yaml::parse,
};
use nalgebra::Matrix3;
use wheatstone_core::{
    Result,
    camera::pinhole::Pinhole,
    geometry::{Pose, Vector3},
};

pub(super) const FORMAT: Format = Format {
    name: "ros",
    about: "ROS camera_info of a pair, one YAML file per camera; metres, world = left rectified frame",
    layout: Layout::Cameras("yaml"),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(8), Form::KannalaBrandt(4)],
        unit: Some("m"),
        loss: None,
    },
};

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let cameras: Result<Vec<RigCamera>> = files.iter().map(camera).collect();
    Ok(Rig { unit: None, cameras: cameras? })
}

/// The numbers of a matrix of rows, columns and data.
fn data<const N: usize>(root: &Node, name: &str, file: &InputFile) -> Result<([f64; N], u64)> {
    let node = root.need(name, file)?;
    let data = node.need("data", file)?;
    Ok((data.exactly(file)?, data.line))
}

fn camera(file: &InputFile) -> Result<RigCamera> {
    let root = parse(file)?;
    let (k, line) = data(&root, "camera_matrix", file)?;
    let pinhole = pinhole(k, file, line)?;
    let lens = root.need("distortion_coefficients", file)?.need("data", file)?;
    let terms = lens.numbers(file)?;
    let (r, line) = data(&root, "rectification_matrix", file)?;
    let rectified_from_camera = rotation(r, file, line)?;
    let ([fx, _, _, shift_x, _, fy, _, shift_y, _, _, _, shift_z], line) =
        data::<12>(&root, "projection_matrix", file)?;
    if fx <= 0.0 || fy <= 0.0 {
        let hint = "an uncalibrated camera has zeros; calibrate it first";
        return Err(file.error(line, "focal lengths are positive".into(), hint));
    }
    // Rectified frame of this camera from that of the left one.
    let shift = Vector3::new(shift_x / fx, shift_y / fy, shift_z);
    let camera_from_rectified = rectified_from_camera.transpose();
    let pose = Pose { rotation: camera_from_rectified, translation: camera_from_rectified * shift };
    let kind = root.get("distortion_model").and_then(Node::text).unwrap_or("plumb_bob");
    let optics = match (kind, &terms[..]) {
        ("equidistant" | "fisheye", [a, b, c, d]) => {
            Some(Optics::fisheye(pinhole, [*a, *b, *c, *d], pose))
        }
        ("plumb_bob" | "rational_polynomial" | "none" | "", _) => {
            Optics::brown(pinhole, &terms, pose)
        }
        _ => None,
    };
    let optics = optics.ok_or_else(|| {
        let problem =
            format!("distortion `{kind}` with {} coefficients is not supported", terms.len());
        file.error(lens.line, problem, "plumb_bob, rational_polynomial and equidistant are")
    })?;
    let side = |name: &str| match root.get(name) {
        Some(node) => whole(node.number(file)?, file, node.line).map(Some),
        None => Ok(None),
    };
    let size = side("image_width")?.zip(side("image_height")?).map(|(w, h)| [w, h]);
    let name = root.get("camera_name").and_then(Node::text).filter(|name| !name.is_empty());
    Ok(RigCamera { name: name.map_or_else(|| file.stem(), Into::into), size, optics })
}

/// The frame in which both cameras' pictures have their rows in common: x along the baseline, z as near
/// to both axes as can be. As rotations from the world.
fn rectified_from_world(left: &Pose, right: &Pose) -> Option<Matrix3<f64>> {
    let x = right.inverse().translation - left.inverse().translation;
    let ahead = left.rotation.row(2).transpose() + right.rotation.row(2).transpose();
    // A rig whose right camera stands to the left looks along the same axes with a negative baseline.
    let across = left.rotation.row(0).transpose();
    let x = if x.dot(&across) < 0.0 { -x } else { x };
    let x = x.try_normalize(0.0)?;
    let y = ahead.cross(&x).try_normalize(1e-9 * ahead.norm())?;
    Some(Matrix3::from_rows(&[x.transpose(), y.transpose(), x.cross(&y).transpose()]))
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let [left, right] = &rig.cameras[..] else {
        return Err(Format::unsupported(
            FORMAT.name,
            format!("{} cameras: it holds pairs only", rig.cameras.len()),
            "`kalibr`, `opencv` and others hold any number",
        ));
    };
    let ((left_lens, left_pose), (right_lens, right_pose)) =
        (Rig::pinhole_and_pose(left)?, Rig::pinhole_and_pose(right)?);
    let rectified = rectified_from_world(&left_pose, &right_pose).ok_or_else(no_baseline)?;
    // One focal length and principal point for both, such as both have nearly.
    let focal = left_lens.focal[1].min(right_lens.focal[1]);
    let middle = [0, 1].map(|axis| (left_lens.principal[axis] + right_lens.principal[axis]) / 2.0);
    let centre = |pose: &Pose| rectified * pose.inverse().translation;
    let baseline = (centre(&right_pose) - centre(&left_pose)).x;
    let mut files = Vec::with_capacity(2);
    for (index, (camera, lens, pose, baseline)) in
        [(left, left_lens, left_pose, 0.0), (right, right_lens, right_pose, baseline)]
            .into_iter()
            .enumerate()
    {
        let rectification = rectified * pose.rotation.transpose();
        let shift = if baseline == 0.0 { 0.0 } else { -focal * baseline };
        let projection =
            [focal, 0.0, middle[0], shift, 0.0, focal, middle[1], 0.0, 0.0, 0.0, 1.0, 0.0];
        let text = file(camera, &lens, &rectification, projection)?;
        files.push(OutputFile::named(file_name(index, &camera.name, "yaml"), text));
    }
    Ok(files)
}

fn no_baseline() -> Error {
    Format::unsupported(
        FORMAT.name,
        "a pair whose cameras look along the baseline: such pictures cannot be rectified".into(),
        "`kalibr`, `opencv` and others hold it",
    )
}

fn file(
    camera: &RigCamera,
    lens: &Pinhole,
    rectification: &Matrix3<f64>,
    projection: [f64; 12],
) -> Result<String> {
    let [width, height] = Rig::size_of(camera, FORMAT.name)?;
    let (kind, terms) = match &camera.optics {
        Optics::KannalaBrandt(own) => ("equidistant", own.model.coefficients.to_vec()),
        Optics::Brown(own) => match coefficients(&own.model, 5) {
            terms if terms.len() == 5 => ("plumb_bob", terms),
            terms => ("rational_polynomial", terms),
        },
        Optics::Linear(_) => ("plumb_bob", Vec::new()),
    };
    let Pinhole { focal, principal } = lens;
    let k = vector([focal[0], 0.0, principal[0]]);
    let k = Matrix3::from_rows(&[
        k.transpose(),
        vector([0.0, focal[1], principal[1]]).transpose(),
        vector([0.0, 0.0, 1.0]).transpose(),
    ]);
    let list = |values: Vec<f64>| numbers(values, ", ");
    let name: String = camera
        .name
        .chars()
        .map(|c| if c.is_alphanumeric() || c == '_' { c } else { '_' })
        .collect();
    Ok(format!(
        "image_width: {width}\nimage_height: {height}\ncamera_name: \"{name}\"\n\
         camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n\
         distortion_model: {kind}\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\n\
         rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n\
         projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}]\n",
        list(rows(&k)),
        terms.len(),
        list(terms.clone()),
        list(rows(rectification)),
        list(projection.to_vec()),
    ))
}
