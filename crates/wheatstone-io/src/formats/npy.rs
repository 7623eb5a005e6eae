//! NumPy's `.npy`: a matrix with the columns x1, y1, x2, y2, …, and X, Y, Z where their number is odd; three
//! columns are X, Y, Z alone. NaN stands for unknown values.
//!
//! Source: NumPy Enhancement Proposal 1, "A simple file format for NumPy arrays".

use super::{Content, Format, Given, InputFile, Layout, OutputFile};
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

const MAGIC: &[u8] = b"\x93NUMPY";

const HINT: &str = "write a float64 matrix with `numpy.save`";

/// How numbers lie in the file.
#[derive(Clone, Copy)]
struct Kind {
    big: bool,
    float: bool,
    signed: bool,
    bytes: usize,
}

impl Kind {
    /// From NumPy's word for it, such as `<f8`.
    fn named(word: &str) -> Option<Self> {
        let mut letters = word.chars();
        let big = match letters.next()? {
            '<' | '|' | '=' => false,
            '>' => true,
            _ => return None,
        };
        let (float, signed) = match letters.next()? {
            'f' => (true, true),
            'i' => (false, true),
            'u' => (false, false),
            _ => return None,
        };
        let bytes: usize = letters.as_str().parse().ok()?;
        let known = if float { [4, 8].contains(&bytes) } else { [1, 2, 4, 8].contains(&bytes) };
        known.then_some(Self { big, float, signed, bytes })
    }

    fn number(self, bytes: &[u8]) -> f64 {
        let mut whole = [0_u8; 8];
        for (index, byte) in bytes.iter().enumerate() {
            let place = if self.big { bytes.len() - 1 - index } else { index };
            whole[place] = *byte;
        }
        let bits = u64::from_le_bytes(whole);
        match (self.float, self.bytes) {
            (true, 4) => f64::from(f32::from_bits(bits as u32)),
            (true, _) => f64::from_bits(bits),
            (false, bytes) if self.signed => {
                let unused = 64 - 8 * bytes as u32;
                ((bits << unused) as i64 >> unused) as f64
            }
            _ => bits as f64,
        }
    }
}

/// What stands after a key of the header up to the next comma outside of brackets.
fn entry<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}'"))?;
    let rest = rest.trim_start().strip_prefix(':')?.trim_start();
    let end = if rest.starts_with('(') { rest.find(')')? + 1 } else { rest.find([',', '}'])? };
    Some(rest[..end].trim())
}

/// The matrix, and how many columns it has.
fn matrix(file: &InputFile) -> Result<(Vec<f64>, usize)> {
    let wrong = |problem: &str| file.error(0, problem.into(), HINT);
    let bytes = &file.bytes;
    let (version, rest) = match bytes.strip_prefix(MAGIC) {
        Some([version, _, rest @ ..]) => (*version, rest),
        _ => return Err(wrong("not a NumPy file")),
    };
    let (length, rest) = match (version, rest) {
        (1, [a, b, rest @ ..]) => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        (2 | 3, [a, b, c, d, rest @ ..]) => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
        _ => return Err(wrong("an unknown version of the NumPy format")),
    };
    let (header, body) =
        rest.split_at_checked(length).ok_or_else(|| wrong("the header is cut off"))?;
    let header = String::from_utf8_lossy(header);
    let kind = entry(&header, "descr").map(|word| word.trim_matches('\''));
    let kind =
        kind.and_then(Kind::named).ok_or_else(|| wrong("its entries are not plain numbers"))?;
    let by_column = entry(&header, "fortran_order") == Some("True");
    let shape: Vec<usize> = entry(&header, "shape")
        .map(|shape| shape.trim_matches(['(', ')']).split(',').map(str::trim))
        .into_iter()
        .flatten()
        .filter(|side| !side.is_empty())
        .map(|side| side.parse().map_err(|_| wrong("its shape is not understood")))
        .collect::<Result<_>>()?;
    let [rows, columns] = shape[..] else { return Err(wrong("it is not a matrix")) };
    let size = rows.checked_mul(columns).and_then(|count| count.checked_mul(kind.bytes));
    if size != Some(body.len()) {
        return Err(wrong("its size does not match its shape"));
    }
    let values: Vec<f64> = body.chunks_exact(kind.bytes).map(|bytes| kind.number(bytes)).collect();
    if !by_column {
        return Ok((values, columns));
    }
    let place = |index: usize| values[index % columns * rows + index / columns];
    Ok(((0..values.len()).map(place).collect(), columns))
}

/// A matrix of numbers: its values row by row, and how many columns it has.
///
/// # Errors
///
/// Where the file cannot be read, or is none.
pub fn read_npy(path: &Path) -> Result<(Vec<f64>, usize)> {
    let bytes = storage::read(path, limits::FILE_BYTES)?;
    matrix(&InputFile { path: path.into(), bytes })
}

fn read(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let file = &files[0];
    let (values, columns) = matrix(file)?;
    let with_world = columns % 2 == 1;
    let cameras = if with_world { columns.saturating_sub(3) / 2 } else { columns / 2 };
    if columns < 3 || cameras == 1 {
        return Err(file.error(
            0,
            format!("{columns} columns are neither X Y Z nor the pixels of two cameras"),
            "give columns x1 y1 x2 y2 …, then X Y Z where known",
        ));
    }
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
