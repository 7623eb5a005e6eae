//! MyPTV's cameras of Tsai's model, a file a camera.
//!
//! Source: MyPTV's `TsaiModel/camera.py` (github.com/ronshnapp/MyPTV). Lines: `Tsai model camera`, the name,
//! width and height, the centre O, the angles theta of R = Rx Ry Rz, the focal length f in pixels, xh and yh,
//! and three rows of E. A pixel (eta, zeta) looks along R^T (eta - width/2 - xh + e1, zeta - height/2 - yh + e2,
//! f + e3) with e = E (eta, zeta, eta^2, zeta^2, eta zeta). Pixels are taken as they stand, like MyPTV's points.
//! Without the squares that is a projection matrix, with focal lengths of both axes and skew; what the squares
//! say no lens of ours holds, and lens distortion is no polynomial of them.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera,
    rig::{Optics, vector, whole},
    text::{number, numbers, row},
};
use nalgebra::{Matrix3, Matrix3x4};
use wheatstone_core::{
    Result,
    error::{Hint, Remedy},
    geometry::ProjectionMatrix,
};

pub(super) const FORMAT: Format = Format {
    name: "myptv-cameras",
    about: "MyPTV's cameras of Tsai's model, one file per camera: pinholes without distortion",
    layout: Layout::Folder(&["cam1", "cam2", "cam3", "cam4", "cam5", "cam6", "cam7", "cam8"]),
    content: Content::Calibration {
        read: Some(read),
        write: Some(write),
        forms: &[Form::Brown(0), Form::Linear],
        unit: None,
        loss: None,
    },
};

/// The first line of a file.
pub(super) const HEADING: &str = "Tsai model camera";

/// Numbers in a row of E.
const TERMS: usize = 5;

/// R = Rx Ry Rz, as OpenPTV has it too.
pub(super) fn rotation(angles: [f64; 3]) -> Matrix3<f64> {
    let [x, y, z] = angles.map(libm::sincos);
    Matrix3::new(1.0, 0.0, 0.0, 0.0, x.1, -x.0, 0.0, x.0, x.1)
        * Matrix3::new(y.1, 0.0, y.0, 0.0, 1.0, 0.0, -y.0, 0.0, y.1)
        * Matrix3::new(z.1, -z.0, 0.0, z.0, z.1, 0.0, 0.0, 0.0, 1.0)
}

/// The angles of a rotation; of those that give the same, the one without a turn about x.
pub(super) fn angles(rotation: &Matrix3<f64>) -> [f64; 3] {
    let sine = rotation[(0, 2)].clamp(-1.0, 1.0);
    let beside = libm::hypot(rotation[(0, 0)], rotation[(0, 1)]);
    let second = libm::atan2(sine, beside);
    if beside < 1e-12 {
        return [0.0, second, libm::atan2(rotation[(1, 0)], rotation[(1, 1)])];
    }
    let first = libm::atan2(-rotation[(1, 2)], rotation[(2, 2)]);
    [first, second, libm::atan2(-rotation[(0, 1)], rotation[(0, 0)])]
}

fn read(files: &[InputFile], _given: &Given) -> Result<Rig> {
    let cameras = files.iter().map(camera).collect::<Result<Vec<_>>>()?;
    Ok(Rig { unit: None, cameras })
}

fn camera(file: &InputFile) -> Result<RigCamera> {
    let hint = "is this a camera of MyPTV's Tsai model?";
    let lines: Vec<&str> = file.text()?.lines().map(str::trim).collect();
    if lines.first() != Some(&HEADING) {
        return Err(file.error(1, format!("the first line is not `{HEADING}`"), hint));
    }
    // Lines from the third on, with as many numbers as each must have.
    let mut rows = Vec::new();
    for (line, count) in (3_u64..).zip([2, 3, 3, 1, 2, TERMS, TERMS, TERMS]) {
        let content = lines.get(line as usize - 1).copied().unwrap_or("");
        let values = row(content, file, line)?;
        if values.len() != count {
            let problem = format!("expected {count} numbers, found {}", values.len());
            return Err(file.error(line, problem, hint));
        }
        rows.push(values);
    }
    if let Some(squares) = (5..8).find(|index| rows[*index][2..].iter().any(|v| *v != 0.0)) {
        return Err(file.error(
            squares as u64 + 3,
            "the correction has terms of second order".into(),
            "the camera models of other programs cannot represent this: convert the points, and fit them here",
        ));
    }
    let size = [whole(rows[0][0], file, 3)?, whole(rows[0][1], file, 3)?];
    let [width, height] = size.map(f64::from);
    let (focal, shift, e) = (rows[3][0], &rows[4], &rows[5..8]);
    let look = Matrix3::new(
        1.0 + e[0][0],
        e[0][1],
        -width / 2.0 - shift[0],
        e[1][0],
        1.0 + e[1][1],
        -height / 2.0 - shift[1],
        e[2][0],
        e[2][1],
        focal,
    );
    let turn = rotation([rows[2][0], rows[2][1], rows[2][2]]);
    let to_picture = look.try_inverse().map(|inverse| inverse * turn);
    let Some(to_picture) = to_picture.filter(|matrix| matrix.iter().all(|v| v.is_finite())) else {
        return Err(file.error(
            6,
            "this camera has no picture: its numbers are singular".into(),
            hint,
        ));
    };
    // Lines do not say on which side of a camera the scene is; a right-handed world seen without mirrors has
    // a positive determinant.
    let to_picture = to_picture * to_picture.determinant().signum();
    let to_picture = to_picture / to_picture.row(2).norm();
    let mut matrix = Matrix3x4::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&to_picture);
    matrix.set_column(3, &-(to_picture * vector([rows[1][0], rows[1][1], rows[1][2]])));
    let name =
        lines.get(1).filter(|name| !name.is_empty()).map_or(file.name(), ToString::to_string);
    let linear = Optics::Linear(ProjectionMatrix(matrix));
    let optics = linear.in_form(Form::Brown(0)).unwrap_or(linear);
    Ok(RigCamera { name, size: Some(size), optics })
}

fn write(rig: &Rig) -> Result<Vec<OutputFile>> {
    let cameras = rig.cameras.iter().enumerate();
    cameras.map(|(index, camera)| written(&format!("cam{}", index + 1), camera)).collect()
}

fn written(name: &str, camera: &RigCamera) -> Result<OutputFile> {
    let [width, height] = Rig::size_of(camera, FORMAT.name)?.map(f64::from);
    let refuse = |what: &str| {
        let hint = Hint::new("fit a parametric camera", Remedy::Method);
        Format::unsupported(FORMAT.name, format!("{what} of camera `{}`", camera.name), hint)
    };
    let Some(Optics::Linear(matrix)) = camera.optics.in_form(Form::Linear) else {
        return Err(refuse("the lens distortion"));
    };
    let (k, turn, _) = matrix.decompose().ok_or_else(|| refuse("the projection matrix"))?;
    let centre = matrix.centre().ok_or_else(|| refuse("the infinite distance"))?;
    if turn.determinant() < 0.0 {
        return Err(refuse("the left-handed world"));
    }
    let [fx, fy, skew] = [k[(0, 0)], k[(1, 1)], k[(0, 1)]];
    let [cx, cy] = [k[(0, 2)], k[(1, 2)]];
    // f is that of x; E makes up for that of y, and for skew.
    let (aside, stretch) = (-skew / fy, fx / fy - 1.0);
    let shift = [cx + aside * cy - width / 2.0, (1.0 + stretch) * cy - height / 2.0];
    // MyPTV takes the last two characters off a line before it reads its numbers.
    let line = |values: &[f64]| numbers(values.iter().copied(), " ") + " \n";
    let rows = [[0.0, aside], [0.0, stretch], [0.0, 0.0]];
    let text = [
        format!("{HEADING}\n{name}\n{width} {height} \n"),
        line(&[centre.x, centre.y, centre.z]),
        line(&angles(&turn)),
        number(fx) + " \n",
        line(&shift),
        rows.map(|[a, b]| line(&[a, b, 0.0, 0.0, 0.0])).concat(),
    ];
    Ok(OutputFile::named(name, text.concat()))
}
