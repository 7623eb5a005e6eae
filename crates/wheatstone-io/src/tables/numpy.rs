//! NumPy's `.npy`: a matrix, whose number of columns tells what they are.
//!
//! Source: NumPy Enhancement Proposal 1, "A simple file format for NumPy arrays".

use super::cells::malformed;
use arrow_array::{ArrayRef, Float64Array, RecordBatch};
use std::{path::Path, sync::Arc};
use wheatstone_core::Result;

/// With this the file of an array begins.
pub(crate) const MAGIC: &[u8] = b"\x93NUMPY";

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

/// The values of a matrix row by row, and how many columns it has.
pub(crate) fn matrix(path: &Path, bytes: &[u8]) -> Result<(Vec<f64>, usize)> {
    let wrong = |problem: &str| malformed(path, None, problem.into(), HINT);
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

/// The cameras whose pixels a matrix of so many columns has.
pub(crate) fn cameras(path: &Path, columns: usize) -> Result<usize> {
    let with_world = columns % 2 == 1;
    let cameras = if with_world { columns.saturating_sub(3) / 2 } else { columns / 2 };
    if columns < 3 || cameras == 1 {
        let problem = format!("{columns} columns are neither X Y Z nor the pixels of two cameras");
        let hint = "give columns x1 y1 x2 y2 …, then X Y Z where known";
        return Err(malformed(path, None, problem, hint));
    }
    Ok(cameras)
}

/// A matrix as a table, with the names of its columns.
pub(super) fn table(path: &Path, bytes: &[u8]) -> Result<RecordBatch> {
    let (values, columns) = matrix(path, bytes)?;
    let pixels = (1..=cameras(path, columns)?)
        .flat_map(|camera| [format!("x{camera}"), format!("y{camera}")]);
    let names = pixels.chain(["X", "Y", "Z"].map(str::to_owned)).take(columns);
    let column = |(index, name): (usize, String)| {
        let values = values.iter().skip(index).step_by(columns).copied();
        (name, Arc::new(values.collect::<Float64Array>()) as ArrayRef)
    };
    RecordBatch::try_from_iter(names.enumerate().map(column))
        .map_err(|e| malformed(path, None, e.to_string(), HINT))
}

#[cfg(test)]
mod tests {
    use crate::{
        formats::npy_float64,
        tables::{TableOptions, TableReader},
    };
    use std::path::Path;

    #[test]
    fn an_array_is_a_table_whose_names_its_width_tells() {
        let values: Vec<f64> = (0..14).map(f64::from).collect();
        let bytes = npy_float64(&[2, 7], &values);
        let options = TableOptions::default();
        let reader = TableReader::of_bytes(Path::new("a.npy"), bytes.clone(), &options).unwrap();
        let names: Vec<&str> = reader.names().collect();
        assert_eq!(names, ["x1", "y1", "x2", "y2", "X", "Y", "Z"]);
        let data = reader.gather(&options).unwrap();
        assert_eq!(data.correspondences[1].world.unwrap().x, 11.0);
        let pixels = npy_float64(&[1, 4], &values[..4]);
        let reader = TableReader::of_bytes(Path::new("a.npy"), pixels, &options).unwrap();
        assert_eq!(reader.cameras(), 2);
        let refused = |bytes: &[u8]| {
            let read = TableReader::of_bytes(Path::new("a"), bytes.into(), &options);
            read.err().unwrap().to_string()
        };
        assert_eq!(refused(&bytes[..200]), "a: its size does not match its shape");
        assert!(refused(b"FEA1\0\0\0\0").contains("Feather file of version 1"));
    }
}
