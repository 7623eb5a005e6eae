//! Pictures: charts in arrays of pixels.

use crate::{
    dataset::PyDataset,
    errors::{invalid, not_found, raised},
    pool::pool,
    work,
};
use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods,
    ndarray::{Array2, ArrayViewD},
};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use wheatstone::{
    AnyChart, ChartSearch, DetectionSettings, GrayImage, Limits, Pose,
    capture::{CameraPictures, Capture, CapturedView},
    detection::detect_in,
    geometry::Vector3,
    imaging::ColourImage,
    read_image,
};

/// A chart, as the `[chart]` table of `capture.toml` has it, in JSON.
fn chart_of(text: &str) -> PyResult<AnyChart> {
    let mut chart: AnyChart = serde_json::from_str(text)
        .map_err(|e| invalid(format!("the chart: {e}"), "`wheatstone.Chart` makes charts"))?;
    chart.load(Path::new("")).and_then(|()| chart.validate()).map_err(raised)?;
    Ok(chart)
}

/// Shares of red, green and blue in a grey value (ITU-R BT.709), as for files of pictures.
const RGB: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// A grey picture of an array (height, width) or (height, width, channels): 8 bits, 16 bits, or floating-point
/// numbers of 0 to 255.
pub(crate) fn picture(array: &Bound<PyAny>, bgr: bool) -> PyResult<GrayImage> {
    fn of<T: Element + Copy>(
        pixels: &ArrayViewD<T>,
        value: impl Fn(T) -> f32,
        bgr: bool,
    ) -> PyResult<GrayImage> {
        let shape = pixels.shape();
        let gray = match *shape {
            [height, width] if height > 0 && width > 0 => {
                let values = pixels.iter().map(|pixel| value(*pixel)).collect();
                GrayImage::from_values(width, height, values)
            }
            [height, width, channels @ (1 | 3 | 4)] if height > 0 && width > 0 => {
                let mut shares = RGB;
                if bgr {
                    shares.reverse();
                }
                let at = |y: usize, x: usize| match channels {
                    1 => value(pixels[[y, x, 0]]),
                    _ => (0..3).map(|c| shares[c] * value(pixels[[y, x, c]])).sum(),
                };
                let values = (0..height).flat_map(|y| (0..width).map(move |x| (y, x)));
                GrayImage::from_values(width, height, values.map(|(y, x)| at(y, x)).collect())
            }
            _ => None,
        };
        gray.ok_or_else(|| {
            invalid(
                format!("an array of shape {shape:?} is no picture"),
                "give (height, width), or (height, width, 3)",
            )
        })
    }
    if let Ok(array) = array.extract::<PyReadonlyArrayDyn<u8>>() {
        return of(&array.as_array(), f32::from, bgr);
    }
    if let Ok(array) = array.extract::<PyReadonlyArrayDyn<u16>>() {
        return of(&array.as_array(), |pixel| f32::from(pixel) / 257.0, bgr);
    }
    let array = array.extract::<PyReadonlyArrayDyn<f32>>()?;
    of(&array.as_array(), |pixel| if pixel.is_finite() { pixel } else { 0.0 }, bgr)
}

/// The same with its colours, where it has 8 bits and three or four channels; others are as grey as they are.
pub(crate) fn colour_picture(array: &Bound<PyAny>, bgr: bool) -> PyResult<ColourImage> {
    let gray = picture(array, bgr)?;
    let order = if bgr { [2, 1, 0] } else { [0, 1, 2] };
    if let Ok(array) = array.extract::<PyReadonlyArrayDyn<u8>>()
        && let [height, width, 3 | 4] = *array.shape()
    {
        let pixels = array.as_array();
        let colour = |at: usize| order.map(|channel| pixels[[at / width, at % width, channel]]);
        let colours = (0..height * width).map(colour).collect();
        if let Some(coloured) = ColourImage::new(gray.clone(), colours) {
            return Ok(coloured);
        }
    }
    Ok(ColourImage::from_gray(gray))
}

/// Ids, pixels (n, 2), standard deviations, places on the chart (n, 3), names, and the number of readings.
type Detected<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Vec<String>,
    usize,
);

/// Looks for a chart in one picture.
#[pyfunction]
pub(crate) fn detect<'py>(
    py: Python<'py>,
    image: &Bound<'py, PyAny>,
    chart: &str,
    bgr: bool,
) -> PyResult<Detected<'py>> {
    let (chart, image) = (chart_of(chart)?, picture(image, bgr)?);
    let search = py.detach(|| pool().map(|pool| pool.install(|| chart.detect(&image))))?;
    let readings = match search {
        ChartSearch::NotFound(why) => return Err(not_found(&why)),
        ChartSearch::Found(readings) => readings,
    };
    let Some(first) = readings.first() else { return Err(not_found("no reading")) };
    let (points, places) = (&first.points, chart.points());
    let count = points.len();
    let mut sigmas = first.sigmas.clone();
    sigmas.resize(count, f64::NAN);
    let ids: Vec<i64> = points.iter().map(|(id, _)| *id as i64).collect();
    Ok((
        ids.into_pyarray(py),
        Array2::from_shape_fn((count, 2), |(row, axis)| points[row].1[axis]).into_pyarray(py),
        sigmas.into_pyarray(py),
        Array2::from_shape_fn((count, 3), |(row, axis)| places[points[row].0][axis])
            .into_pyarray(py),
        points.iter().map(|(id, _)| chart.name(*id)).collect(),
        readings.len(),
    ))
}

/// What a camera saw of each view: an array, a path, or nothing.
#[derive(FromPyObject)]
pub(crate) enum Seen<'py> {
    File(PathBuf),
    Array(Bound<'py, PyAny>),
}

/// Where a chart stood: a translation and a rotation vector.
type PlacedView = Option<([f64; 3], [f64; 3])>;

/// The points of a chart in the pictures of all cameras, one list of views a camera.
#[pyfunction]
#[pyo3(signature = (pictures, chart, views, options, progress = None))]
pub(crate) fn detect_all(
    py: Python,
    pictures: Vec<Vec<Option<Seen>>>,
    chart: &str,
    views: Vec<(String, PlacedView)>,
    options: (String, bool),
    progress: Option<Py<PyAny>>,
) -> PyResult<(PyDataset, Vec<Option<[u32; 2]>>)> {
    let (unit, bgr) = options;
    let chart = chart_of(chart)?;
    let mut arrays: Vec<GrayImage> = Vec::new();
    let mut cameras = Vec::with_capacity(pictures.len());
    let mut sizes: Vec<Option<[u32; 2]>> = vec![None; pictures.len()];
    for (index, of_camera) in pictures.into_iter().enumerate() {
        let mut paths = Vec::with_capacity(of_camera.len());
        for seen in of_camera {
            paths.push(match seen {
                None => None,
                Some(Seen::File(path)) => Some(path),
                Some(Seen::Array(array)) => {
                    let image = picture(&array, bgr)?;
                    sizes[index].get_or_insert([image.width() as u32, image.height() as u32]);
                    arrays.push(image);
                    Some(named(arrays.len() - 1))
                }
            });
        }
        cameras.push(CameraPictures { name: format!("camera{}", index + 1), pictures: paths });
    }
    let view = |(name, place): (String, PlacedView)| CapturedView {
        name,
        world_from_chart: place
            .map(|(t, r)| Pose::from_rotation_vector(Vector3::from(t), Vector3::from(r))),
        sigma: None,
    };
    let views = views.into_iter().map(view).collect();
    let capture = Capture { path: PathBuf::new(), unit, chart, cameras, views };
    let data = work::run(py, progress, |progress| {
        let read = |path: &Path| match index_of(path).and_then(|index| arrays.get(index)) {
            Some(image) => Ok(image.clone()),
            None => read_image(path, Limits::default()),
        };
        Ok(detect_in(&capture, DetectionSettings::default(), &read, progress)?.dataset)
    })?;
    let of_files = capture.sizes();
    let known = sizes.into_iter().zip(of_files).map(|(array, file)| array.or(file));
    Ok((PyDataset(data), known.collect()))
}

/// What stands for the path of a picture that is an array.
const ARRAY: &str = "array ";

fn named(index: usize) -> PathBuf {
    format!("{ARRAY}{index}").into()
}

fn index_of(path: &Path) -> Option<usize> {
    path.to_str()?.strip_prefix(ARRAY)?.parse().ok()
}

/// A chart as JSON, with all its settings.
#[pyfunction]
pub(crate) fn chart_settings(chart: &str) -> PyResult<String> {
    serde_json::to_string(&chart_of(chart)?).map_err(|e| invalid(e.to_string(), ""))
}

/// The places (n, 3) of a chart's points in its own frame.
#[pyfunction]
pub(crate) fn chart_points<'py>(
    py: Python<'py>,
    chart: &str,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let places = chart_of(chart)?.points();
    let value = |(row, axis): (usize, usize)| places[row][axis];
    Ok(Array2::from_shape_fn((places.len(), 3), value).into_pyarray(py))
}
