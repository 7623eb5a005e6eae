//! NumPy's `.npy`: a matrix with the columns x1, y1, x2, y2, …, and X, Y, Z where their number is odd; three
//! columns are X, Y, Z alone. NaN stands for unknown values.
//!
//! Source: NumPy Enhancement Proposal 1, "A simple file format for NumPy arrays".

use super::{Content, Format, Given, InputFile, Layout, OutputFile};
use crate::tables::{MAGIC, cameras, matrix};
use std::path::Path;
use wheatstone_core::{
    Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
    limits, storage,
};

pub(super) const FORMAT: Format = Format {
    name: "npy",
    about: "NumPy matrix x1 y1 x2 y2 … X Y Z (or X Y Z alone), NaN where unknown",
    layout: Layout::File("npy"),
    content: Content::Points { read: Some(read), write: Some(write), known_only: false },
};

/// A matrix of numbers: its values row by row, and how many columns it has.
///
/// # Errors
///
/// Where the file cannot be read, or is none.
pub fn read_npy(path: &Path) -> Result<(Vec<f64>, usize)> {
    let bytes = storage::read(path, limits::FILE_BYTES)?;
    matrix(path, &bytes)
}

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let file = &files[0];
    let (values, columns) = matrix(&file.path, &file.bytes)?;
    let cameras = cameras(&file.path, columns)?;
    let mut correspondences = Vec::with_capacity(values.len() / columns);
    for (index, row) in values.chunks_exact(columns).enumerate() {
        let wrong = |what: &str| {
            file.error(0, format!("row {}: {what}", index + 1), "write NaN for unknown values")
        };
        if row.iter().any(|value| value.is_infinite() || value.abs() > 1e9) {
            return Err(wrong("a value that is not finite or too large"));
        }
        let together = |part: &[f64]| match part.iter().filter(|value| value.is_nan()).count() {
            0 => Ok(true),
            count if count == part.len() => Ok(false),
            _ => Err(wrong("one coordinate is NaN, but its partner is not")),
        };
        let (pixels, world) = row.split_at(2 * cameras);
        let mut seen = Vec::with_capacity(cameras);
        for pixel in pixels.chunks_exact(2) {
            seen.push(together(pixel)?.then(|| Pixel::new(pixel[0], pixel[1])));
        }
        let world = match world {
            [x, y, z] => together(world)?.then(|| Point3::new(*x, *y, *z)),
            _ => None,
        };
        correspondences.push(Correspondence {
            view: 0,
            id: None,
            pixels: seen,
            world,
            board: None,
        });
    }
    Ok(Dataset { unit: given.unit().into(), cameras, views: Vec::new(), correspondences })
}

fn write(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    let with_world = data.known().next().is_some();
    let columns = 2 * data.cameras + if with_world { 3 } else { 0 };
    let rows = data.correspondences.len();
    let mut bytes = heading("<f8", &[rows, columns]);
    for row in &data.correspondences {
        let pixels = row.pixels.iter().flat_map(|p| p.map_or([f64::NAN; 2], |p| [p.x, p.y]));
        let world = row.world.map_or([f64::NAN; 3], |p| [p.x, p.y, p.z]);
        let world = world.into_iter().filter(|_| with_world);
        bytes.extend(pixels.chain(world).flat_map(f64::to_le_bytes));
    }
    Ok(vec![OutputFile { name: String::new(), bytes }])
}

/// What stands before the numbers of an array of at least two axes.
fn heading(kind: &str, shape: &[usize]) -> Vec<u8> {
    let shape = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    // The body begins at a multiple of 64 bytes.
    let padded = (dictionary.len() + 1 + 10).next_multiple_of(64) - 10;
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(format!("{dictionary:<width$}\n", width = padded - 1).bytes());
    bytes
}

/// The `.npy` file of a matrix of float32: (rows, columns), and its numbers row by row.
#[must_use]
pub fn npy_float32((rows, columns): (usize, usize), values: &[f32]) -> Vec<u8> {
    let mut bytes = heading("<f4", &[rows, columns]);
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// The `.npy` file of an array of float64: how many along each axis, of which there are at least two, and its
/// numbers, those of the last axis one after the other.
#[must_use]
pub fn npy_float64(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let mut bytes = heading("<f8", shape);
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
