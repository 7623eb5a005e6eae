//! OpenCV's FileStorage, as YAML or JSON: `K1 D1 K2 D2 R T`, with `x2 = R x1 + T`.
//!
//! Source: the OpenCV documentation of `cv::FileStorage`, `cv::stereoCalibrate` and `cv::fisheye`. Pixel
//! centres and axes are ours. What OpenCV has no name for goes by names of our own, which it passes over:
//! third and further cameras as `K3 D3 R3 T3` (from camera 1, like `R T`), and each camera's place in the
//! world as `camera_from_world_1` (3x4) where the world is not camera 1.

use super::{
    Content, Form, Format, InputFile, Layout, OutputFile, Rig, RigCamera, coefficients,
    rig::{Optics, pinhole, rotation, rows, vector, whole},
    text::numbers,
    tree::Node,
    yaml::parse,
};
use nalgebra::Matrix3;
use std::fmt::Write;
use wheatstone_core::{Error, Result, camera::pinhole::Pinhole, geometry::Pose};

/// Pinholes with OpenCV's 4, 5, 8, 12 or 14 coefficients.
pub(super) const FORMAT: Format = Format {
    name: "opencv",
    about: "OpenCV's FileStorage (YAML, JSON read): K1 D1 K2 D2 R T",
    layout: Layout::File("yml"),
    content: Content::Calibration {
        read: Some(|files, _| read(files, false)),
        write: Some(write),
        forms: &[Form::Brown(14)],
        unit: None,
        loss: None,
    },
};

/// Fisheyes: the same names, four coefficients for `cv::fisheye`.
pub(super) const FISHEYE: Format = Format {
    name: "opencv-fisheye",
    about: "the same with the four coefficients of cv::fisheye",
    layout: Layout::File("yml"),
    content: Content::Calibration {
        read: Some(|files, _| read(files, true)),
        write: Some(write),
        forms: &[Form::KannalaBrandt(4)],
        unit: None,
        loss: None,
    },
};

/// More cameras than this are not looked for.
const MOST_CAMERAS: usize = 64;

/// Several files read as one: intrinsics and extrinsics are often apart.
struct Storage<'a> {
    parts: Vec<(Node, &'a InputFile)>,
}

impl<'a> Storage<'a> {
    fn open(files: &'a [InputFile]) -> Result<Self> {
        let mut parts = Vec::with_capacity(files.len());
        for file in files {
            if file.text()?.trim_start().starts_with("<?xml") {
                return Err(file.error(
                    1,
                    "XML is not supported".into(),
                    "write it as .yml or .json with cv::FileStorage",
                ));
            }
            parts.push((parse(file)?, file));
        }
        Ok(Self { parts })
    }

    fn find(&self, keys: &[String]) -> Option<(&Node, &'a InputFile)> {
        self.parts.iter().find_map(|(node, file)| Some((node.any(keys)?, *file)))
    }

    fn get(&self, key: &str) -> Option<(&Node, &'a InputFile)> {
        self.find(&[key.to_owned()])
    }

    fn file(&self) -> &'a InputFile {
        self.parts[0].1
    }
}

/// The numbers of a matrix, row by row: OpenCV's own form, or plain lists.
fn entries(node: &Node, file: &InputFile) -> Result<Vec<f64>> {
    let Some(data) = node.get("data") else { return node.numbers(file) };
    let found = data.numbers(file)?;
    if let (Some(rows), Some(cols)) = (node.get("rows"), node.get("cols")) {
        let (rows, cols) = (rows.number(file)?, cols.number(file)?);
        if rows * cols != found.len() as f64 {
            return Err(file.error(
                data.line,
                format!("{} numbers in a matrix of {rows} rows and {cols} columns", found.len()),
                "the file is damaged",
            ));
        }
    }
    Ok(found)
}

fn exactly<const N: usize>(node: &Node, file: &InputFile) -> Result<[f64; N]> {
    let found = entries(node, file)?;
    let count = found.len();
    found.try_into().map_err(|_| {
        file.error(node.line, format!("expected {N} numbers, found {count}"), "the file is damaged")
    })
}

/// The names under which files keep a thing of one camera.
fn spellings(stems: &[&str], camera: usize) -> Vec<String> {
    let mut ends = vec![format!("{camera}"), format!("_{camera}")];
    match camera {
        1 => ends.extend(["_left", "_l", "L", "Left"].map(String::from)),
        2 => ends.extend(["_right", "_r", "R", "Right"].map(String::from)),
        _ => {}
    }
    stems.iter().flat_map(|stem| ends.iter().map(move |end| format!("{stem}{end}"))).collect()
}

const MATRIX: [&str; 5] = ["K", "M", "cameraMatrix", "camera_matrix", "CM"];
const LENS: [&str; 5] = ["D", "distCoeffs", "dist_coeffs", "distortion_coefficients", "DC"];

fn read(files: &[InputFile], fisheye: bool) -> Result<Rig> {
    let storage = Storage::open(files)?;
    let fisheye = fisheye
        || storage.get("distortion_model").and_then(|(node, _)| node.text()) == Some("fisheye");
    let mut cameras = Vec::new();
    let mut first = Pose::default();
    for camera in 1..=MOST_CAMERAS {
        let Some((matrix, file)) = storage.find(&spellings(&MATRIX, camera)) else { break };
        let pinhole = pinhole(exactly(matrix, file)?, file, matrix.line)?;
        let (lens, lens_line, lens_file) = match storage.find(&spellings(&LENS, camera)) {
            Some((node, file)) => (entries(node, file)?, node.line, file),
            None => (Vec::new(), matrix.line, file),
        };
        let pose = place(&storage, camera, &first)?;
        if camera == 1 {
            first = pose;
        }
        let optics = optics(pinhole, &lens, fisheye, pose).ok_or_else(|| {
            lens_file.error(
                lens_line,
                format!("{} coefficients of distortion", lens.len()),
                "there may be 4, 5, 8, 12 or 14, and 4 for a fisheye",
            )
        })?;
        let name = storage.get(&format!("camera_name_{camera}")).and_then(|(node, _)| node.text());
        let name = name.map_or_else(|| format!("camera{camera}"), Into::into);
        cameras.push(RigCamera { name, size: size(&storage, camera)?, optics });
    }
    if cameras.is_empty() {
        return Err(storage.file().error(
            0,
            "there is no camera matrix `K1` (nor `M1`, `cameraMatrix1`)".into(),
            "write K1 D1 K2 D2 R T into one file, or give intrinsics and extrinsics both",
        ));
    }
    let unit = storage.get("unit").and_then(|(node, _)| node.text()).map(Into::into);
    Ok(Rig { unit, cameras })
}

fn optics(pinhole: Pinhole, lens: &[f64], fisheye: bool, pose: Pose) -> Option<Optics> {
    if !fisheye {
        return Optics::brown(pinhole, lens, pose);
    }
    let lens = if lens.is_empty() { &[0.0; 4] } else { lens };
    Some(Optics::fisheye(pinhole, lens.try_into().ok()?, pose))
}

fn size(storage: &Storage, camera: usize) -> Result<Option<[u32; 2]>> {
    let side = |name: &str| {
        storage
            .find(&[format!("{name}{camera}"), name.to_owned()])
            .map(|(node, file)| whole(node.number(file)?, file, node.line))
    };
    Ok(match (side("image_width").transpose()?, side("image_height").transpose()?) {
        (Some(width), Some(height)) => Some([width, height]),
        _ => None,
    })
}

/// A camera's place: its own where it is told, otherwise from camera 1 by `R` and `T`.
fn place(storage: &Storage, camera: usize, first: &Pose) -> Result<Pose> {
    let own = match storage.get(&format!("camera_from_world_{camera}")) {
        Some((node, file)) => {
            let [a, b, c, x, d, e, f, y, g, h, i, z] = exactly(node, file)?;
            let rotation = rotation([a, b, c, d, e, f, g, h, i], file, node.line)?;
            Some(Pose { rotation, translation: vector([x, y, z]) })
        }
        None => None,
    };
    if camera == 1 {
        return Ok(own.unwrap_or_default());
    }
    let end = if camera == 2 { String::new() } else { camera.to_string() };
    let (r, t) = (storage.get(&format!("R{end}")), storage.get(&format!("T{end}")));
    let (Some((r, r_file)), Some((t, t_file))) = (r, t) else {
        return own.ok_or_else(|| no_extrinsics(storage.file(), &end));
    };
    let turned = match entries(r, r_file)?[..] {
        // cv::Rodrigues' form.
        [x, y, z] => Pose::from_rotation_vector(vector([0.0; 3]), vector([x, y, z])).rotation,
        _ => rotation(exactly(r, r_file)?, r_file, r.line)?,
    };
    let moved = vector(exactly(t, t_file)?);
    let by_pair =
        Pose { rotation: turned * first.rotation, translation: turned * first.translation + moved };
    let Some(own) = own else { return Ok(by_pair) };
    // Products of matrices of rounded numbers agree far better than this.
    const AGREE: f64 = 1e-6;
    let far = (own.translation - by_pair.translation).norm();
    let scale = 1.0 + own.translation.norm() + first.translation.norm();
    if (own.rotation - by_pair.rotation).norm() > AGREE || far > AGREE * scale {
        return Err(r_file.error(
            r.line,
            format!("R{end} and T{end} do not agree with camera_from_world_{camera}"),
            "remove the one that is outdated",
        ));
    }
    Ok(own)
}

fn no_extrinsics(file: &InputFile, end: &str) -> Error {
    file.error(
        0,
        format!("the extrinsics `R{end}` and `T{end}` are missing"),
        "give the file with the extrinsics as well",
    )
}

/// One matrix in OpenCV's form.
pub(super) fn matrix(text: &mut String, name: &str, (rows, cols): (usize, usize), values: &[f64]) {
    let values = numbers(values.iter().copied(), ", ");
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {values} ]"
    );
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    Ok(vec![OutputFile::only(text(rig)?)])
}

/// What is written of a rig.
pub(super) fn text(rig: &Rig) -> Result<String> {
    let mut text = String::from("%YAML:1.0\n---\n");
    if let Some(unit) = &rig.unit {
        let _ = writeln!(text, "unit: \"{unit}\"");
    }
    let sizes: Vec<_> = rig.cameras.iter().map(|camera| camera.size).collect();
    let same = sizes.iter().all(|size| *size == sizes[0]);
    let mut placed = Vec::with_capacity(rig.cameras.len());
    for (index, camera) in rig.cameras.iter().enumerate() {
        let of = index + 1;
        if let Some([width, height]) = camera.size.filter(|_| index == 0 || !same) {
            let end = if same { String::new() } else { of.to_string() };
            let _ = writeln!(text, "image_width{end}: {width}\nimage_height{end}: {height}");
        }
        let (Pinhole { focal, principal }, pose) = Rig::pinhole_and_pose(camera)?;
        placed.push(pose);
        let name: String =
            camera.name.chars().filter(|c| !c.is_control() && !"\"\\".contains(*c)).collect();
        let _ = writeln!(text, "camera_name_{of}: \"{name}\"");
        let k =
            Matrix3::new(focal[0], 0.0, principal[0], 0.0, focal[1], principal[1], 0.0, 0.0, 1.0);
        matrix(&mut text, &format!("K{of}"), (3, 3), &rows(&k));
        match &camera.optics {
            Optics::KannalaBrandt(own) => {
                if index == 0 {
                    text.push_str("distortion_model: \"fisheye\"\n");
                }
                matrix(&mut text, &format!("D{of}"), (4, 1), &own.model.coefficients);
            }
            Optics::Brown(own) => {
                let lens = coefficients(&own.model, 5);
                matrix(&mut text, &format!("D{of}"), (1, lens.len()), &lens);
            }
            Optics::Linear(_) => {}
        }
    }
    extrinsics(&mut text, &placed);
    Ok(text)
}

fn extrinsics(text: &mut String, placed: &[Pose]) {
    let Some(first) = placed.first() else { return };
    for (index, pose) in placed.iter().enumerate().skip(1) {
        let end = if index == 1 { String::new() } else { (index + 1).to_string() };
        let turned = pose.rotation * first.rotation.transpose();
        let moved = pose.translation - turned * first.translation;
        matrix(text, &format!("R{end}"), (3, 3), &rows(&turned));
        matrix(text, &format!("T{end}"), (3, 1), moved.as_slice());
    }
    if *first == Pose::default() {
        return;
    }
    for (index, Pose { rotation, translation }) in placed.iter().enumerate() {
        let mut values = Vec::with_capacity(12);
        for row in 0..3 {
            values.extend(rotation.row(row).iter());
            values.push(translation[row]);
        }
        matrix(text, &format!("camera_from_world_{}", index + 1), (3, 4), &values);
    }
}
