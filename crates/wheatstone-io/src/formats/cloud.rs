//! Located points as clouds for viewers: PLY and PCD. Only X, Y, Z of points whose place is known go out.
//!
//! Sources: the PLY format of G. Turk (Stanford, 1994); PCD 0.7 of the Point Cloud Library, whose own readers
//! want `float` coordinates: it rounds to 24 bits, one part in seventeen million.

use super::{Content, Format, Given, Layout, OutputFile};
use wheatstone_core::{
    Result,
    dataset::Dataset,
    error::{Hint, Remedy},
};

/// Binary, doubles: nothing is lost.
pub(super) const PLY: Format = Format {
    name: "ply",
    about: "point cloud for viewers, X Y Z as doubles",
    layout: Layout::File("ply"),
    content: Content::Points { read: None, write: Some(ply) },
};

/// Binary, floats.
pub(super) const PCD: Format = Format {
    name: "pcd",
    about: "point cloud of the Point Cloud Library, X Y Z as floats",
    layout: Layout::File("pcd"),
    content: Content::Points { read: None, write: Some(pcd) },
};

fn places(data: &Dataset, format: &str) -> Result<Vec<[f64; 3]>> {
    let places: Vec<[f64; 3]> = data.known().map(|(p, _)| [p.x, p.y, p.z]).collect();
    if places.is_empty() {
        return Err(Format::unsupported(
            format,
            "points without X, Y, Z".into(),
            Hint::new("locate them first", Remedy::Locate),
        ));
    }
    Ok(places)
}

fn ply(data: &Dataset, _given: &Given) -> Result<Vec<OutputFile>> {
    let places = places(data, PLY.name)?;
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
    let places = places(data, PCD.name)?;
    let count = places.len();
    let header = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n\
         COUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    );
    let mut bytes = header.into_bytes();
    bytes.extend(places.into_iter().flatten().flat_map(|value| (value as f32).to_le_bytes()));
    Ok(vec![OutputFile { name: String::new(), bytes }])
}
