//! Which format files are in, by their names and their first words.

use super::{Format, myptv_cameras};
use std::{
    io::Read,
    path::{Path, PathBuf},
};
use wheatstone_core::{
    Error, Result,
    error::{Hint, Remedy},
    storage,
};

/// What the names of files say, surest first.
const BY_NAME: [(&str, &str); 16] = [
    (".cameramodel", "mrcal"),
    ("cameras.txt", "colmap"),
    (".toml", "anipose"),
    (".ori", "openptv"),
    (".npy", "npy"),
    (".parquet", "parquet"),
    (".arrow", "arrow"),
    (".feather", "arrow"),
    (".ply", "ply"),
    (".pcd", "pcd"),
    (".vnl", "vnl"),
    ("_targets", "openptv-targets"),
    ("markers_c0.txt", "proptv"),
    ("cal_points", "myptv"),
    ("xypts.csv", "dltdv-points"),
    ("xyzpts.csv", "dltdv-points"),
];

/// The format of files (or of the files in a folder) that are to be read; `None` for a model file.
///
/// # Errors
///
/// [`Error::Io`] where they cannot be read, [`Error::Malformed`] where nothing tells.
pub fn guess(paths: &[PathBuf]) -> Result<Option<&'static Format>> {
    let refuse = |path: &Path, problem: &str, hint: Hint| Error::Malformed {
        path: path.into(),
        line: None,
        problem: problem.into(),
        hint,
    };
    let unknown = |path: &Path| {
        let hint = Hint::new("say what it is", Remedy::SourceFormat);
        refuse(path, "the format cannot be recognised", hint)
    };
    let first = paths.first().ok_or_else(|| unknown(Path::new("")))?;
    let names = if first.is_dir() { listing(first)? } else { paths.to_vec() };
    let name_of = |path: &PathBuf| path.to_string_lossy().to_lowercase();
    for (end, format) in BY_NAME {
        if names.iter().any(|path| name_of(path).ends_with(end)) {
            return Format::named(format).map(Some);
        }
    }
    if first.is_dir() {
        let yaml = names.iter().any(|path| name_of(path).ends_with(".yaml"));
        if yaml {
            return Format::named("ros").map(Some);
        }
        if names.iter().any(|path| name_of(path).ends_with("pair.yml")) {
            let hint = Hint::new("export the model in another format", Remedy::Formats);
            return Err(refuse(
                first,
                "a rectified pair of the format `remap`, which is not read",
                hint,
            ));
        }
        // Files without extensions, or with one that says nothing: their first words tell.
        let is_plain = |path: &&PathBuf| path.extension().is_none_or(|end| end == "txt");
        let plain = names.iter().find(|path| path.is_file() && is_plain(path));
        let header = plain.map(|path| beginning(path)).transpose()?.unwrap_or_default();
        return match by_words(&header, "") {
            Some(Some(format)) => Format::named(format).map(Some),
            _ => Err(unknown(first)),
        };
    }
    let text = beginning(first)?;
    if is_coefficients(&text) {
        let problem = "11 lines of numbers, as `dlt`, `dltdv` and `dltdv8` have DLT coefficients: the formats differ in where pixels begin, which the file does not say";
        return Err(refuse(
            first,
            problem,
            Hint::new("say which of them it is", Remedy::SourceFormat),
        ));
    }
    by_words(&text, &name_of(first)).ok_or_else(|| unknown(first))?.map(Format::named).transpose()
}

/// The first text of a file: a model's first field stands first, and a header does too.
fn beginning(path: &Path) -> Result<String> {
    let mut bytes = Vec::new();
    let opened = storage::open(path)?;
    opened.take(1 << 16).read_to_end(&mut bytes).map_err(|e| Error::reading(path, e))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Whether it is eleven lines of as many numbers each.
fn is_coefficients(text: &str) -> bool {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    // How many; none where a cell is no number.
    let numbers = |line: &str| {
        let cells = line.split([',', ';', '\t', ' ']).filter(|cell| !cell.is_empty());
        cells.map(|cell| cell.parse::<f64>().ok()).collect::<Option<Vec<_>>>().map(|row| row.len())
    };
    let counts: Vec<Option<usize>> = lines.take(12).map(numbers).collect();
    counts.len() == 11 && counts[0].is_some() && counts.iter().all(|count| *count == counts[0])
}

/// Outer `None` where nothing tells, inner `None` for a model.
fn by_words(text: &str, name: &str) -> Option<Option<&'static str>> {
    if text.contains("\"wheatstone-calibration\"") {
        return Some(None);
    }
    let header = text.lines().next().unwrap_or("");
    let is = |format| Some(Some(format));
    if header.trim() == myptv_cameras::HEADING {
        return is("myptv-cameras");
    }
    if text.contains("lensmodel") || text.contains("lens_model") {
        return is("mrcal");
    }
    if [".yml", ".yaml", ".json"].iter().any(|end| name.ends_with(end)) {
        if text.contains("projection_matrix") && text.contains("camera_matrix") {
            return is("ros");
        }
        if text.contains("cam0") && text.contains("intrinsics") {
            return is("kalibr");
        }
        return is("opencv");
    }
    if header.contains("x1") && header.contains("x2") {
        return is("csv");
    }
    if header.contains("pt1_cam1_X") {
        return is("dltdv-points");
    }
    if header.starts_with("# filename") {
        return is("vnl");
    }
    if header.trim() == "image size" {
        return is("mayacam");
    }
    // A table of coefficients has no header.
    let table = [".csv", ".tsv", ".csv.gz"].iter().any(|end| name.ends_with(end));
    if table && (name.ends_with(".gz") || header.contains(char::is_alphabetic)) {
        return is("csv");
    }
    None
}

fn listing(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::reading(folder, e))? {
        names.push(entry.map_err(|e| Error::reading(folder, e))?.path());
    }
    names.sort();
    Ok(names)
}
