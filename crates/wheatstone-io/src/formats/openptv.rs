//! OpenPTV's cameras: `.ori` and `.addpar` a camera, with `ptv.par` for the size of pictures and pixels.
//!
//! Source: OpenPTV's liboptv (`calibration.c`, `imgcoord.c`, `trafo.c`; after Mass, Gruen & Papantoniou 1993,
//! doi:10.1007/BF00190953). Its cameras look along -z with y up, lengths on the sensor are millimetres, and
//! pixels count from the corner of the top-left one. Distortion is about the middle of the sensor, ours about
//! the principal point: each way the nearest lens is fitted all over the picture, and a camera for which there
//! is none within half a pixel is refused; so are shear and a refracting wall.

mod distortion;

use super::{
    Content, Form, Format, Given, InputFile, Layout, Loss, OutputFile, Rig, RigCamera,
    myptv_cameras::angles,
    rig::{Optics, lens, rotation, vector, whole},
    text::{finite, number, numbers, row},
};
use distortion::SensorLens;
use nalgebra::Matrix3;
use wheatstone_core::{Result, geometry::Pose};
use wheatstone_numeric::statistics::root_mean_square;

pub(super) const FORMAT: Format = Format {
    name: "openptv",
    about: "OpenPTV's .ori and .addpar, with ptv.par: cameras in air",
    layout: Layout::Folder(&[".ori", ".addpar", "ptv.par"]),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(5)],
        unit: Some("mm"),
        loss: Some(loss),
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
    let refuse = |problem: &str| {
        file.error(
            values[15].1,
            problem.into(),
            "the camera models of other programs cannot represent this: convert the points, and fit them here",
        )
    };
    if shear != 0.0 {
        return Err(refuse("the picture is sheared"));
    }
    let [wide, high] = sensor.pixel;
    lens([scale * cc / wide, cc / high, 0.0, 0.0], file, values[17].1)?;
    let square = cc * cc;
    let own = SensorLens {
        focal: cc / high,
        shift: [xh / cc, yh / cc],
        radial: [k1 * square, k2 * square * square, k3 * square * square * square],
        tangential: [p1 * cc, p2 * cc],
        scale: scale * high / wide,
        middle: sensor.size.map(|side| f64::from(side) / 2.0 - 0.5),
    };
    let optics = own.brown(sensor.size, pose).ok_or_else(|| {
        refuse("the centre of distortion is not the principal point, and too far from it")
    })?;
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

/// Size of a pixel in millimetres: the files need one, and any is right for cameras given in pixels.
const PIXEL: f64 = 0.01;

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let sizes: Vec<[u32; 2]> = rig
        .cameras
        .iter()
        .map(|camera| Rig::size_of(camera, FORMAT.name))
        .collect::<Result<_>>()?;
    let [width, height] = sizes[0];
    if sizes.iter().any(|size| *size != sizes[0]) {
        let what = "cameras whose pictures have different sizes".into();
        return Err(Format::unsupported(FORMAT.name, what, "ptv.par has one size for all cameras"));
    }
    let count = rig.cameras.len();
    let name = |index: usize| format!("cam{}.tif", index + 1);
    let names: String = (0..count)
        .map(|index| format!("img/cam{}.10001\ncal/{}\n", index + 1, name(index)))
        .collect();
    // One flag each for highpass filter, all cameras, TIFF headers; then the picture, its fields, and air, wall
    // and water of one index.
    let parameters = format!(
        "{count}\n{names}1\n0\n1\n{width}\n{height}\n{PIXEL}\n{PIXEL}\n0\n1.0\n1.0\n1.0\n1.0\n"
    );
    let mut files = vec![OutputFile::named("ptv.par", parameters)];
    for (index, camera) in rig.cameras.iter().enumerate() {
        let (ori, addpar) = written(camera, sizes[0])?;
        files.push(OutputFile::named(format!("{}.ori", name(index)), ori));
        files.push(OutputFile::named(format!("{}.addpar", name(index)), addpar));
    }
    Ok(files)
}

/// How far cameras are off in these files; `None` where they are as they were, to a millionth of a pixel.
pub(super) fn loss(rig: &Rig) -> Option<Loss> {
    let off = rig.cameras.iter().filter_map(|camera| {
        let Optics::Brown(fitted) = &camera.optics else { return None };
        Some(SensorLens::of(&fitted.model, camera.size?)?.1)
    });
    let all: Vec<f64> = off.flatten().collect();
    let largest = all.iter().copied().fold(0.0, f64::max);
    (largest > 1e-6).then(|| Loss {
        form: "lens with distortion about the middle of the picture".into(),
        rms: root_mean_square(&all),
        largest,
        points: all.len(),
    })
}

/// The `.ori` and the `.addpar` of a camera.
fn written(camera: &RigCamera, size: [u32; 2]) -> Result<(String, String)> {
    let refuse = |what: &str| {
        let what = format!("{what} of camera `{}`", camera.name);
        Format::unsupported(FORMAT.name, what, "`opencv` and others hold it")
    };
    let Optics::Brown(fitted) = &camera.optics else { return Err(refuse("the lens")) };
    let (own, _) = SensorLens::of(&fitted.model, size)
        .ok_or_else(|| refuse("distortion about a point so far from the middle of the picture"))?;
    let pose = fitted.camera_from_world;
    let centre = pose.inverse().translation;
    // Columns are the camera's axes in the world: x right, y up, z backward.
    let axes = pose.rotation.transpose() * Matrix3::from_diagonal(&vector([1.0, -1.0, -1.0]));
    let cc = own.focal * PIXEL;
    let [xh, yh] = own.shift.map(|shift| shift * cc);
    let row = |values: [f64; 3]| numbers(values, " ") + "\n";
    let matrix: String = axes.row_iter().map(|line| row([line[0], line[1], line[2]])).collect();
    // The wall is where it has no effect, at the origin of the world.
    let ori = format!(
        "{}{}\n{matrix}\n{} {}\n{}\n\n0.0 0.0 1.0\n",
        row(centre.into()),
        row(angles(&axes)),
        number(xh),
        number(yh),
        number(cc)
    );
    let ([k1, k2, k3], [p1, p2], square) = (own.radial, own.tangential, cc * cc);
    let terms = [
        k1 / square,
        k2 / (square * square),
        k3 / (square * square * square),
        p1 / cc,
        p2 / cc,
        own.scale,
        0.0,
    ];
    Ok((ori, numbers(terms, " ") + "\n"))
}
