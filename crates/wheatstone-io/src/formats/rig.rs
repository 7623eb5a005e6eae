//! Cameras as other programs speak of them.

use super::InputFile;
use nalgebra::{Matrix3, Vector3};
use wheatstone_core::{
    Error, Result,
    camera::{brown_conrady::BrownConrady, kannala_brandt::KannalaBrandt, pinhole::Pinhole},
    error::{Hint, Remedy},
    geometry::{Pixel, Point3, Pose, ProjectionMatrix},
    method::FittedCamera,
    unit,
};

/// Cameras that stand in one world.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// The unit of the world's lengths, where the file says it.
    pub unit: Option<String>,
    /// The cameras, in their order.
    pub cameras: Vec<RigCamera>,
}

/// One camera of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigCamera {
    /// Its name.
    pub name: String,
    /// Width and height of its pictures in pixels, where known.
    pub size: Option<[u32; 2]>,
    /// World to pixel.
    pub optics: Optics,
}

/// How a camera observes the world.
#[derive(Clone, Debug, PartialEq)]
pub enum Optics {
    /// A pinhole with OpenCV's up to fourteen coefficients.
    Brown(FittedCamera<BrownConrady>),
    /// OpenCV's fisheye.
    KannalaBrandt(FittedCamera<KannalaBrandt>),
    /// A projection matrix, with whatever skew it has.
    Linear(ProjectionMatrix),
}

/// What a format can hold of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A pinhole with so many of OpenCV's coefficients: 0, 4, 5, 8, 12 or 14.
    Brown(usize),
    /// OpenCV's fisheye with up to so many coefficients: 0 to 4.
    KannalaBrandt(usize),
    /// A projection matrix.
    Linear,
}

/// OpenCV's numbers of coefficients.
const COUNTS: [usize; 6] = [0, 4, 5, 8, 12, 14];

/// A matrix with this much skew, as a share of its focal length, has none: rounding is far below.
const SKEW: f64 = 1e-12;

impl Optics {
    /// Where a world point falls; `None` where the camera cannot see it.
    #[must_use]
    pub fn project(&self, world: Point3) -> Option<Pixel> {
        match self {
            Self::Brown(camera) => camera.project(world),
            Self::KannalaBrandt(camera) => camera.project(world),
            Self::Linear(matrix) => matrix.project(world),
        }
    }

    /// The same camera in a form, if that holds it without loss.
    #[must_use]
    pub fn in_form(&self, form: Form) -> Option<Self> {
        match (self, form) {
            (Self::Brown(camera), Form::Brown(most)) => (!camera.mirrored
                && coefficients(&camera.model, 0).len() <= most)
                .then(|| self.clone()),
            (Self::KannalaBrandt(camera), Form::KannalaBrandt(most)) => {
                let used = camera.model.coefficients.iter().rposition(|value| *value != 0.0);
                (!camera.mirrored && used.is_none_or(|last| last < most)).then(|| self.clone())
            }
            (Self::Linear(_), Form::Linear) => Some(self.clone()),
            (Self::Brown(camera), Form::Linear) => {
                coefficients(&camera.model, 0).is_empty().then(|| linear(camera))
            }
            (Self::Linear(matrix), Form::Brown(_)) => {
                let (k, rotation, translation) = matrix.decompose()?;
                let holds = rotation.determinant() > 0.0 && k[(0, 1)].abs() <= SKEW * k[(0, 0)];
                let pinhole =
                    Pinhole { focal: [k[(0, 0)], k[(1, 1)]], principal: [k[(0, 2)], k[(1, 2)]] };
                holds.then(|| Self::brown(pinhole, &[], Pose { rotation, translation }))?
            }
            _ => None,
        }
    }

    /// From OpenCV's coefficients; `None` for another number of them than OpenCV knows.
    #[must_use]
    pub fn brown(pinhole: Pinhole, given: &[f64], camera_from_world: Pose) -> Option<Self> {
        let mut all = [0.0; 14];
        if !COUNTS.contains(&given.len()) {
            return None;
        }
        all[..given.len()].copy_from_slice(given);
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tilt_x, tilt_y] = all;
        let model = BrownConrady {
            pinhole,
            radial: [k1, k2, k3],
            tangential: [p1, p2],
            rational: [k4, k5, k6],
            prism: [s1, s2, s3, s4],
            tilt: [tilt_x, tilt_y],
        };
        Some(Self::Brown(FittedCamera { model, camera_from_world, mirrored: false }))
    }

    /// A fisheye.
    #[must_use]
    pub fn fisheye(pinhole: Pinhole, coefficients: [f64; 4], camera_from_world: Pose) -> Self {
        let model = KannalaBrandt { pinhole, coefficients };
        Self::KannalaBrandt(FittedCamera { model, camera_from_world, mirrored: false })
    }

    /// Where the camera stands; `None` for a matrix, whose pose is not kept apart.
    #[must_use]
    pub fn pose(&self) -> Option<Pose> {
        match self {
            Self::Brown(camera) => Some(camera.camera_from_world),
            Self::KannalaBrandt(camera) => Some(camera.camera_from_world),
            Self::Linear(_) => None,
        }
    }

    /// Its focal lengths and principal point; `None` for a matrix.
    #[must_use]
    pub fn pinhole(&self) -> Option<Pinhole> {
        match self {
            Self::Brown(camera) => Some(camera.model.pinhole),
            Self::KannalaBrandt(camera) => Some(camera.model.pinhole),
            Self::Linear(_) => None,
        }
    }

    /// The same camera in a world whose lengths are `factor` times as large in number, and whose frame
    /// is `new_from_old`.
    #[must_use]
    pub fn moved(&self, factor: f64, new_from_old: &Pose) -> Self {
        let old_from_new = new_from_old.inverse();
        let moved = |pose: &Pose| Pose {
            rotation: pose.rotation * old_from_new.rotation,
            translation: pose.rotation * old_from_new.translation + pose.translation * factor,
        };
        let mut new = self.clone();
        match &mut new {
            Self::Brown(camera) => camera.camera_from_world = moved(&camera.camera_from_world),
            Self::KannalaBrandt(camera) => {
                camera.camera_from_world = moved(&camera.camera_from_world);
            }
            Self::Linear(matrix) => {
                let turned = matrix.0.fixed_view::<3, 3>(0, 0) * old_from_new.rotation;
                let last = matrix.0.fixed_view::<3, 3>(0, 0) * old_from_new.translation
                    + matrix.0.column(3) * factor;
                matrix.0.fixed_view_mut::<3, 3>(0, 0).copy_from(&turned);
                matrix.0.set_column(3, &last);
            }
        }
        new
    }
}

/// The matrix of a pinhole.
fn linear(camera: &FittedCamera<BrownConrady>) -> Optics {
    let Pinhole { focal, principal } = camera.model.pinhole;
    let side = if camera.mirrored { -1.0 } else { 1.0 };
    let k = Matrix3::new(
        side * focal[0],
        0.0,
        principal[0],
        0.0,
        focal[1],
        principal[1],
        0.0,
        0.0,
        1.0,
    );
    let Pose { rotation, translation } = camera.camera_from_world;
    let mut matrix = nalgebra::Matrix3x4::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(k * rotation));
    matrix.set_column(3, &(k * translation));
    Optics::Linear(ProjectionMatrix(matrix))
}

/// OpenCV's coefficients k1, k2, p1, p2, k3, k4, k5, k6, s1 to s4, tauX, tauY: as many of them as say all, and at
/// least so many.
#[must_use]
pub fn coefficients(lens: &BrownConrady, least: usize) -> Vec<f64> {
    let ([k1, k2, k3], [p1, p2]) = (lens.radial, lens.tangential);
    let ([k4, k5, k6], [s1, s2, s3, s4]) = (lens.rational, lens.prism);
    let [tilt_x, tilt_y] = lens.tilt;
    let all = [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tilt_x, tilt_y];
    let used = all.iter().rposition(|value| *value != 0.0).map_or(0, |last| last + 1);
    let count = COUNTS.into_iter().find(|count| *count >= used.max(least)).unwrap_or(all.len());
    all[..count].to_vec()
}

impl Rig {
    /// Where the cameras stand, for formats that hold poses: every camera has one there.
    pub(super) fn pinhole_and_pose(camera: &RigCamera) -> Result<(Pinhole, Pose)> {
        camera.optics.pinhole().zip(camera.optics.pose()).ok_or_else(|| Error::Unsupported {
            format: "this format".into(),
            what: format!("the projection matrix of camera `{}`", camera.name),
            hint: "`dlt` holds it".into(),
        })
    }

    /// The same rig with lengths in another unit; as it is where it does not say its own.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] where one of the units is not known.
    pub fn in_unit(&self, wanted: &str, format: &str) -> Result<Self> {
        let Some(own) = self.unit.as_deref().filter(|own| *own != wanted) else {
            return Ok(self.clone());
        };
        let Some(factor) = unit::factor(own, wanted) else {
            return Err(Error::Unsupported {
                format: format.into(),
                what: format!("lengths in `{own}`: it needs `{wanted}`"),
                hint: format!(
                    "units that convert are {}",
                    unit::names().collect::<Vec<_>>().join(", ")
                )
                .into(),
            });
        };
        let camera = |camera: &RigCamera| RigCamera {
            optics: camera.optics.moved(factor, &Pose::default()),
            ..camera.clone()
        };
        Ok(Self { unit: Some(wanted.into()), cameras: self.cameras.iter().map(camera).collect() })
    }

    /// The size of a camera's pictures, for formats that cannot do without.
    pub(super) fn size_of(camera: &RigCamera, format: &str) -> Result<[u32; 2]> {
        camera.size.ok_or_else(|| Error::Unsupported {
            format: format.into(),
            what: format!("camera `{}` without the size of its pictures", camera.name),
            hint: Hint::new("give the size of its pictures", Remedy::ImageSize),
        })
    }
}

/// A rotation matrix as a file gives it, row by row. What is left of few digits is made a rotation;
/// one that is further off is refused.
pub(super) fn rotation(rows: [f64; 9], file: &InputFile, line: u64) -> Result<Matrix3<f64>> {
    // Seventeen digits leave the first, three leave the second.
    const EXACT: f64 = 1e-12;
    const NEARLY: f64 = 5e-3;
    let matrix = Matrix3::from_row_slice(&rows);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).norm();
    let refuse = |problem: &str| {
        let hint = "rotations have orthonormal rows and determinant 1";
        Err(file.error(line, problem.into(), hint))
    };
    if off.is_nan() || off > NEARLY {
        return refuse("this is not a rotation matrix");
    }
    if matrix.determinant() < 0.0 {
        return refuse("this matrix contains a reflection");
    }
    if off <= EXACT {
        return Ok(matrix);
    }
    let svd = matrix.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => Ok(u * v_t),
        _ => refuse("this is not a rotation matrix"),
    }
}

/// Focal lengths and principal point of a camera matrix given row by row, which must have no skew.
pub(super) fn pinhole(rows: [f64; 9], file: &InputFile, line: u64) -> Result<Pinhole> {
    let [fx, skew, cx, zero, fy, cy, nought, naught, one] = rows;
    let odd = [zero, nought, naught].iter().any(|value| *value != 0.0) || one != 1.0;
    if odd || skew != 0.0 {
        let problem =
            if odd { "this is not a camera matrix" } else { "the camera matrix has skew" };
        return Err(file.error(
            line,
            problem.into(),
            "rows are fx 0 cx, 0 fy cy, 0 0 1; a camera with skew is held by `dlt` alone",
        ));
    }
    lens([fx, fy, cx, cy], file, line)
}

/// Focal lengths, which must be positive, and principal point.
pub(super) fn lens(values: [f64; 4], file: &InputFile, line: u64) -> Result<Pinhole> {
    let [fx, fy, cx, cy] = values;
    if fx > 0.0 && fy > 0.0 {
        return Ok(Pinhole { focal: [fx, fy], principal: [cx, cy] });
    }
    Err(file.error(line, "focal lengths are positive".into(), "pixels, not millimetres"))
}

/// A width or a height.
pub(super) fn whole(value: f64, file: &InputFile, line: u64) -> Result<u32> {
    // No sensor is larger, and sums of it overflow nothing.
    const LARGEST: f64 = 1e6;
    if (1.0..=LARGEST).contains(&value) && value.fract() == 0.0 {
        return Ok(value as u32);
    }
    Err(file.error(line, format!("{value} is not a width or height of a picture"), "whole pixels"))
}

/// Three numbers as a vector.
pub(super) fn vector([x, y, z]: [f64; 3]) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

/// Row by row.
pub(super) fn rows(matrix: &Matrix3<f64>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}
