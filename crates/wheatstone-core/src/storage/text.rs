//! What a file is that is no text.

use crate::{
    Error,
    error::{Hint, Remedy},
};
use std::{path::Path, str::Utf8Error};

/// Kinds of files that are given for text, by their first bytes.
enum Kind {
    Workbook,
    Archive,
    Arrays,
    Array,
    Utf16,
    Picture,
}

impl Kind {
    fn of(first: &[u8]) -> Option<Self> {
        match first {
            [b'P', b'K', 3, 4, ..] if holds_arrays(first) => Some(Self::Arrays),
            [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => Some(Self::Array),
            [b'P', b'K', 3, 4, ..] if !is_workbook(first) => Some(Self::Archive),
            // A ZIP archive, and the compound file of older programs.
            [b'P', b'K', 3, 4, ..] | [0xD0, 0xCF, 0x11, 0xE0, ..] => Some(Self::Workbook),
            [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => Some(Self::Utf16),
            // Without a mark of their order, every other byte is 0 where letters are Latin.
            [a, b, c, d, ..]
                if [*a == 0, *b == 0] == [*c == 0, *d == 0] && (*a == 0) != (*b == 0) =>
            {
                Some(Self::Utf16)
            }
            // JPEG, PNG, and TIFF of either order of bytes.
            [0xFF, 0xD8, 0xFF, ..]
            | [0x89, b'P', b'N', b'G', ..]
            | [b'I', b'I', 42, 0, ..]
            | [b'M', b'M', 0, 42, ..] => Some(Self::Picture),
            _ => None,
        }
    }
}

/// The name of the first file in a ZIP archive. It begins at byte 30, and its length stands at byte 26
/// (APPNOTE.TXT, 4.3.7).
fn first_name(first: &[u8]) -> &[u8] {
    let length =
        first.get(26..28).map_or(0, |two| usize::from(u16::from_le_bytes([two[0], two[1]])));
    first.get(30..30 + length).unwrap_or_default()
}

/// Whether a ZIP archive begins with an array of NumPy's.
fn holds_arrays(first: &[u8]) -> bool {
    first_name(first).ends_with(b".npy")
}

/// Whether a ZIP archive begins as the workbooks of office programs do.
fn is_workbook(first: &[u8]) -> bool {
    const NAMES: [&[u8]; 7] =
        [b"[Content_Types]", b"_rels/", b"docProps/", b"xl/", b"mimetype", b"META-INF/", b"Index/"];
    NAMES.iter().any(|name| first_name(first).starts_with(name))
}

/// Refuses a file of a kind that is known for no text, by its first bytes.
///
/// # Errors
///
/// [`Error::Malformed`] with what it is and what to do about it.
pub fn refuse_other_kinds(path: &Path, first: &[u8]) -> crate::Result<()> {
    let Some(kind) = Kind::of(first) else { return Ok(()) };
    let (problem, hint) = match kind {
        Kind::Workbook => ("a workbook, not a text file", "save the table as CSV".into()),
        Kind::Archive => ("a ZIP archive, not a text file", "give the file that is in it".into()),
        Kind::Arrays => (
            "an archive of NumPy arrays (.npz)",
            "save one matrix of x1 y1 x2 y2 … X Y Z with `numpy.save`, as .npy".into(),
        ),
        Kind::Array => ("a NumPy array, not a text file", "save it as text, such as CSV".into()),
        Kind::Utf16 => ("text in UTF-16", "save it as UTF-8 (`CSV UTF-8` in a spreadsheet)".into()),
        Kind::Picture => (
            "a picture, not a text file",
            Hint::new(
                "give the folder of the capture, which names its pictures",
                Remedy::NewCapture,
            ),
        ),
    };
    Err(Error::Malformed { path: path.into(), line: None, problem: problem.into(), hint })
}

/// Bytes as text; messages name `path`.
///
/// # Errors
///
/// [`Error::Malformed`] where they are not UTF-8.
pub fn text<'a>(path: &Path, bytes: &'a [u8]) -> crate::Result<&'a str> {
    std::str::from_utf8(bytes).map_err(|fault| not_text(path, bytes, fault))
}

/// What is wrong with bytes that are not UTF-8.
pub(super) fn not_text(path: &Path, bytes: &[u8], fault: Utf8Error) -> Error {
    if let Err(known) = refuse_other_kinds(path, bytes) {
        return known;
    }
    let before = &bytes[..fault.valid_up_to()];
    Error::Malformed {
        path: path.into(),
        line: Some(before.iter().filter(|b| **b == b'\n').count() as u64 + 1),
        problem: "not text (UTF-8)".into(),
        hint: "is this the file that you meant? If so, save it as UTF-8".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_text_is_told_by_its_first_bytes() {
        for (bytes, problem, hint) in [
            (&b"PK\x03\x04\xff"[..], "f: a ZIP archive", "give the file"),
            (
                b"PK\x03\x04......................\x05\0\0\0a.csv\xff",
                "f: a ZIP archive",
                "give the file",
            ),
            (
                b"PK\x03\x04......................\x0b\0\0\0_rels/.rels\xff",
                "f: a workbook",
                "save the table as CSV",
            ),
            (
                b"PK\x03\x04......................\x05\0\0\0a.npy\xff",
                "f: an archive of NumPy arrays",
                "save one matrix",
            ),
            (b"\x93NUMPY\x01\0", "f: a NumPy array", "save it as text"),
            (b"\xD0\xCF\x11\xE0", "f: a workbook", "save the table as CSV"),
            (b"\xFF\xFEx\0", "f: text in UTF-16", "save it as UTF-8"),
            (b"\xFE\xFF\0x", "f: text in UTF-16", "save it as UTF-8"),
            (b"\xFF\xD8\xFF\xE0", "f: a picture", "give the folder of the capture"),
            (b"\x89PNG\r\n", "f: a picture", "give the folder of the capture"),
            (b"II*\0\xFF", "f: a picture", "give the folder of the capture"),
            (b"MM\0*\xFF", "f: a picture", "give the folder of the capture"),
            (b"a\n\xFF", "f:2: not text (UTF-8)", "is this the file"),
        ] {
            let error = text(Path::new("f"), bytes).unwrap_err();
            assert!(error.to_string().starts_with(problem), "{error}");
            assert!(error.hint().unwrap().starts_with(hint), "{error}");
        }
        for unmarked in [b"x\0,\0", b"\0x\0,"] {
            let error = refuse_other_kinds(Path::new("f"), unmarked).unwrap_err();
            assert!(error.to_string().contains("UTF-16"), "{error}");
        }
        assert_eq!(text(Path::new("f"), "PKé".as_bytes()).unwrap(), "PKé");
    }
}
