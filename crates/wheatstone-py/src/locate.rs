//! Many points: NumPy arrays in, NumPy arrays out.
//!
//! Rows are read in blocks, straight from the array that was given, whatever its strides; the array is never
//! copied as a whole. Every row's result depends on the model and on that row alone.

use crate::{
    errors::invalid,
    model::PyModel,
    pool::pool,
    sigmas::{Given, Sigmas, refuse_sigmas},
};
use numpy::{
    Element, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods,
    ndarray::{ArrayView2, s},
};
use pyo3::prelude::*;
use rayon::prelude::*;
use std::ops::Range;
use wheatstone::{
    LocatedBatch, Pixel, PixelColumns, Point3, Trust,
    method::{
        CalibratedMap,
        mismatch::{MismatchTest, exchanged_cameras, mismatched_share, noisier_pixels},
    },
};

/// Rows a block: their figures stay in a near cache.
const BLOCK: usize = 2048;

/// Rows between two looks at signals.
const TURN: usize = 1 << 20;

/// The noise of pixels and the one that error bars assume; two cameras; a share of points.
type Doubts = (Option<(f64, f64)>, Option<(usize, usize)>, Option<f64>);

/// Copies some rows to columns.
fn gather<T: Copy + Into<f64>>(rows: ArrayView2<T>, columns: &mut Vec<Vec<f64>>) {
    columns.resize_with(rows.ncols(), Vec::new);
    columns.iter_mut().for_each(|column| column.resize(rows.nrows(), f64::NAN));
    for (camera, own) in columns.chunks_exact_mut(2).enumerate() {
        let [x, y] = own else { continue };
        let column = 2 * camera;
        let into = x.iter_mut().zip(y);
        match rows.as_slice() {
            // Two cameras, which nearly everybody has: of rows of a known width, several are read at once.
            Some(flat) if rows.ncols() == 4 => {
                let flat = flat.as_chunks::<4>().0;
                into.zip(flat).for_each(|((x, y), row)| {
                    [*x, *y] = seen(row[column].into(), row[column + 1].into());
                });
            }
            _ => {
                let given = rows.column(column).into_iter().zip(rows.column(column + 1));
                into.zip(given).for_each(|((x, y), (from_x, from_y))| {
                    [*x, *y] = seen((*from_x).into(), (*from_y).into());
                });
            }
        }
    }
}

/// Not numbers where one of the two is no finite number: the camera did not see the point.
fn seen(x: f64, y: f64) -> [f64; 2] {
    // Zero or not a number. There is no branch, so that a compiler can work on several pixels at once.
    let unseen = 0.0 * x + 0.0 * y;
    [x + unseen, y + unseen]
}

fn paired(columns: &[Vec<f64>]) -> PixelColumns<'_> {
    PixelColumns::new(columns.chunks_exact(2).map(|pair| [&pair[0][..], &pair[1][..]]).collect())
}

/// Runs over an array of either type of floating-point number.
macro_rules! with_floats {
    ($pixels:expr, $array:ident => $body:expr) => {{
        if let Ok($array) = $pixels.extract::<PyReadonlyArray2<f64>>() {
            $body
        } else {
            let $array = $pixels.extract::<PyReadonlyArray2<f32>>().map_err(PyErr::from)?;
            $body
        }
    }};
}

#[pymethods]
impl PyModel {
    /// Places (n, 3) of matched pixels (n, 2 * cameras), into `out`, which is in C order.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
        out: &Bound<'py, PyArray2<f64>>,
    ) -> PyResult<()> {
        with_floats!(pixels, array => self.predict_into(py, &array, out))
    }

    /// Into the rows of `out` (7 or 13, n): X, Y, Z, their standard deviations, the residual, and the six numbers of
    /// the covariance; codes of trust and of mismatch into `codes` (2, n). `test` is the share of correct matches that may
    /// be called a mismatch, and the standard deviations of the pixels, where they are known.
    fn locate<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
        out: &Bound<'py, PyArray2<f64>>,
        codes: &Bound<'py, PyArray2<u8>>,
        test: (f64, Option<Sigmas<'py>>),
    ) -> PyResult<()> {
        with_floats!(pixels, array => self.locate_into(py, &array, (out, codes), &test))
    }

    /// What is doubtful of pixels (n, 2 * cameras), by some of them: their noise and the one that error bars assume, two
    /// cameras that seem exchanged, the share of them that are mismatches where it is most.
    fn doubts(
        &self,
        py: Python<'_>,
        pixels: PyReadonlyArray2<'_, f64>,
        test: (f64, Option<f64>),
    ) -> PyResult<Doubts> {
        let (rate, sigma) = test;
        let pixel = |pair: &[f64]| {
            pair.iter().all(|value| value.is_finite()).then(|| Pixel::new(pair[0], pair[1]))
        };
        let rows = pixels.as_array();
        let rows: Vec<Vec<Option<Pixel>>> = rows
            .rows()
            .into_iter()
            .map(|row| row.to_vec().chunks_exact(2).map(pixel).collect())
            .collect();
        let work = || {
            let map = CalibratedMap::new(&*self.model.reconstructor).with_pixel_sigma(sigma);
            let noisier = noisier_pixels(&map, &rows).map(|it| (it.sigma, it.assumed));
            let mismatched = mismatched_share(&map, &rows, rate).filter(|share| *share > 0.5);
            (noisier, exchanged_cameras(&map, &rows, rate), mismatched)
        };
        py.detach(|| pool().map(|pool| pool.install(work)))
    }

    /// Pixels (n, 2) at which a camera sees places (n, 3); not numbers where it does not see them.
    fn project<'py>(
        &self,
        py: Python<'py>,
        camera: usize,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let out = PyArray2::<f64>::zeros(py, [points.shape()[0], 2], false);
        let map = &*self.model.reconstructor;
        each_row(py, (&points, &out), |place: [f64; 3], row| {
            let found = map.project(camera, Point3::from(place));
            row.copy_from_slice(&found.map_or([f64::NAN; 2], |(pixel, _)| [pixel.x, pixel.y]));
        })?;
        Ok(out)
    }

    /// Rays (n, 6) of a camera's pixels (n, 2): a point of each, then its direction, a unit vector.
    fn rays<'py>(
        &self,
        py: Python<'py>,
        camera: usize,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let out = PyArray2::<f64>::zeros(py, [pixels.shape()[0], 6], false);
        let map = &*self.model.reconstructor;
        each_row(py, (&pixels, &out), |[x, y]: [f64; 2], row| {
            let ray = (x.is_finite() && y.is_finite())
                .then(|| map.unproject(camera, Pixel::new(x, y)))
                .flatten();
            row.fill(f64::NAN);
            if let Some(ray) = ray {
                let direction = ray.direction.normalize();
                for axis in 0..3 {
                    (row[axis], row[3 + axis]) = (ray.origin[axis], direction[axis]);
                }
            }
        })?;
        Ok(out)
    }
}

/// Fills rows of `out` from rows of an array, in parallel.
fn each_row<const N: usize>(
    py: Python,
    (of, out): (&PyReadonlyArray2<f64>, &Bound<PyArray2<f64>>),
    fill: impl Fn([f64; N], &mut [f64]) + Sync,
) -> PyResult<()> {
    let (rows, width) = (of.as_array(), out.shape()[1]);
    let mut into = out.try_readwrite().map_err(|e| invalid(e.to_string(), ""))?;
    let slots = into.as_slice_mut().map_err(|e| invalid(e.to_string(), ""))?;
    py.detach(|| {
        let work = || {
            slots.par_chunks_mut(width).enumerate().with_min_len(64).for_each(|(index, slot)| {
                let mut row = [0.0; N];
                row.iter_mut().zip(rows.row(index)).for_each(|(own, value)| *own = *value);
                fill(row, slot);
            });
        };
        pool().map(|pool| pool.install(work))
    })
}

impl PyModel {
    fn predict_into<T: Element + Copy + Into<f64> + Sync>(
        &self,
        py: Python,
        pixels: &PyReadonlyArray2<T>,
        out: &Bound<PyArray2<f64>>,
    ) -> PyResult<()> {
        let rows = pixels.as_array();
        self.needs(rows.ncols())?;
        if out.shape() != [rows.nrows(), 3] {
            return Err(invalid(
                format!("out has shape {:?}", out.shape()),
                &format!("give an array of shape ({}, 3)", rows.nrows()),
            ));
        }
        if !out.is_c_contiguous() {
            return Err(invalid("out is not in C order", "give an array of float64 in C order"));
        }
        let mut into = out.try_readwrite().map_err(|e| invalid(format!("out: {e}"), ""))?;
        let slots = into.as_slice_mut().map_err(|e| invalid(format!("out: {e}"), ""))?;
        let ready = py.detach(|| self.ready(false))?;
        for (turn, slots) in slots.chunks_mut(3 * TURN).enumerate() {
            py.check_signals()?;
            let first = turn * TURN;
            py.detach(|| {
                let work = || {
                    let blocks = slots.par_chunks_mut(3 * BLOCK).enumerate();
                    blocks.for_each_init(Scratch::default, |scratch, (block, slots)| {
                        let start = first + block * BLOCK;
                        let own = rows.slice(s![start..start + slots.len() / 3, ..]);
                        gather(own, &mut scratch.columns);
                        ready.locator().locate_into(&paired(&scratch.columns), &mut scratch.found);
                        let [x, y, z] = &scratch.found.point;
                        let places = x.iter().zip(y).zip(z);
                        for (slot, ((x, y), z)) in slots.chunks_exact_mut(3).zip(places) {
                            slot.copy_from_slice(&[*x, *y, *z]);
                        }
                    });
                };
                pool().map(|pool| pool.install(work))
            })?;
        }
        Ok(())
    }

    fn locate_into<T: Element + Copy + Into<f64> + Sync>(
        &self,
        py: Python,
        pixels: &PyReadonlyArray2<T>,
        (out, codes): (&Bound<PyArray2<f64>>, &Bound<PyArray2<u8>>),
        (false_alarm, sigmas): &(f64, Option<Sigmas>),
    ) -> PyResult<()> {
        let rows = pixels.as_array();
        let given = sigmas.as_ref().map(Given::of);
        self.needs(rows.ncols())?;
        if let Some(Given::Each(each)) = given {
            refuse_sigmas(rows, each)?;
        }
        let (count, figures) = (rows.nrows(), out.shape()[0]);
        let test = MismatchTest::new(*false_alarm, self.cameras());
        let problem = |e: numpy::BorrowError| invalid(e.to_string(), "");
        let (mut into, mut marks) =
            (out.try_readwrite().map_err(problem)?, codes.try_readwrite().map_err(problem)?);
        let slots = into.as_slice_mut().map_err(|e| invalid(e.to_string(), ""))?;
        let marks = marks.as_slice_mut().map_err(|e| invalid(e.to_string(), ""))?;
        if count == 0 {
            return Ok(());
        }
        let mut columns: Vec<&mut [f64]> = slots.chunks_exact_mut(count).collect();
        let mut marks: Vec<&mut [u8]> = marks.chunks_exact_mut(count).collect();
        let ready = py.detach(|| self.ready(true))?;
        for first in (0..count).step_by(TURN) {
            py.check_signals()?;
            let length = TURN.min(count - first);
            let own = rows.slice(s![first..first + length, ..]);
            let mut blocks = blocks_of(&mut columns, &mut marks, first..first + length);
            py.detach(|| {
                let work = || {
                    let each = blocks.par_iter_mut().enumerate();
                    each.for_each_init(Scratch::default, |scratch, (block, slots)| {
                        let start = block * BLOCK;
                        let end = start + slots.figures[0].len();
                        gather(own.slice(s![start..end, ..]), &mut scratch.columns);
                        let pixels = paired(&scratch.columns);
                        let rows = first + start..first + end;
                        let sigmas = given.map(|given| given.of_rows(rows, &mut scratch.sigmas));
                        let found = &mut scratch.found;
                        ready.locator().locate_noisy_into(&pixels, sigmas.as_ref(), found);
                        slots.fill(&pixels, &scratch.found, (&test, figures));
                    });
                };
                pool().map(|pool| pool.install(work))
            })?;
        }
        Ok(())
    }
}

/// What a task works in.
#[derive(Default)]
struct Scratch {
    columns: Vec<Vec<f64>>,
    sigmas: Vec<Vec<f64>>,
    found: LocatedBatch,
}

/// Where a block's figures go.
struct Slots<'a> {
    figures: Vec<&'a mut [f64]>,
    codes: Vec<&'a mut [u8]>,
}

/// Blocks of columns.
fn blocks_of<'a>(
    columns: &'a mut [&mut [f64]],
    codes: &'a mut [&mut [u8]],
    rows: Range<usize>,
) -> Vec<Slots<'a>> {
    let count = rows.len().div_ceil(BLOCK);
    let mut blocks: Vec<Slots> =
        (0..count).map(|_| Slots { figures: Vec::new(), codes: Vec::new() }).collect();
    for column in columns {
        let parts = column[rows.clone()].chunks_mut(BLOCK);
        blocks.iter_mut().zip(parts).for_each(|(block, part)| block.figures.push(part));
    }
    for column in codes {
        let parts = column[rows.clone()].chunks_mut(BLOCK);
        blocks.iter_mut().zip(parts).for_each(|(block, part)| block.codes.push(part));
    }
    blocks
}

/// What `Located.trust` says of a point that was not located.
const NOT_LOCATED: u8 = 3;

impl Slots<'_> {
    fn fill(
        &mut self,
        pixels: &PixelColumns,
        found: &LocatedBatch,
        (test, figures): (&MismatchTest, usize),
    ) {
        for (column, values) in self.figures.iter_mut().zip(&found.point) {
            column.copy_from_slice(values);
        }
        for (axis, variance) in [0, 3, 5].into_iter().enumerate() {
            let values = self.figures[3 + axis].iter_mut().zip(&found.covariance[variance]);
            values.for_each(|(sigma, variance)| *sigma = variance.sqrt());
        }
        self.figures[6].copy_from_slice(&found.residual);
        if figures > 7 {
            for (column, values) in self.figures[7..].iter_mut().zip(&found.covariance) {
                column.copy_from_slice(values);
            }
        }
        let trust = found.trust.iter().zip(&found.point[0]);
        for (code, (trust, x)) in self.codes[0].iter_mut().zip(trust) {
            *code = match trust {
                _ if x.is_nan() => NOT_LOCATED,
                Trust::Inside => 0,
                Trust::Edge => 1,
                Trust::Outside => 2,
            };
        }
        let mismatches = test.mismatches(pixels, found);
        self.codes[1].iter_mut().zip(mismatches).for_each(|(code, value)| *code = value.into());
    }
}
