//! Correspondences, from arrays, tables and files.

use crate::{
    errors::{invalid, raised},
    work,
};
use arrow_array::RecordBatchReader;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2, ndarray::Array2};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyList},
};
use pyo3_arrow::input::AnyRecordBatch;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use wheatstone::{
    Correspondence, Dataset, DetectionSettings, Pixel, Point3,
    capture::{Capture, FILE_NAME, Reach},
    dataset::SavedDataset,
    detect,
    formats::{Given, gather, guess},
    tables::{ColumnNames, Duplicates, TableOptions, TableReader},
};

/// Points that cameras saw: pixels, places, views.
#[pyclass(frozen, name = "Dataset", module = "wheatstone._wheatstone")]
pub(crate) struct PyDataset(pub(crate) Dataset);

/// Data as they are pickled: as a model file keeps them, and what that leaves out.
#[derive(serde::Serialize, serde::Deserialize)]
struct Pickled {
    cameras: usize,
    rows: SavedDataset,
    board: Vec<Option<[f64; 2]>>,
}

/// How tables are read.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Reading {
    unit: Option<String>,
    columns: Option<String>,
    drop_duplicates: bool,
    whole_pixels: bool,
    follow: bool,
}

impl Reading {
    fn of(text: &str) -> PyResult<Self> {
        serde_json::from_str(text)
            .map_err(|e| invalid(format!("cannot read the settings: {e}"), ""))
    }

    fn table(&self) -> wheatstone::Result<TableOptions> {
        let columns = self.columns.as_deref().map(ColumnNames::parse).transpose()?;
        let duplicates = if self.drop_duplicates { Duplicates::Drop } else { Duplicates::Refuse };
        Ok(TableOptions { columns, unit: self.unit.clone(), duplicates, ..TableOptions::default() })
    }
}

/// Whether a path names a capture: a folder with its file, or a TOML file.
fn is_capture(path: &Path) -> bool {
    path.join(FILE_NAME).is_file()
        || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

#[pymethods]
impl PyDataset {
    /// Of a capture, a table, or points in a format of another program.
    #[staticmethod]
    #[pyo3(signature = (path, reading, progress = None))]
    fn read(
        py: Python,
        path: PathBuf,
        reading: &str,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let reading = Reading::of(reading)?;
        work::run(py, progress, |progress| {
            if is_capture(&path) {
                let settings = DetectionSettings {
                    whole_pixels: reading.whole_pixels,
                    ..DetectionSettings::default()
                };
                let reach = if reading.follow { Reach::Anywhere } else { Reach::Folder };
                let capture = Capture::open_within(&path, reach)?;
                return Ok(detect(&capture, settings, progress)?.dataset);
            }
            let regular = path.is_dir() || path.is_file();
            let format =
                if regular { guess(std::slice::from_ref(&path)).ok().flatten() } else { None };
            if let Some(format) = format.filter(|f| !f.is_calibration() && !f.is_table()) {
                let given = Given { unit: reading.unit.clone(), ..Given::default() };
                return format.read_points(&gather(format, &[path])?, &given);
            }
            let options = reading.table()?;
            TableReader::open(&path, &options)?.gather(&options)
        })
        .map(Self)
    }

    /// Of a table that gives its batches by Arrow's PyCapsule interface.
    #[staticmethod]
    fn of_table(py: Python, table: AnyRecordBatch, reading: &str) -> PyResult<Self> {
        let options = Reading::of(reading)?.table().map_err(raised)?;
        let reader: Box<dyn RecordBatchReader + Send> = table.into_reader()?;
        py.detach(|| {
            TableReader::of_batches(Path::new("table"), reader, &options)?.gather(&options)
        })
        .map(Self)
        .map_err(raised)
    }

    /// Of arrays: pixels (n, 2 * cameras), places (n, 3) or places on a board (n, 2), views and names a row.
    #[staticmethod]
    #[pyo3(signature = (pixels, points, board, views, ids, unit))]
    fn of_arrays(
        pixels: PyReadonlyArray2<f64>,
        points: Option<PyReadonlyArray2<f64>>,
        board: Option<PyReadonlyArray2<f64>>,
        views: Option<Vec<String>>,
        ids: Option<Vec<String>>,
        unit: String,
    ) -> PyResult<Self> {
        let pixels = pixels.as_array();
        let points = points.as_ref().map(PyReadonlyArray2::as_array);
        let board = board.as_ref().map(PyReadonlyArray2::as_array);
        let cameras = pixels.ncols() / 2;
        let mut data = Dataset { unit, cameras, views: Vec::new(), correspondences: Vec::new() };
        let mut index = BTreeMap::new();
        for row in 0..pixels.nrows() {
            let view = match &views {
                None => 0,
                Some(views) => *index.entry(views[row].as_str()).or_insert_with(|| {
                    data.views.push(views[row].clone());
                    data.views.len() - 1
                }),
            };
            let pixel = |camera: usize| {
                let (x, y) = (pixels[[row, 2 * camera]], pixels[[row, 2 * camera + 1]]);
                pixel_of(x, y).map_err(|problem| {
                    invalid(
                        format!("pixels, row {row}, camera {camera}: {problem}"),
                        "give NaN for both coordinates where the camera did not see the point",
                    )
                })
            };
            let world = points.map(|points| [0, 1, 2].map(|axis| points[[row, axis]]));
            let on_board = board.map(|board| [0, 1].map(|axis| board[[row, axis]]));
            data.correspondences.push(Correspondence {
                view,
                id: ids.as_ref().map(|ids| ids[row].clone()),
                pixels: (0..cameras).map(pixel).collect::<PyResult<_>>()?,
                world: known(world, ("points", row))?.map(Point3::from),
                board: known(on_board, ("board", row))?,
            });
        }
        Ok(Self(data))
    }

    /// Of what `to_bytes` gave.
    #[staticmethod]
    fn from_bytes(data: &[u8]) -> PyResult<Self> {
        let pickled: Pickled = serde_json::from_slice(data)
            .map_err(|e| invalid(format!("no pickled dataset: {e}"), ""))?;
        let mut data = pickled.rows.restored();
        data.cameras = pickled.cameras;
        for (row, board) in data.correspondences.iter_mut().zip(pickled.board) {
            row.board = board;
        }
        Ok(Self(data))
    }

    /// All of it, bit for bit.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let pickled = Pickled {
            cameras: self.0.cameras,
            rows: SavedDataset::from(&self.0),
            board: self.0.correspondences.iter().map(|row| row.board).collect(),
        };
        let bytes = serde_json::to_vec(&pickled)
            .map_err(|e| invalid(format!("cannot pickle the dataset: {e}"), ""))?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __len__(&self) -> usize {
        self.0.correspondences.len()
    }

    #[getter]
    fn cameras(&self) -> usize {
        self.0.cameras
    }

    #[getter]
    fn unit(&self) -> &str {
        &self.0.unit
    }

    /// (n, 2 * cameras).
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows = &self.0.correspondences;
        let value = |(row, column): (usize, usize)| {
            rows[row].pixels.get(column / 2).copied().flatten().map_or(f64::NAN, |p| p[column % 2])
        };
        Array2::from_shape_fn((rows.len(), 2 * self.0.cameras), value).into_pyarray(py)
    }

    /// (n, 3).
    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows = &self.0.correspondences;
        let value =
            |(row, axis): (usize, usize)| rows[row].world.map_or(f64::NAN, |place| place[axis]);
        Array2::from_shape_fn((rows.len(), 3), value).into_pyarray(py)
    }

    /// (n, 2).
    fn board<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let rows = &self.0.correspondences;
        let value =
            |(row, axis): (usize, usize)| rows[row].board.map_or(f64::NAN, |place| place[axis]);
        Array2::from_shape_fn((rows.len(), 2), value).into_pyarray(py)
    }

    /// The index of each row's view in `view_names`.
    fn views<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let views: Vec<i64> = self.0.correspondences.iter().map(|row| row.view as i64).collect();
        views.into_pyarray(py)
    }

    #[getter]
    fn view_names(&self) -> Vec<String> {
        self.0.views.clone()
    }

    /// The name of each row's point within its view; `None` where it has none.
    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, self.0.correspondences.iter().map(|row| row.id.as_deref()))
    }

    /// Writes a table of points, by the extension of the path.
    fn save(&self, py: Python, path: PathBuf) -> PyResult<()> {
        py.detach(|| wheatstone::tables::save(&self.0, &path)).map_err(raised)
    }
}

/// Coordinates that are given together, or not at all.
fn known<const N: usize>(
    values: Option<[f64; N]>,
    (name, row): (&str, usize),
) -> PyResult<Option<[f64; N]>> {
    let Some(values) = values else { return Ok(None) };
    if values.iter().all(|value| value.is_nan()) {
        return Ok(None);
    }
    if values.iter().all(|value| value.is_finite() && value.abs() <= LARGEST) {
        return Ok(Some(values));
    }
    Err(invalid(
        format!("{name}, row {row}: {values:?} is no place"),
        "give finite numbers, or NaN for all coordinates where the place is not known",
    ))
}

/// Numbers beyond this are no pixels and no lengths in any unit, as in tables.
const LARGEST: f64 = 1e9;

fn pixel_of(x: f64, y: f64) -> Result<Option<Pixel>, String> {
    match (x.is_nan(), y.is_nan()) {
        (true, true) => Ok(None),
        (false, false) if x.abs() <= LARGEST && y.abs() <= LARGEST => Ok(Some(Pixel::new(x, y))),
        _ => Err(format!("({x}, {y}) is no pixel")),
    }
}
