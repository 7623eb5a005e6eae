//! OpenPTV's cameras: `.ori` and `.addpar` a camera, with `ptv.par` for the size of pictures and pixels.
//!
//! Source: OpenPTV's liboptv (`calibration.c`, `imgcoord.c`, `trafo.c`; after Mass, Gruen & Papantoniou 1993,
//! doi:10.1007/BF00190953). Its cameras look along -z with y up, lengths on the sensor are millimetres, and
//! pixels count from the corner of the top-left one. Distortion is about the middle of the sensor, ours about
//! the principal point: a camera is read where the two are one, or where it has no distortion, shear or
//! refracting wall. It is not written: a fitted camera has its principal point elsewhere.

use super::{
    Content, Form, Format, Given, InputFile, Layout, Rig, RigCamera,
    rig::{Optics, lens, rotation, vector, whole},
    text::{finite, row},
};
use nalgebra::Matrix3;
use wheatstone_core::{Result, geometry::Pose};

pub(super) const FORMAT: Format = Format {
    name: "openptv",
    about: "OpenPTV's .ori and .addpar, with ptv.par: cameras in air",
    layout: Layout::Folder(&[".ori", ".addpar", "ptv.par"]),
    content: Content::Calibration {
        read: Some(read),
        write: None,
        forms: &[Form::Brown(5)],
        unit: Some("mm"),
    },
};

/// What `ptv.par` says of every camera.
struct Sensor {
    size: [u32; 2],
    /// Size of a pixel in millimetres.
    pixel: [f64; 2],
}

/// The lines of a `ptv.par` that hold something: the number of cameras, two names a camera, three flags,
/// then width, height, pixel width and height, the fields, and four numbers of the refracting wall.
fn sensor(file: &InputFile) -> Result<Sensor> {
    let lines: Vec<(u64, &str)> = (1_u64..)
        .zip(file.text()?.lines().map(str::trim))
        .filter(|(_, line)| !line.is_empty())
        .collect();
    let hint = "is this OpenPTV's parameters/ptv.par?";
    let value = |index: usize| match lines.get(index) {
        Some((line, text)) => Ok((finite(text, file, *line)?, *line)),
        None => Err(file.error(0, "the file ends too early".into(), hint)),
    };
    let (count, line) = value(0)?;
    if !(1.0..=64.0).contains(&count) || count.fract() != 0.0 {
        return Err(file.error(line, "expected the number of cameras".into(), hint));
    }
    let start = 1 + 2 * count as usize + 3;
    let side = |index: usize| -> Result<u32> {
        let (value, line) = value(index)?;
        whole(value, file, line)
    };
    let pixel = |index: usize| -> Result<f64> {
        let (value, line) = value(index)?;
        if value > 0.0 {
            Ok(value)
        } else {
            Err(file.error(line, "the pixel size must be above 0".into(), hint))
        }
    };
    // Refractive indices of air, wall and water; a wall of no effect has them alike.
    let indices = [start + 5, start + 6, start + 7].map(|index| value(index).map(|found| found.0));
    if let [Ok(first), Ok(second), Ok(third)] = indices
        && (first != second || first != third)
    {
        return Err(file.error(
            lines[start + 5].0,
            format!("light is refracted between media of index {first}, {second} and {third}"),
            "the camera models of other programs cannot represent this: convert the points, and fit them here",
        ));
    }
    Ok(Sensor {
        size: [side(start)?, side(start + 1)?],
        pixel: [pixel(start + 2)?, pixel(start + 3)?],
    })
}

/// All numbers of a small file, with the line on which each stands.
fn all(file: &InputFile) -> Result<Vec<(f64, u64)>> {
    let mut found = Vec::new();
    for (line, content) in (1_u64..).zip(file.text()?.lines()).take(100) {
        found.extend(row(content, file, line)?.into_iter().map(|value| (value, line)));
    }
    Ok(found)
}

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let ends = |file: &&InputFile, end: &str| file.name().to_lowercase().ends_with(end);
    let parameters = files.iter().find(|file| ends(file, "ptv.par")).ok_or_else(|| {
        let hint = "name it as well; it is in the folder `parameters`";
        files[0].error(0, "ptv.par, which gives the pixel size, is missing".into(), hint)
    })?;
    let sensor = sensor(parameters)?;
    let mut cameras = Vec::new();
    for file in files.iter().filter(|file| ends(file, ".ori")) {
        let stem = file.name();
        let stem = &stem[..stem.len() - ".ori".len()];
        let terms = files.iter().find(|other| other.name() == format!("{stem}.addpar"));
        cameras.push(camera(file, terms, &sensor)?);
    }
    Ok(Rig { unit: None, cameras })
}

fn camera(file: &InputFile, terms: Option<&InputFile>, sensor: &Sensor) -> Result<RigCamera> {
    let values = all(file)?;
    let numbers: Vec<f64> = values.iter().map(|(value, _)| *value).collect();
    let [x, y, z, _, _, _, a, b, c, d, e, f, g, h, i, xh, yh, cc, ..] = numbers[..] else {
        let problem = format!("expected 18 numbers, found {}", numbers.len());
        return Err(file.error(0, problem, "is this an OpenPTV .ori file?"));
    };
    // Its columns are the camera's axes in the world: x right, y up, z backward.
    let axes = rotation([a, b, c, d, e, f, g, h, i], file, values[6].1)?;
    let turned = Matrix3::from_diagonal(&vector([1.0, -1.0, -1.0])) * axes.transpose();
    let pose = Pose { rotation: turned, translation: -(turned * vector([x, y, z])) };
    let [k1, k2, k3, p1, p2, scale, shear] = match terms {
        Some(terms) => affine(terms)?,
        None => [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    };
    let bent = [k1, k2, k3, p1, p2].iter().any(|value| *value != 0.0);
    if (bent && (xh != 0.0 || yh != 0.0)) || shear != 0.0 {
        return Err(file.error(
            values[15].1,
            "the centre of distortion is not the principal point, or the picture is sheared".into(),
            "the camera models of other programs cannot represent this: convert the points, and fit them here",
        ));
    }
    let [wide, high] = sensor.pixel;
    let [width, height] = sensor.size.map(f64::from);
    let pinhole = lens(
        [
            scale * cc / wide,
            cc / high,
            width / 2.0 + scale * xh / wide - 0.5,
            height / 2.0 - yh / high - 0.5,
        ],
        file,
        values[17].1,
    )?;
    let square = cc * cc;
    // Its y goes up: the tangential terms change places, and one its sign.
    let terms =
        [k1 * square, k2 * square * square, -p2 * cc, p1 * cc, k3 * square * square * square];
    let optics = Optics::brown(pinhole, &terms, pose)
        .ok_or_else(|| file.error(0, "no such lens".into(), "the file is damaged"))?;
    let name = file.stem();
    Ok(RigCamera { name, size: Some(sensor.size), optics })
}

fn affine(file: &InputFile) -> Result<[f64; 7]> {
    let values: Vec<f64> = all(file)?.into_iter().map(|(value, _)| value).collect();
    let count = values.len();
    values.try_into().map_err(|_| {
        file.error(
            0,
            format!("expected 7 numbers, found {count}"),
            "is this an OpenPTV .addpar file?",
        )
    })
}
