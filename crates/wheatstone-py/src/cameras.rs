//! Cameras of other programs: OpenCV's matrices, and files in any format.

use crate::{
    errors::{invalid, raised},
    model::PyModel,
    work,
};
use numpy::{IntoPyArray, PyArray2, ndarray::Array2};
use pyo3::{prelude::*, types::PyDict};
use serde_json::json;
use std::path::PathBuf;
use wheatstone::{
    Calibration, Error, Format, Pose,
    calibration::Imported,
    camera::pinhole::Pinhole,
    formats::{
        Approximation, Form, Given, Optics, Rig, RigCamera, approximate, approximate_rig,
        calibration, coefficients, gather, guess, save,
    },
    geometry::Vector3,
    nalgebra::{Matrix3, Matrix3x4},
    rectification::{PairSettings, Rectification},
};

/// One camera as OpenCV has it: K row by row, the coefficients, R row by row, T; its picture's size.
type Given9 = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Option<[u32; 2]>);

/// A model of cameras whose matrices are given, each with its pose from the world: `x = R X + t`.
#[pyfunction]
pub(crate) fn from_matrices(
    cameras: Vec<Given9>,
    unit: String,
    fisheye: bool,
    pixel_sigma: f64,
) -> PyResult<PyModel> {
    let camera = |(index, given): (usize, &Given9)| -> PyResult<RigCamera> {
        let (k, d, r, t, size) = given;
        let refuse =
            |problem: &str, hint: &str| invalid(format!("camera {index}: {problem}"), hint);
        let (&[fx, skew, cx, _, fy, cy, ..], &[x, y, z]) = (&k[..], &t[..]) else {
            return Err(refuse("K is no 3 x 3 matrix, or T no vector", "give OpenCV's arrays"));
        };
        if skew != 0.0 {
            return Err(refuse("K has skew", "OpenCV's camera matrices have none"));
        }
        let rotation = Matrix3::from_row_slice(r);
        let off = (rotation * rotation.transpose() - Matrix3::identity()).norm();
        if off > 1e-3 || rotation.determinant() < 0.0 {
            return Err(refuse("R is no rotation", "rotations have orthonormal rows"));
        }
        let pose = Pose { rotation, translation: Vector3::new(x, y, z) };
        let pinhole = Pinhole { focal: [fx, fy], principal: [cx, cy] };
        let optics = if fisheye {
            d[..].try_into().ok().map(|lens| Optics::fisheye(pinhole, lens, pose))
        } else {
            Optics::brown(pinhole, d, pose)
        };
        let optics = optics.ok_or_else(|| {
            refuse(
                &format!("{} coefficients of distortion", d.len()),
                "give 0, 4, 5, 8, 12 or 14, and 4 for a fisheye",
            )
        })?;
        Ok(RigCamera { name: format!("camera{}", index + 1), size: *size, optics })
    };
    let cameras: Vec<RigCamera> =
        cameras.iter().enumerate().map(camera).collect::<PyResult<_>>()?;
    let imported = Imported {
        format: if fisheye { "opencv-fisheye" } else { "opencv" }.into(),
        files: Vec::new(),
        cameras: cameras.iter().map(|camera| camera.name.clone()).collect(),
        sizes: cameras.iter().map(|camera| camera.size).collect(),
        pixel_sigma,
    };
    let rig = Rig { unit: Some(unit), cameras };
    calibration(&rig, imported).map(PyModel::new).map_err(raised)
}

/// A model of cameras in files of another program.
#[pyfunction]
#[pyo3(signature = (paths, format, sizes, unit, pixel_sigma))]
pub(crate) fn read_cameras(
    py: Python,
    paths: Vec<PathBuf>,
    format: Option<String>,
    sizes: Vec<[u32; 2]>,
    unit: Option<String>,
    pixel_sigma: f64,
) -> PyResult<PyModel> {
    py.detach(|| {
        let format = match &format {
            Some(name) => Some(Format::named(name)?),
            None => guess(&paths)?,
        };
        let (Some(format), _) = (format, &paths) else {
            return Calibration::load(&paths[0]);
        };
        let files = gather(format, &paths)?;
        let given = Given { unit, sizes, ..Given::default() };
        let rig = format.read_rig(&files, &given)?;
        let name = |path: &PathBuf| {
            path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
        };
        let imported = Imported {
            format: format.name.into(),
            files: files.iter().map(|file| name(&file.path)).collect(),
            cameras: rig.cameras.iter().map(|camera| camera.name.clone()).collect(),
            sizes: rig.cameras.iter().map(|camera| camera.size).collect(),
            pixel_sigma,
        };
        calibration(&rig, imported)
    })
    .map(PyModel::new)
    .map_err(raised)
}

impl PyModel {
    /// The cameras in one of several forms, with the sizes that are given.
    fn approximated(
        &self,
        py: Python,
        forms: &[Form],
        sizes: &[Option<[u32; 2]>],
    ) -> PyResult<Approximation> {
        work::run(py, None, |progress| {
            let mut model = (*self.model).clone();
            let size = |camera: usize| {
                sizes.get(camera).copied().flatten().or(self.model.picture_size(camera))
            };
            model.sizes = (0..self.cameras()).map(size).collect();
            if let (Some(rig), true) =
                (wheatstone::formats::exact(&model), model.data.world.is_empty())
            {
                return approximate_rig(&rig, forms, progress);
            }
            approximate(&model, forms, progress)
        })
    }
}

#[pymethods]
impl PyModel {
    /// The cameras as OpenCV's matrices, `camera_from_world` (3, 4) each, and what was lost, as JSON.
    fn matrices<'py>(
        &self,
        py: Python<'py>,
        fisheye: bool,
        sizes: Vec<Option<[u32; 2]>>,
    ) -> PyResult<(Vec<Bound<'py, PyDict>>, String)> {
        let form = if fisheye { Form::KannalaBrandt(4) } else { Form::Brown(14) };
        let found = self.approximated(py, &[form], &sizes)?;
        let camera = |camera: &RigCamera| -> PyResult<Bound<'py, PyDict>> {
            let told = PyDict::new(py);
            let (pinhole, pose) =
                camera.optics.pinhole().zip(camera.optics.pose()).ok_or_else(|| {
                    invalid("these cameras are projection matrices", "export them as `dlt`")
                })?;
            let lens = match &camera.optics {
                Optics::Brown(fitted) => coefficients(&fitted.model, 5),
                Optics::KannalaBrandt(fitted) => fitted.model.coefficients.to_vec(),
                Optics::Linear(_) => Vec::new(),
            };
            let k = Matrix3::new(
                pinhole.focal[0],
                0.0,
                pinhole.principal[0],
                0.0,
                pinhole.focal[1],
                pinhole.principal[1],
                0.0,
                0.0,
                1.0,
            );
            let mut from_world = Matrix3x4::zeros();
            from_world.fixed_view_mut::<3, 3>(0, 0).copy_from(&pose.rotation);
            from_world.set_column(3, &pose.translation);
            told.set_item("K", array(py, (3, 3), |(row, column)| k[(row, column)]))?;
            told.set_item("D", lens.into_pyarray(py))?;
            told.set_item(
                "camera_from_world",
                array(py, (3, 4), |(row, column)| from_world[(row, column)]),
            )?;
            told.set_item("size", camera.size)?;
            Ok(told)
        };
        let cameras = found.rig.cameras.iter().map(camera).collect::<PyResult<_>>()?;
        Ok((cameras, json!(found.loss).to_string()))
    }

    /// Writes the cameras in a format of another program; the files, and what was lost, as JSON.
    fn export(
        &self,
        py: Python,
        format: &str,
        path: PathBuf,
        sizes: Vec<Option<[u32; 2]>>,
    ) -> PyResult<(Vec<PathBuf>, String)> {
        let format = Format::named(format).map_err(raised)?;
        if format.is_pair() {
            let written = work::run(py, None, |progress| {
                let wanted = PairSettings { sizes, ..PairSettings::default() };
                let made = Rectification::of(&self.model, &wanted, progress)?;
                save(&format.write_pair(&made)?, &path)
            })?;
            return Ok((written, "null".into()));
        }
        if !(format.is_calibration() && format.writes()) {
            return Err(raised(Error::Unsupported {
                format: format.name.into(),
                what: "cameras".into(),
                hint: "choose a format of calibrations".into(),
            }));
        }
        format.check_name(&path).map_err(raised)?;
        let found = self.approximated(py, format.forms(), &sizes)?;
        let written = py.detach(|| save(&format.write_rig(&found.rig)?, &path)).map_err(raised)?;
        let loss = found.loss.or_else(|| format.loss(&found.rig));
        Ok((written, json!(loss).to_string()))
    }

    /// A rectified pair of two cameras: left and right tables of x and y, and all else as JSON.
    fn rectify<'py>(
        &self,
        py: Python<'py>,
        cameras: [usize; 2],
        sizes: Vec<Option<[u32; 2]>>,
        size: Option<[u32; 2]>,
        focal: Option<f64>,
    ) -> PyResult<(Vec<Bound<'py, PyArray2<f32>>>, String)> {
        let (tables, told) = work::run(py, None, |progress| {
            let mut sizes = sizes;
            sizes.resize(self.cameras().max(sizes.len()), None);
            let wanted = PairSettings { cameras, sizes, size, focal };
            let made = Rectification::of(&self.model, &wanted, progress)?;
            let rows = |matrix: &Matrix3x4<f64>| -> Vec<Vec<f64>> {
                matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
            };
            let [p1, p2] = made.pair.projections();
            let q: Vec<Vec<f64>> = made
                .pair
                .depth_matrix()
                .row_iter()
                .map(|row| row.iter().copied().collect())
                .collect();
            let pose = made.pair.rectified_from_world;
            let r: Vec<Vec<f64>> =
                pose.rotation.row_iter().map(|row| row.iter().copied().collect()).collect();
            let told = json!({
                "pair": made.pair, "leftover": made.leftover, "P1": rows(&p1), "P2": rows(&p2), "Q": q,
                "rotation": r, "translation": [pose.translation.x, pose.translation.y, pose.translation.z],
            });
            Ok(([made.table(0), made.table(1)], told.to_string()))
        })?;
        let mut arrays = Vec::with_capacity(4);
        for table in tables {
            let shape = (table.height, table.width);
            for values in [table.x, table.y] {
                let array = Array2::from_shape_vec(shape, values)
                    .map_err(|e| invalid(e.to_string(), ""))?;
                arrays.push(array.into_pyarray(py));
            }
        }
        Ok((arrays, told))
    }
}

fn array<'py>(
    py: Python<'py>,
    shape: (usize, usize),
    value: impl Fn((usize, usize)) -> f64,
) -> Bound<'py, PyArray2<f64>> {
    Array2::from_shape_fn(shape, value).into_pyarray(py)
}
