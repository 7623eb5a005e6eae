//! Eleven coefficients of the direct linear transformation as CSV, a column a camera, as DLTdv, Argus and
//! easyWand keep them.
//!
//! Source: Abdel-Aziz & Karara 1971 (reprint doi:10.14358/PERS.81.2.103); Hedrick 2008
//! (doi:10.1088/1748-3182/3/3/034001) for DLTdv. `u = (L1 X + L2 Y + L3 Z + L4) / (L9 X + L10 Y + L11 Z + 1)`,
//! v with L5 to L8. `dlt` counts pixels as we do. DLTdv 5 to 7 turns pictures upside down and lets v go up,
//! from MATLAB's 1: `u = x + 1`, `v = height - y`. DLTdv 8 lets v go down again: `u = x + 1`, `v = y + 1`.

use super::{
    Content, Form, Format, Given, InputFile, Layout, OutputFile, Rig, RigCamera,
    rig::Optics,
    text::{lines, number, row},
};
use nalgebra::{Matrix3, Matrix3x4};
use wheatstone_core::{
    Result,
    error::{Hint, Remedy},
    geometry::ProjectionMatrix,
};

/// Our pixels.
pub(super) const FORMAT: Format = Format {
    name: "dlt",
    about: "11 DLT coefficients as CSV, one column per camera; top-left pixel (0, 0), v down",
    layout: Layout::File("csv"),
    content: Content::Calibration {
        read: Some(|files, given| read(files, given, Count::FromZero)),
        write: Some(|rig| write(rig, Count::FromZero)),
        forms: &[Form::Linear],
        unit: None,
        loss: None,
    },
};

/// The pixels of DLTdv 5 to 7, and of what follows them.
pub(super) const DLTDV: Format = Format {
    name: "dltdv",
    about: "the same for DLTdv 5 to 7 and Argus: v up from the bottom, pixels from 1; needs --size",
    layout: Layout::File("csv"),
    content: Content::Calibration {
        read: Some(|files, given| read(files, given, Count::Upwards)),
        write: Some(|rig| write(rig, Count::Upwards)),
        forms: &[Form::Linear],
        unit: None,
        loss: None,
    },
};

/// The pixels of DLTdv 8.
pub(super) const DLTDV8: Format = Format {
    name: "dltdv8",
    about: "the same for DLTdv 8: v down, pixels from 1",
    layout: Layout::File("csv"),
    content: Content::Calibration {
        read: Some(|files, given| read(files, given, Count::FromOne)),
        write: Some(|rig| write(rig, Count::FromOne)),
        forms: &[Form::Linear],
        unit: None,
        loss: None,
    },
};

/// Where pixels are counted from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Count {
    FromZero,
    FromOne,
    Upwards,
}

impl Count {
    /// The file's pixels from ours.
    fn to_theirs(self, height: f64) -> Matrix3<f64> {
        match self {
            Self::FromZero => Matrix3::identity(),
            Self::FromOne => Matrix3::new(1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0),
            Self::Upwards => Matrix3::new(1.0, 0.0, 1.0, 0.0, -1.0, height, 0.0, 0.0, 1.0),
        }
    }

    /// Ours from the file's.
    fn to_ours(self, height: f64) -> Matrix3<f64> {
        match self {
            Self::FromZero => Matrix3::identity(),
            Self::FromOne => Matrix3::new(1.0, 0.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0),
            Self::Upwards => Matrix3::new(1.0, 0.0, -1.0, 0.0, -1.0, height, 0.0, 0.0, 1.0),
        }
    }
}

/// Coefficients of a camera.
const ROWS: usize = 11;

fn read(files: &[InputFile], given: &Given, count: Count) -> Result<Rig> {
    let file = &files[0];
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(ROWS);
    for (line, content) in lines(file.text()?) {
        let values = row(content, file, line)?;
        if rows.len() == ROWS || rows.first().is_some_and(|first| first.len() != values.len()) {
            return Err(file.error(
                line,
                format!("{} values in line {} of {ROWS}", values.len(), rows.len() + 1),
                "give 11 lines, each with one value per camera",
            ));
        }
        rows.push(values);
    }
    if rows.len() != ROWS {
        let problem = format!("expected 11 lines, found {}", rows.len());
        return Err(file.error(0, problem, "give 11 lines, each with one value per camera"));
    }
    let mut matrices = Vec::with_capacity(rows[0].len());
    for (camera, _) in rows[0].iter().enumerate() {
        let size = given.size(camera);
        let height = match (count, size) {
            (Count::Upwards, None) => {
                let problem =
                    "v counts up from the bottom, and the height of the pictures is unknown".into();
                let hint = Hint::new("give their size", Remedy::ImageSize);
                return Err(file.error(0, problem, hint));
            }
            (_, size) => size.map_or(0.0, |[_, height]| f64::from(height)),
        };
        let values = (0..ROWS).map(|index| rows[index][camera]).chain([1.0]);
        let theirs = Matrix3x4::from_row_iterator(values);
        let ours = count.to_ours(height) * theirs;
        let depth = ours.fixed_view::<1, 3>(2, 0).norm();
        let scaled = ours / depth;
        if !scaled.iter().all(|value| value.is_finite()) {
            let problem = format!("camera {} has no centre: L9, L10 and L11 are 0", camera + 1);
            return Err(file.error(0, problem, "such a camera is infinitely far away"));
        }
        matrices.push((scaled, size));
    }
    // The coefficients do not say on which side of a camera things are. A right-handed world seen
    // without mirrors has a positive determinant; where no camera agrees, the world is left-handed,
    // and its origin lies before the cameras.
    let upright = |matrix: &Matrix3x4<f64>| matrix.fixed_view::<3, 3>(0, 0).determinant() > 0.0;
    let any = matrices.iter().any(|(matrix, _)| upright(matrix));
    let camera = |(index, (matrix, size)): (usize, (Matrix3x4<f64>, Option<[u32; 2]>))| {
        let sign = if any && !upright(&matrix) { -1.0 } else { 1.0 };
        RigCamera {
            name: format!("camera{}", index + 1),
            size,
            optics: Optics::Linear(ProjectionMatrix(matrix * sign)),
        }
    };
    Ok(Rig { unit: None, cameras: matrices.into_iter().enumerate().map(camera).collect() })
}

fn write(rig: &Rig, count: Count) -> Result<Vec<OutputFile>> {
    let name = match count {
        Count::FromZero => FORMAT.name,
        Count::FromOne => DLTDV8.name,
        Count::Upwards => DLTDV.name,
    };
    let mut columns = Vec::with_capacity(rig.cameras.len());
    for camera in &rig.cameras {
        let Optics::Linear(matrix) = &camera.optics else { continue };
        let height = match count {
            Count::Upwards => f64::from(Rig::size_of(camera, name)?[1]),
            _ => 0.0,
        };
        let theirs = count.to_theirs(height) * matrix.0;
        let scaled = theirs / theirs[(2, 3)];
        // In units of the scene the origin is a point like any other.
        if !scaled.iter().all(|value| value.is_finite() && value.abs() < 1e15) {
            return Err(Format::unsupported(
                name,
                format!(
                    "camera `{}`: the world's origin lies in the plane of its centre",
                    camera.name
                ),
                "move the world's origin, then fit again",
            ));
        }
        columns.push(scaled);
    }
    let line = |index: usize| {
        let cells: Vec<String> =
            columns.iter().map(|matrix| number(matrix[(index / 4, index % 4)])).collect();
        cells.join(",") + "\n"
    };
    Ok(vec![OutputFile::only((0..ROWS).map(line).collect())])
}
