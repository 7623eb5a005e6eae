//! Point clouds of what calibrated cameras see.

use crate::{
    errors::{invalid, raised},
    model::PyModel,
    pictures::colour_picture,
    work::run,
};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::{prelude::*, types::PyDict};
use std::{path::PathBuf, sync::Arc};
use wheatstone::{
    Calibration, Pixel, Progress,
    dataset::volume::Trust,
    imaging::ColourImage,
    reconstruction::{
        Cloud, CloudFormat, FrameFusion, Reconstruction, ReconstructionSettings, SceneReconstructor,
    },
    stereo::DisparityMap,
};

self_cell::self_cell! {
    /// Cameras made ready beside the model that they borrow.
    struct Ready {
        owner: Arc<Calibration>,
        #[covariant]
        dependent: SceneReconstructor,
    }
}

/// Two or more cameras of a model, made ready for many pictures.
#[pyclass(frozen, name = "Reconstructor", module = "wheatstone._wheatstone")]
pub(crate) struct PyReconstructor {
    ready: Ready,
}

#[pymethods]
impl PyReconstructor {
    /// `sizes` are those of the pictures of `cameras`, in their order.
    #[new]
    fn new(
        py: Python<'_>,
        model: &PyModel,
        cameras: Vec<usize>,
        sizes: Vec<[u32; 2]>,
        depths: Option<[f64; 2]>,
        confidence: Option<f32>,
        max_sigma: Option<f64>,
        region: Option<[u32; 4]>,
        sparse: bool,
    ) -> PyResult<Self> {
        let mut settings = ReconstructionSettings::new(sizes);
        settings.cameras = cameras;
        settings.depths = depths;
        settings.least_confidence = confidence.unwrap_or(settings.least_confidence);
        settings.most_sigma = max_sigma;
        settings.region = region;
        settings.sparse = sparse;
        let owner = model.model.clone();
        let ready = run(py, None, |progress| {
            Ready::try_new(owner, |model| SceneReconstructor::new(model, settings, progress))
        })?;
        Ok(Self { ready })
    }

    /// OpenCV's Q of the first two cameras, row by row; the rotation and translation from the world to the left
    /// rectified camera; and the disparities that are searched.
    fn geometry(&self) -> ([[f64; 4]; 4], [[f64; 3]; 4], [i32; 2]) {
        let made = self.ready.borrow_dependent();
        let (q, pose) = (made.pair().depth_matrix(), made.pair().rectified_from_world);
        let row = |row: usize| std::array::from_fn(|column| q[(row, column)]);
        let turned = |row: usize| std::array::from_fn(|column| pose.rotation[(row, column)]);
        let shifted = [pose.translation.x, pose.translation.y, pose.translation.z];
        let range = made.disparities();
        let pose = [turned(0), turned(1), turned(2), shifted];
        (std::array::from_fn(row), pose, [range.start, range.end])
    }

    /// The points that pictures show: arrays by name.
    fn reconstruct<'py>(
        &self,
        py: Python<'py>,
        images: Vec<Bound<'py, PyAny>>,
        bgr: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.found(py, (&images, bgr), |made, pictures, progress| {
            made.reconstruct(pictures, progress)
        })
    }

    /// The points that several frames show together, and the faults of those that were left out.
    fn fuse<'py>(
        &self,
        py: Python<'py>,
        frames: &Bound<'py, PyAny>,
        bgr: bool,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
        let made = self.ready.borrow_dependent();
        let (mut fusion, mut faults) = (FrameFusion::new(made), Vec::new());
        for frame in frames.try_iter()? {
            let images: Vec<Bound<'py, PyAny>> = frame?.extract()?;
            let pictures = pictures(&images, bgr)?;
            let pictures: Vec<_> = pictures.iter().collect();
            let fault = run(py, None, |progress| fusion.add(&pictures, progress))?;
            faults.extend(fault.map(|([a, b], fault)| format!("cameras {a} and {b}: {fault}")));
        }
        let found = run(py, None, |progress| fusion.finish(progress))?;
        Ok((arrays(py, &found)?, faults))
    }

    /// The points of disparities of the left rectified picture, with a standard deviation in pixels.
    fn locate_disparities<'py>(
        &self,
        py: Python<'py>,
        disparities: PyReadonlyArray2<'_, f64>,
        sigma: f32,
        images: Vec<Bound<'py, PyAny>>,
        bgr: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let values = disparities.as_array();
        let (width, values) = (values.ncols(), values.iter().map(|value| *value as f32).collect());
        let map = DisparityMap::given(width, values, sigma)
            .ok_or_else(|| invalid("the array of disparities is empty", "give one a pixel"))?;
        self.found(py, (&images, bgr), |made, pictures, progress| {
            made.locate(map, pictures, progress)
        })
    }

    /// The points of matched pixels, one row a point: x and y of each camera, NaN where it has none.
    fn locate_pixels<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'_, f64>,
        sigma: f64,
        images: Vec<Bound<'py, PyAny>>,
        bgr: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let pixels = pixels.as_array();
        let seen = |x: f64, y: f64| (x.is_finite() && y.is_finite()).then(|| Pixel::new(x, y));
        let row = |row: usize| -> Vec<Option<Pixel>> {
            (0..pixels.ncols() / 2)
                .map(|camera| seen(pixels[[row, 2 * camera]], pixels[[row, 2 * camera + 1]]))
                .collect()
        };
        let rows: Vec<_> = (0..pixels.nrows()).map(row).collect();
        self.found(py, (&images, bgr), |made, pictures, progress| {
            made.locate_matches(&rows, sigma, pictures, progress)
        })
    }
}

impl PyReconstructor {
    /// What `work` finds in pictures, as arrays by name.
    fn found<'py>(
        &self,
        py: Python<'py>,
        (images, bgr): (&[Bound<'py, PyAny>], bool),
        work: impl FnOnce(
            &SceneReconstructor<'_>,
            &[&ColourImage],
            &dyn Progress,
        ) -> wheatstone::Result<Reconstruction>
        + Send,
    ) -> PyResult<Bound<'py, PyDict>> {
        let pictures = pictures(images, bgr)?;
        let pictures: Vec<_> = pictures.iter().collect();
        let made = self.ready.borrow_dependent();
        let found = run(py, None, |progress| work(made, &pictures, progress))?;
        arrays(py, &found)
    }
}

fn pictures(images: &[Bound<'_, PyAny>], bgr: bool) -> PyResult<Vec<ColourImage>> {
    images.iter().map(|image| colour_picture(image, bgr)).collect()
}

fn arrays<'py>(py: Python<'py>, found: &Reconstruction) -> PyResult<Bound<'py, PyDict>> {
    let Reconstruction { map, cloud, .. } = found;
    let of_picture = |values: &[f32]| values.to_pyarray(py).reshape([map.height, map.width]);
    let told = PyDict::new(py);
    told.set_item("points", rows(py, &cloud.points)?)?;
    told.set_item("sigmas", rows(py, &cloud.sigmas)?)?;
    told.set_item("colours", rows(py, &cloud.colours)?)?;
    told.set_item("confidence", cloud.confidence.to_pyarray(py))?;
    let inside: Vec<bool> = cloud.trust.iter().map(|trust| *trust != Trust::Outside).collect();
    told.set_item("inside", inside.into_pyarray(py))?;
    let pixels: Vec<_> =
        cloud.pixels.iter().map(|camera| rows(py, camera)).collect::<PyResult<_>>()?;
    told.set_item("pixels", pixels)?;
    told.set_item("depth", of_picture(&found.depth)?)?;
    told.set_item("disparity", of_picture(&map.disparity)?)?;
    told.set_item("disparity_confidence", of_picture(&map.confidence)?)?;
    let fault = found.fault.map(|([a, b], fault)| (a, b, fault.to_string()));
    told.set_item("fault", fault)?;
    told.set_item("left_out", found.left_out.clone())?;
    told.set_item("doubts", found.doubts(0))?;
    Ok(told)
}

/// One row a point.
fn rows<'py, T: numpy::Element + Copy, const N: usize>(
    py: Python<'py>,
    points: &[[T; N]],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    points.as_flattened().to_pyarray(py).reshape([points.len(), N])
}

/// Writes a cloud in the format that the file's extension says. Arrays are contiguous, one row a point.
#[pyfunction]
pub(crate) fn save_cloud(
    path: PathBuf,
    points: PyReadonlyArray2<'_, f64>,
    sigmas: PyReadonlyArray2<'_, f32>,
    colours: PyReadonlyArray2<'_, u8>,
    confidence: PyReadonlyArray1<'_, f32>,
    unit: &str,
) -> PyResult<()> {
    let format = CloudFormat::of_file(&path).map_err(raised)?;
    let mut cloud = Cloud::default();
    (cloud.points, cloud.sigmas) = (triples(&points)?, triples(&sigmas)?);
    (cloud.colours, cloud.confidence) = (triples(&colours)?, confidence.as_slice()?.to_vec());
    let columns = [cloud.sigmas.len(), cloud.colours.len(), cloud.confidence.len()];
    if columns != [cloud.points.len(); 3] {
        return Err(invalid("columns of a cloud have several lengths", "give one row a point"));
    }
    format.save(&cloud, unit, &path).map_err(raised)
}

fn triples<T: numpy::Element + Copy>(rows: &PyReadonlyArray2<'_, T>) -> PyResult<Vec<[T; 3]>> {
    if rows.as_array().ncols() != 3 {
        return Err(invalid("rows of a cloud do not have three numbers", "give one row a point"));
    }
    Ok(rows.as_slice()?.as_chunks().0.to_vec())
}
