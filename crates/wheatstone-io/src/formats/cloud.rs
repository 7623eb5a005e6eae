//! Located points as clouds for viewers: PLY and PCD. Only X, Y, Z of points whose place is known go out, and
//! come in again from files laid out like ours: binary, nothing else than x, y and z of all points.
//!
//! Sources: the PLY format of G. Turk (Stanford, 1994); PCD 0.7 of the Point Cloud Library, whose own readers
//! want `float` coordinates: it rounds to 24 bits, one part in seventeen million.

use super::{Content, Format, Given, InputFile, Layout, OutputFile};
use wheatstone_core::{
    Result,
    dataset::{Correspondence, Dataset},
    geometry::Point3,
};

/// Binary, doubles: nothing is lost.
pub(super) const PLY: Format = Format {
    name: "ply",
    about: "point cloud for viewers, X Y Z as doubles",
    layout: Layout::File("ply"),
    content: Content::Points { read: Some(read_ply), write: Some(ply), known_only: true },
};

/// Binary, floats.
pub(super) const PCD: Format = Format {
    name: "pcd",
    about: "point cloud of the Point Cloud Library, X Y Z as floats",
    layout: Layout::File("pcd"),
    content: Content::Points { read: Some(read_pcd), write: Some(pcd), known_only: true },
};

fn places(data: &Dataset) -> Vec<[f64; 3]> {
    data.known().map(|(p, _)| [p.x, p.y, p.z]).collect()
}

fn ply(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    let places = places(data);
    let unit: String = data.unit.chars().filter(|c| !c.is_control()).collect();
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment unit {unit}\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\nend_header\n",
        places.len()
    );
    let mut bytes = header.into_bytes();
    bytes.extend(places.into_iter().flatten().flat_map(f64::to_le_bytes));
    Ok(vec![OutputFile { name: String::new(), bytes }])
}

fn pcd(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    let places = places(data);
    let count = places.len();
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n\
         COUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    );
    let mut bytes = header.into_bytes();
    bytes.extend(places.into_iter().flatten().flat_map(|value| (value as f32).to_le_bytes()));
    Ok(vec![OutputFile { name: String::new(), bytes }])
}

/// The lines before the body of a file, and the body.
fn divided<'a>(file: &'a InputFile, last: &str) -> Result<(Vec<&'a str>, &'a [u8])> {
    let wrong = |problem: &str| file.error(0, problem.into(), OURS);
    let end = file.bytes.windows(last.len()).position(|part| part == last.as_bytes());
    let end = end.ok_or_else(|| wrong("its header has no end"))? + last.len();
    let header = std::str::from_utf8(&file.bytes[..end]);
    let header = header.map_err(|_| wrong("its header is not text"))?;
    Ok((header.lines().collect(), &file.bytes[end..]))
}

const OURS: &str = "binary clouds of x, y, z alone are read, as they are written here";

/// Points of a body of numbers, `count` times three.
fn cloud(
    file: &InputFile,
    (values, count): (impl Iterator<Item = f64>, Option<usize>),
    unit: &str,
) -> Result<Dataset> {
    let values: Vec<f64> = values.collect();
    if !values.len().is_multiple_of(3) || count != Some(values.len() / 3) {
        return Err(file.error(0, "it holds fewer or more points than it says".into(), OURS));
    }
    if let Some(odd) = values.iter().find(|value| value.is_infinite() || value.abs() > 1e100) {
        return Err(file.error(0, format!("{odd} is not a coordinate"), OURS));
    }
    let places = values.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2]));
    let row = |place: Point3| Correspondence {
        view: 0,
        id: None,
        pixels: Vec::new(),
        world: (!place.iter().any(|value| value.is_nan())).then_some(place),
        board: None,
    };
    Ok(Dataset {
        unit: unit.into(),
        cameras: 0,
        views: Vec::new(),
        correspondences: places.map(row).collect(),
    })
}

fn read_ply(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let file = &files[0];
    let (header, body) = divided(file, "end_header\n")?;
    let line = |start: &str| header.iter().find_map(|line| line.strip_prefix(start));
    let properties: Vec<&str> =
        header.iter().filter_map(|line| line.strip_prefix("property ")).collect();
    let elements = header.iter().filter(|line| line.starts_with("element ")).count();
    if header.first() != Some(&"ply")
        || line("format ") != Some("binary_little_endian 1.0")
        || properties != ["double x", "double y", "double z"]
        || elements != 1
    {
        return Err(file.error(0, "not a point cloud of this layout".into(), OURS));
    }
    let unit = given.unit.as_deref().or(line("comment unit ")).unwrap_or("mm");
    let count = line("element vertex ").and_then(|count| count.trim().parse().ok());
    let (values, rest) = body.as_chunks::<8>();
    if !rest.is_empty() {
        return Err(file.error(0, "it ends within a number".into(), OURS));
    }
    cloud(file, (values.iter().map(|bytes| f64::from_le_bytes(*bytes)), count), unit)
}

fn read_pcd(files: &[InputFile], given: &Given) -> Result<Dataset> {
    let file = &files[0];
    let (header, body) = divided(file, "DATA binary\n")?;
    let line = |start: &str| header.iter().find_map(|line| line.strip_prefix(start));
    let layout = ["FIELDS ", "SIZE ", "TYPE ", "COUNT "].map(line);
    if layout != [Some("x y z"), Some("4 4 4"), Some("F F F"), Some("1 1 1")] {
        return Err(file.error(0, "not a point cloud of this layout".into(), OURS));
    }
    let count = line("POINTS ").and_then(|count| count.trim().parse().ok());
    let (values, rest) = body.as_chunks::<4>();
    if !rest.is_empty() {
        return Err(file.error(0, "it ends within a number".into(), OURS));
    }
    let values = values.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes)));
    cloud(file, (values, count), given.unit())
}
